"""Ghost values: what the fields are beyond the faces of the box.

    face       normal velocity          tangential velocity          temperature, scalars
    wall       0 on the face            -mirror + 2 × the wall's     mirror
                                        speed
    slip       0 on the face            mirror                       mirror
    open, out  free on the face,        copy of the last             copy of the last
               a parabola beyond
    open, in   free on the face,        -mirror: the air outside     ambient
               0 beyond: still air      is still
    periodic   the far side             the far side                 the far side

Air drawn in starts from rest, so that it costs the pressure drop of Bernoulli's law and a flow
that turns back at an open face cannot feed itself. With these values central differences lose
energy at an open face, whichever way the air goes there.

Mirrored with its sign turned, what goes along a wall at rest exchanges no energy with it by
advection. Its viscous shear would be of first order only; what is missing is added by
`add_wall_shear`.

The axes are filled in turn (x, y, z), each over the ghosts of the ones before, so that edges and
corners hold values too: trilinear interpolation reads them.
"""

from collections.abc import Sequence

from solver.grid import AXES, TURNS, Field, Grid
from solver.kernel import GHOSTS, INT, REAL, VIEW, kernel
from solver.scene_physics import MovingWall

Rates = Sequence[float] | Field
FACE = (GHOSTS - 1, GHOSTS)   # the layer of a normal velocity that stands on the box, per side
SIGN = (1.0, -1.0)            # of a velocity into the box


def fill_velocity(grid: Grid, velocity: Sequence[Field]) -> None:
    """Set the ghosts of u, v, w, and 0 on the wall faces that the box itself ends on."""
    for axis in range(3):
        grid.exchange(axis, *velocity)
        for side in _box_sides(grid, axis):
            face = grid.domain.face(side_name(axis, side))
            views = [_inward(field, axis, side) for field in velocity]
            normal_ghosts(views[axis], FACE[side], int(face == "open"), SIGN[side])
            for component in (c for c in range(3) if c != axis):
                if face == "open":
                    open_ghosts(views[component], views[axis], FACE[side], SIGN[side], -1.0, 0.0,
                                _row_still_unknown(axis, component))
                elif face == "slip":
                    mirror(views[component], 1.0)
                else:
                    no_slip_ghosts(views[component],
                                   face.wall[component] if isinstance(face, MovingWall) else 0.0)


def close_walls(grid: Grid, velocity: Sequence[Field]) -> None:
    """Set the normal velocity on wall and slip faces to 0 (a predictor leaves something there)."""
    for axis in range(3):
        for side in _box_sides(grid, axis):
            if grid.domain.face(side_name(axis, side)) != "open":
                _inward(velocity[axis], axis, side)[FACE[side]] = 0


def add_wall_shear(grid: Grid, made: Sequence[Field], now: Sequence[Field],
                   explicit: Rates, implicit: Rates) -> None:
    """Add the viscous shear at no-slip walls that the ghosts of `now` leave out to u, v, w in the
    making: that of the parabola through the wall's speed U (half a cell away) and the two values
    inside, less that of the ghost 2U - q₀,

        (q₁ / 3 - q₀ + 2U / 3) ν dt / h²

    explicit  ν dt / h² per axis of diffusion that is already in `made`
    implicit  the same of diffusion that is yet to be solved for as if all walls were at rest; their
              speed, 2U ν dt / h², is added too
    """
    for axis in range(3):
        for side in _box_sides(grid, axis):
            face = grid.domain.face(side_name(axis, side))
            if face not in ("open", "slip"):
                for component in (c for c in range(3) if c != axis):
                    add_shear(_inward(made[component], axis, side),
                              _inward(now[component], axis, side),
                              face.wall[component] if isinstance(face, MovingWall) else 0.0,
                              explicit[axis], implicit[axis])


def fill_scalar(grid: Grid, field: Field) -> None:
    """Set the ghosts of a cell-centred field with no flux through the faces of the box."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in _box_sides(grid, axis):
            mirror(_inward(field, axis, side), 1.0)


def fill_temperature(grid: Grid, field: Field, velocity: Sequence[Field], ambient: float) -> None:
    """Set the ghosts of T: ambient where air flows in through an open face, else no gradient."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in _box_sides(grid, axis):
            view = _inward(field, axis, side)
            if grid.domain.face(side_name(axis, side)) == "open":
                open_ghosts(view, _inward(velocity[axis], axis, side), FACE[side], SIGN[side], 0.0,
                            ambient, 0)
            else:
                mirror(view, 1.0)


def fill_pressure(grid: Grid, field: Field) -> None:
    """Set the first ghosts of p: p = 0 on open faces, no gradient through walls."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in _box_sides(grid, axis):
            is_open = grid.domain.face(side_name(axis, side)) == "open"
            mirror(_inward(field, axis, side), -1.0 if is_open else 1.0)


def side_name(axis: int, side: int) -> str:
    """The scene's name of a face: side 0 is low, 1 is high."""
    return f"{'xyz'[axis]}_{('min', 'max')[side]}"


def _box_sides(grid: Grid, axis: int) -> list[int]:
    """Which ends of the axis this rank shares with the box (none where it is periodic)."""
    if grid.periodic[axis]:
        return []
    return [side for side, touches in enumerate((grid.at_low_end(axis), grid.at_high_end(axis)))
            if touches]


def _inward(field: Field, axis: int, side: int) -> Field:
    """The field with the axis first and running inwards from the outermost ghost layer."""
    view = field.transpose(TURNS[axis])
    return view if side == 0 else view[::-1]


def _row_still_unknown(axis: int, component: int) -> int:
    """Where a later axis has a low face of the box or of the rank, its row of the normal velocity
    has no value yet: the first (1) or second (2) direction along the face, or none (0)."""
    if component < axis:
        return 0
    return 1 + [a for a in TURNS[axis] if a != AXES[axis]].index(AXES[component])


@kernel(VIEW, REAL)
def mirror(view, sign):
    """Ghost layer l = sign × the cell as far inside."""
    last = view.shape[0] - GHOSTS - 1
    for b in range(view.shape[1]):
        for c in range(view.shape[2]):
            for layer in range(GHOSTS):
                view[GHOSTS - 1 - layer, b, c] = sign * view[min(GHOSTS + layer, last), b, c]


@kernel(VIEW, REAL)
def no_slip_ghosts(view, speed):
    """The mean of a ghost and the value as far inside is the wall's speed."""
    last = view.shape[0] - GHOSTS - 1
    for b in range(view.shape[1]):
        for c in range(view.shape[2]):
            for layer in range(GHOSTS):
                inside = view[min(GHOSTS + layer, last), b, c]
                view[GHOSTS - 1 - layer, b, c] = 2 * speed - inside


@kernel(VIEW, VIEW, REAL, REAL, REAL)
def add_shear(made, now, speed, explicit, implicit):
    """See `add_wall_shear`."""
    curved = made.shape[0] > 2 * GHOSTS + 1
    for b in range(made.shape[1]):
        for c in range(made.shape[2]):
            amount = implicit * 2 * speed
            if curved:
                amount += (explicit + implicit) * (
                    now[GHOSTS + 1, b, c] / 3 - now[GHOSTS, b, c] + 2 / 3 * speed)
            made[GHOSTS, b, c] += amount


@kernel(VIEW, INT, INT, REAL)
def normal_ghosts(view, face, is_open, inwards):
    """Wall: 0 on the box's face (which is the layer `face`), mirrored beyond. Open: a parabola
    beyond where air leaves, 0 where it comes in (`inwards` × the velocity > 0)."""
    last = view.shape[0] - 1
    for b in range(view.shape[1]):
        for c in range(view.shape[2]):
            if is_open:
                here = beyond = view[face, b, c]
                if last > 2 * GHOSTS + 1:
                    beyond = 3 * (here - view[face + 1, b, c]) + view[face + 2, b, c]
                for layer in range(face):
                    view[layer, b, c] = beyond if inwards * here <= 0 else 0.0
            else:
                view[face, b, c] = 0.0
                for layer in range(1, face + 1):
                    view[face - layer, b, c] = -view[min(face + layer, last), b, c]


@kernel(VIEW, VIEW, INT, REAL, REAL, REAL, INT)
def open_ghosts(view, normal, face, inwards, sign, offset, unknown):
    """offset + sign × the last value where air comes in, a copy of it where air leaves. On a low
    face still without a normal velocity (see `_row_still_unknown`) that of the row inside counts.
    """
    for b in range(view.shape[1]):
        row = GHOSTS if unknown == 1 and b == GHOSTS - 1 else b
        for c in range(view.shape[2]):
            column = GHOSTS if unknown == 2 and c == GHOSTS - 1 else c
            value = view[GHOSTS, b, c]
            if inwards * normal[face, row, column] > 0:
                value = offset + sign * value
            for layer in range(GHOSTS):
                view[layer, b, c] = value
