"""Ghost values: what the fields are beyond the faces of the box.

    face       normal velocity          tangential velocity          temperature, scalars
    wall       0 on the face            -mirror + 2 × the wall's     mirror
                                        speed
    slip       0 on the face            mirror                       mirror
    open, out  free on the face,        a parabola, between flat     copy of the last
               a parabola beyond        and the slope inside
    open, in   free on the face,        -mirror: the air outside     ambient
               0 beyond: still air      is still
    periodic   the far side             the far side                 the far side

Air drawn in starts from rest, so that a flow that turns back at an open face cannot feed itself;
the velocity on the face itself is moved by `openings`. In or out is asked of the flow between the
two cells that a velocity along the face stands between, which is what carries it.

Mirrored with its sign turned, what goes along a wall at rest exchanges no energy with it by
advection. Its viscous shear would be of first order only: `shear` adds what is missing.

The axes are filled in turn (x, y, z), each over the ghosts of the ones before, so that edges and
corners hold values too: trilinear interpolation reads them.
"""

from collections.abc import Sequence

from solver.grid import AXES, TURNS, Field, Grid
from solver.kernel import GHOSTS, INT, REAL, VIEW, kernel
from solver.scene_physics import MovingWall

FACE = (GHOSTS - 1, GHOSTS)   # the layer of a normal velocity that stands on the box, per side
SIGN = (1.0, -1.0)            # of a velocity into the box


def fill_velocity(grid: Grid, velocity: Sequence[Field]) -> None:
    """Set the ghosts of u, v, w, and 0 on the wall faces that the box itself ends on."""
    ends = [axis_ends(grid, axis) for axis in range(3)]
    for axis in range(3):
        grid.exchange(axis, *velocity)
        if any(grid.domain.face(side_name(axis, side)) == "open" for side in range(2)):
            for later in range(axis + 1, 3):
                grid.exchange(later, velocity[axis])
        for side in box_sides(grid, axis):
            face = grid.domain.face(side_name(axis, side))
            views = [inward(field, axis, side) for field in velocity]
            normal_ghosts(views[axis], FACE[side], int(face == "open"), SIGN[side])
            for component in (c for c in range(3) if c != axis):
                if face == "open":
                    open_velocity(views[component], views[axis], FACE[side], SIGN[side],
                                  int(component == _second(axis)), *ends[component])
                elif face == "slip":
                    mirror(views[component], 1.0, 0.0)
                else:
                    speed = face.wall[component] if isinstance(face, MovingWall) else 0.0
                    mirror(views[component], -1.0, 2 * speed)
    if grid.processes[1] > 1 and any(grid.domain.face(side_name(2, side)) == "open"
                                     for side in range(2)):
        # beyond an open z face the flow through it decides, of which the last row beyond this
        # rank's along y knows one half only: its owner has both
        grid.exchange(1, *velocity)


def close_walls(grid: Grid, velocity: Sequence[Field]) -> None:
    """Set the normal velocity on wall and slip faces to 0 (a predictor leaves something there)."""
    for axis in range(3):
        for side in box_sides(grid, axis):
            if grid.domain.face(side_name(axis, side)) != "open":
                inward(velocity[axis], axis, side)[FACE[side]] = 0


def fill_scalar(grid: Grid, field: Field, axes: Sequence[int] = (0, 1, 2)) -> None:
    """Set the ghosts of a cell-centred field with no flux through the faces of the box, along all
    axes or those that are read."""
    for axis in axes:
        grid.exchange(axis, field)
        for side in box_sides(grid, axis):
            mirror(inward(field, axis, side), 1.0, 0.0)


def fill_temperature(grid: Grid, field: Field, velocity: Sequence[Field], ambient: float) -> None:
    """Set the ghosts of T: ambient where air flows in through an open face, else no gradient."""
    for axis in range(3):
        grid.exchange(axis, field)
        for side in box_sides(grid, axis):
            view = inward(field, axis, side)
            if grid.domain.face(side_name(axis, side)) == "open":
                open_scalar(view, inward(velocity[axis], axis, side), FACE[side], SIGN[side],
                            ambient)
            else:
                mirror(view, 1.0, 0.0)


def fill_pressure(grid: Grid, field: Field) -> None:
    """Set the first ghosts of p: p = 0 on open faces, no gradient through walls."""
    for axis in range(3):
        grid.exchange(axis, field, layers=1)
        for side in box_sides(grid, axis):
            is_open = grid.domain.face(side_name(axis, side)) == "open"
            mirror(inward(field, axis, side), -1.0 if is_open else 1.0, 0.0)


def side_name(axis: int, side: int) -> str:
    """The scene's name of a face: side 0 is low, 1 is high."""
    return f"{'xyz'[axis]}_{('min', 'max')[side]}"


def box_sides(grid: Grid, axis: int) -> list[int]:
    """Which ends of the axis this rank shares with the box (none where it is periodic)."""
    if grid.periodic[axis]:
        return []
    return [side for side, touches in enumerate((grid.at_low_end(axis), grid.at_high_end(axis)))
            if touches]


def inward(field: Field, axis: int, side: int) -> Field:
    """The field with the axis first and running inwards from the outermost ghost layer."""
    view = field.transpose(TURNS[axis])
    return view if side == 0 else view[::-1]


def axis_ends(grid: Grid, axis: int) -> tuple[int, int]:
    """The first and last index, along an axis, of the cells that are known before its ghosts are
    set: those inside where the box ends, all elsewhere."""
    sides = box_sides(grid, axis)
    return (GHOSTS if 0 in sides else 0,
            grid.count[axis] + (GHOSTS if 1 in sides else 2 * GHOSTS) - 1)


def _second(axis: int) -> int:
    """Which of x, y, z runs along the second index of a view that is turned inwards."""
    return AXES.index(TURNS[axis][1])


@kernel(VIEW, REAL, REAL)
def mirror(view, sign, shift):
    """Ghost layer l = shift + sign × the cell as far inside."""
    last = view.shape[0] - GHOSTS - 1
    for b in range(view.shape[1]):
        for c in range(view.shape[2]):
            for layer in range(GHOSTS):
                inside = view[min(GHOSTS + layer, last), b, c]
                view[GHOSTS - 1 - layer, b, c] = shift + sign * inside


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


@kernel(VIEW, VIEW, INT, REAL, INT, INT, INT)
def open_velocity(view, normal, face, inwards, along_b, first, last):
    """A velocity along the face (its second index if `along_b`, else its third): -mirror where air
    comes in; where air leaves a parabola, as far as that is no steeper than the slope inside and
    does not turn back. The flow through the face is the mean of those of the two cells that it
    stands between, of one at the end of the box.
    """
    deep = view.shape[0] > 2 * GHOSTS + 2
    for b in range(view.shape[1]):
        for c in range(view.shape[2]):
            if along_b:
                flow = normal[face, max(b, first), c] + normal[face, min(b + 1, last), c]
            else:
                flow = normal[face, b, max(c, first)] + normal[face, b, min(c + 1, last)]
            value, slope = view[GHOSTS, b, c], 0.0
            if inwards * flow > 0:
                value = -value
            elif deep:
                near = value - view[GHOSTS + 1, b, c]
                far = view[GHOSTS + 1, b, c] - view[GHOSTS + 2, b, c]
                slope = 2 * near - far
                if slope * near < 0:
                    slope = 0.0
                elif abs(slope) > abs(near):
                    slope = near
            for layer in range(GHOSTS):
                view[GHOSTS - 1 - layer, b, c] = value + (layer + 1) * slope


@kernel(VIEW, VIEW, INT, REAL, REAL)
def open_scalar(view, normal, face, inwards, outside):
    """The value outside where air comes in, a copy of the last where air leaves."""
    for b in range(view.shape[1]):
        for c in range(view.shape[2]):
            value = outside if inwards * normal[face, b, c] > 0 else view[GHOSTS, b, c]
            for layer in range(GHOSTS):
                view[layer, b, c] = value
