"""Viscosity beside the faces of the box, where a sweep that knows no faces has it wrong.

    wall   tangential: the second difference at q₀, half a cell from the wall, is that of the cubic
           through the wall's speed U and the three values inside; a sweep with the ghost 2U - q₀
           has left out (6U / 5 - 2 q₀ + q₁ - q₂ / 5) / h² of it
    open   tangential: no viscous shear along the face
    both   the fourth difference of `central4`, which reads further than ghosts are right, is left
           out of the two values nearest to the face, and of the first normal velocity inside

Cells so few that there is no cubic take the parabola, or the ghost. All of it is added explicitly,
in implicit steps, too: there `helmholtz` solves with the ghosts of walls at rest.
"""

from collections.abc import Sequence

from solver.boundary import FACE, box_sides, inward, side_name
from solver.grid import Field, Grid
from solver.kernel import GHOSTS, INT, REAL, VIEW, inlined, kernel
from solver.scene_physics import MovingWall

# Of U, q₀, q₁, q₂ and the ghost, in what is added: per number of values inside a wall; open faces.
WALL = {1: (0.0, 0.0, 0.0, 0.0, 0.0), 2: (2 / 3, -1.0, 1 / 3, 0.0, 0.0),
        3: (6 / 5, -2.0, 1.0, -1 / 5, 0.0)}
OPEN = (0.0, 1.0, 0.0, 0.0, -1.0)


def mend_shear(grid: Grid, made: Sequence[Field], now: Sequence[Field], rates: Field, far: Field,
               implicit: bool) -> None:
    """Correct u, v, w in the making.

    rates     D dt / h² per axis of what a sweep has added by the ghosts of `now`, or `implicit`, of
              what is yet to be solved for as if all walls were at rest: then their speed is added
    far       share of the fourth difference in it, per axis (`diffusion`)
    """
    for axis in (a for a in range(3) if rates[a]):
        for side in box_sides(grid, axis):
            face = grid.domain.face(side_name(axis, side))
            if face == "slip":
                continue
            weights = OPEN if face == "open" else WALL[min(grid.cells[axis], 3)]
            for component in range(3):
                new, old = (inward(fields[component], axis, side) for fields in (made, now))
                speed = face.wall[component] if isinstance(face, MovingWall) else 0.0
                if component != axis:
                    mend_along(new, old, speed, 2 * speed * implicit, rates[axis], far[axis],
                               *weights)
                elif far[axis]:
                    mend_normal(new, old, FACE[side] + 1, rates[axis] * far[axis])


@inlined
def fourth(before2, before, here, after, after2):
    """The fourth difference."""
    return before2 - 4 * (before + after) + 6 * here + after2


@kernel(VIEW, VIEW, *[REAL] * 9)
def mend_along(made, now, speed, moving, amount, far, at_wall, first, second, third, at_ghost):
    """The two layers of a velocity along a face that are nearest to it; `moving` is the part of the
    ghosts that has not been seen."""
    two, three = min(GHOSTS + 2, made.shape[0] - 1), min(GHOSTS + 3, made.shape[0] - 1)
    for b in range(made.shape[1]):
        for c in range(made.shape[2]):
            ghost2, ghost = now[GHOSTS - 2, b, c] - moving, now[GHOSTS - 1, b, c] - moving
            q0, q1, q2, q3 = (now[GHOSTS, b, c], now[GHOSTS + 1, b, c], now[two, b, c],
                              now[three, b, c])
            made[GHOSTS, b, c] += amount * (
                moving + at_wall * speed + first * q0 + second * q1 + third * q2 + at_ghost * ghost
                + far * fourth(ghost2, ghost, q0, q1, q2))
            if far:
                made[GHOSTS + 1, b, c] += amount * far * fourth(ghost, q0, q1, q2, q3)


@kernel(VIEW, VIEW, INT, REAL)
def mend_normal(made, now, layer, amount):
    """The first layer inside of the velocity normal to a face."""
    for b in range(made.shape[1]):
        for c in range(made.shape[2]):
            made[layer, b, c] += amount * fourth(now[layer - 2, b, c], now[layer - 1, b, c],
                                                 now[layer, b, c], now[layer + 1, b, c],
                                                 now[layer + 2, b, c])
