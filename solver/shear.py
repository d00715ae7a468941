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
from solver.kernel import GHOSTS, INT, REAL, VIEW, kernel
from solver.scene_physics import MovingWall

# Of U, q₀, q₁, q₂ in what the ghost leaves out, per number of values inside.
CURVES = {1: (0.0, 0.0, 0.0, 0.0), 2: (2 / 3, -1.0, 1 / 3, 0.0), 3: (6 / 5, -2.0, 1.0, -1 / 5)}


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
            for component, (new, old) in enumerate(zip(made, now, strict=True)):
                new, old = inward(new, axis, side), inward(old, axis, side)
                speed = face.wall[component] if isinstance(face, MovingWall) else 0.0
                if component == axis:
                    if far[axis]:
                        lift_fourth(new, old, 0.0, FACE[side] + 1, 1, rates[axis] * far[axis])
                    continue
                if far[axis]:
                    lift_fourth(new, old, 2 * speed * implicit, GHOSTS, 2, rates[axis] * far[axis])
                if face == "open":
                    lift_shear(new, old, rates[axis])
                else:
                    add_curve(new, old, speed, 2 * speed * implicit, rates[axis],
                              *CURVES[min(grid.cells[axis], 3)])


@kernel(VIEW, VIEW, *[REAL] * 7)
def add_curve(made, now, speed, moving, amount, at_wall, first, second, third):
    """What the ghost leaves out at a wall, and `moving` for a ghost that has left out its speed."""
    beyond = min(GHOSTS + 2, made.shape[0] - 1)
    for b in range(made.shape[1]):
        for c in range(made.shape[2]):
            made[GHOSTS, b, c] += amount * (
                moving + at_wall * speed + first * now[GHOSTS, b, c]
                + second * now[GHOSTS + 1, b, c] + third * now[beyond, b, c])


@kernel(VIEW, VIEW, REAL)
def lift_shear(made, now, amount):
    """Take back the shear with the ghosts beyond a face."""
    for b in range(now.shape[1]):
        for c in range(now.shape[2]):
            made[GHOSTS, b, c] += amount * (now[GHOSTS, b, c] - now[GHOSTS - 1, b, c])


@kernel(VIEW, VIEW, REAL, INT, INT, REAL)
def lift_fourth(made, now, moving, first, number, amount):
    """Take back the fourth difference of `number` values from layer `first` on; `moving` is the
    part of the ghosts that it has not seen."""
    for layer in range(first, first + number):
        for b in range(made.shape[1]):
            for c in range(made.shape[2]):
                before = now[layer - 1, b, c]
                before2 = now[layer - 2, b, c] - moving
                if layer == GHOSTS:
                    before -= moving
                made[layer, b, c] += amount * (
                    before2 - 4 * (before + now[layer + 1, b, c]) + 6 * now[layer, b, c]
                    + now[layer + 2, b, c])
