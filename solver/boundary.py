"""Ghost values: what the fields are beyond the faces of the box.

    face       normal velocity          tangential velocity          temperature, scalars
    wall       0 on the face            parabola through the wall's  mirror
                                        speed and the values inside
    slip       0 on the face            mirror                       mirror
    open, out  free on the face,        copy of the last             copy of the last
               a parabola beyond
    open, in   free on the face,        -mirror: the air outside     ambient
               0 beyond: still air      is still
    periodic   the far side             the far side                 the far side

Air drawn in starts from rest, so that it costs the pressure drop of Bernoulli's law and a flow
that turns back at an open face cannot feed itself. With these values central differences lose
energy at an open face, whichever way the air goes there.

The axes are filled in turn (x, y, z), each over the ghosts of the ones before, so that edges and
corners hold values too: trilinear interpolation reads them.
"""

from collections.abc import Sequence

import numpy as np

from solver.grid import AXES, Field, Grid
from solver.kernel import GHOSTS
from solver.scene_physics import MovingWall


def fill_velocity(grid: Grid, velocity: Sequence[Field]) -> None:
    """Set the ghosts of u, v, w, and 0 on the wall faces that the box itself ends on."""
    for axis in range(3):
        grid.exchange(axis, *velocity)
        for side in _box_sides(grid, axis):
            face = grid.domain.face(side_name(axis, side))
            for component, field in enumerate(velocity):
                view = _inward(field, axis, side)
                if component == axis:
                    _normal_ghosts(view, side, is_open=face == "open")
                elif face == "open":
                    inflow = _inflow(velocity[axis], axis, side)
                    if component > axis:
                        _copy_to_low_face(inflow, axis, component)
                    _open_ghosts(view, inflow, -view[GHOSTS])
                elif face == "slip":
                    _mirror(view, sign=1.0)
                else:
                    speed = face.wall[component] if isinstance(face, MovingWall) else 0.0
                    _no_slip_ghosts(view, speed)


def close_walls(grid: Grid, velocity: Sequence[Field]) -> None:
    """Set the normal velocity on wall and slip faces to 0 (a predictor leaves something there)."""
    for axis in range(3):
        for side in _box_sides(grid, axis):
            if grid.domain.face(side_name(axis, side)) != "open":
                _inward(velocity[axis], axis, side)[GHOSTS - 1 if side == 0 else GHOSTS] = 0


def fill_scalar(grid: Grid, field: Field) -> None:
    """Set the ghosts of a cell-centred field with no flux through the faces of the box."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in _box_sides(grid, axis):
            _mirror(_inward(field, axis, side), sign=1.0)


def fill_temperature(grid: Grid, field: Field, velocity: Sequence[Field], ambient: float) -> None:
    """Set the ghosts of T: ambient where air flows in through an open face, else no gradient."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in _box_sides(grid, axis):
            view = _inward(field, axis, side)
            if grid.domain.face(side_name(axis, side)) == "open":
                _open_ghosts(view, _inflow(velocity[axis], axis, side), ambient)
            else:
                _mirror(view, sign=1.0)


def fill_pressure(grid: Grid, field: Field) -> None:
    """Set the first ghosts of p: p = 0 on open faces, no gradient through walls."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in _box_sides(grid, axis):
            is_open = grid.domain.face(side_name(axis, side)) == "open"
            _mirror(_inward(field, axis, side), sign=-1.0 if is_open else 1.0)


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
    view = np.moveaxis(field, AXES[axis], 0)
    return view if side == 0 else view[::-1]


def _mirror(view: Field, sign: float, offset: float = 0.0) -> None:
    """Ghost layer l = offset + sign × the cell as far inside."""
    inside = len(view) - 2 * GHOSTS
    for layer in range(GHOSTS):
        view[GHOSTS - 1 - layer] = offset + sign * view[GHOSTS + min(layer, inside - 1)]


def _no_slip_ghosts(view: Field, speed: float) -> None:
    """The parabola through the wall's speed (half a cell away) and the two values inside gives the
    first ghost, so that the shear at the wall is of second order; the next one mirrors."""
    _mirror(view, sign=-1.0, offset=2 * speed)
    if len(view) > 2 * GHOSTS + 1:
        np.multiply(view[GHOSTS], -2.0, out=view[GHOSTS - 1])
        view[GHOSTS - 1] += view[GHOSTS + 1] / 3 + 8 / 3 * speed


def _normal_ghosts(view: Field, side: int, is_open: bool) -> None:
    """The face on the box lies at GHOSTS - 1 of the low end, at GHOSTS of the high end."""
    face = GHOSTS - 1 if side == 0 else GHOSTS
    if is_open:
        out = view[face] <= 0 if side == 0 else view[face] >= 0
        beyond = view[face]
        if len(view) > 2 * GHOSTS + 2:
            beyond = 3 * (view[face] - view[face + 1]) + view[face + 2]
        view[:face] = np.where(out, beyond, 0.0)
        return
    view[face] = 0
    for layer in range(1, face + 1):
        view[face - layer] = -view[min(face + layer, len(view) - 1)]


def _inflow(normal: Field, axis: int, side: int) -> np.ndarray:
    """Where air comes in through a face of the box."""
    face = _inward(normal, axis, side)[GHOSTS - 1 if side == 0 else GHOSTS]
    inflow: np.ndarray = face > 0 if side == 0 else face < 0
    return inflow


def _open_ghosts(view: Field, inflow: np.ndarray, outside: float | Field) -> None:
    """The given value where air comes in, a copy of the last one where it leaves."""
    view[:GHOSTS] = np.where(inflow, outside, view[GHOSTS])


def _copy_to_low_face(inflow: np.ndarray, axis: int, component: int) -> None:
    """On the low face of an axis still to be filled take what the row of cells beside it has: the
    normal velocity has no ghosts there yet. (Where the face is another rank's, its own follow.)"""
    others = [a for a in range(3) if a != AXES[axis]]
    rows = np.moveaxis(inflow, others.index(AXES[component]), 0)
    rows[GHOSTS - 1] = rows[GHOSTS]
