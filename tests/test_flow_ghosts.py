"""Ghost values agree with the rules of `solver.boundary`, written out plainly with whole arrays."""

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from solver import boundary, scene as scenes
from solver.grid import AXES, Grid
from solver.kernel import GHOSTS
from solver.scene_physics import MovingWall

FACES = ("wall", "open", "slip", "periodic", {"wall": [0.3, -0.2, 0.7]})
G = GHOSTS
AMBIENT = 5.0
COMM = MPI.COMM_WORLD


def inward(field, axis, side):
    view = np.moveaxis(field, AXES[axis], 0)
    return view if side == 0 else view[::-1]


def slow_velocity(velocity, axis, side, face, ends):
    """One face of the box; `ends`: whether the box ends at this rank, low and high, per axis."""
    at = G - 1 if side == 0 else G
    for component, field in enumerate(velocity):
        view = inward(field, axis, side)
        n = len(view) - 2 * G
        if component == axis and face == "open":
            leaves = view[at] <= 0 if side == 0 else view[at] >= 0
            wide = n > 2
            beyond = 3 * (view[at] - view[at + 1]) + view[at + 2] if wide else view[at]
            view[:at] = np.where(leaves, beyond, 0.0)
        elif component == axis:
            view[at] = 0
            for layer in range(1, at + 1):
                view[at - layer] = -view[min(at + layer, len(view) - 1)]
        elif face == "open":
            others = [a for a in range(3) if a != AXES[axis]]
            place = others.index(AXES[component])
            normal = np.moveaxis(inward(velocity[axis], axis, side)[at], place, 0)
            last = normal.shape[0] - 1
            first = G if ends[component][0] else 0
            last -= G if ends[component][1] else 0
            rows = np.arange(normal.shape[0])
            flow = normal[np.maximum(rows, first)] + normal[np.minimum(rows + 1, last)]
            enters = np.moveaxis(flow if side == 0 else -flow, 0, place) > 0
            slope = np.zeros_like(view[G])
            if n > 2:
                near, far = view[G] - view[G + 1], view[G + 1] - view[G + 2]
                slope = np.clip(2 * near - far, np.minimum(near, 0), np.maximum(near, 0))
            for layer in range(G):
                view[G - 1 - layer] = np.where(enters, -view[G], view[G] + (layer + 1) * slope)
        else:
            for layer in range(G):
                inside = view[G + min(layer, n - 1)]
                speed = face.wall[component] if isinstance(face, MovingWall) else 0.0
                view[G - 1 - layer] = inside if face == "slip" else 2 * speed - inside


def slow_cells(field, normal, axis, side, face, kind):
    """One face of the box, for T or p."""
    view = inward(field, axis, side)
    n = len(view) - 2 * G
    if kind == "T" and face == "open":
        at = inward(normal, axis, side)[G - 1 if side == 0 else G]
        view[:G] = np.where(at > 0 if side == 0 else at < 0, AMBIENT, view[G])
        return
    for layer in range(G):
        sign = -1 if kind == "p" and face == "open" else 1
        view[G - 1 - layer] = sign * view[G + min(layer, n - 1)]


@pytest.mark.parametrize("number", range(12))
def test_ghosts_are_those_of_the_rules(number):
    random = np.random.default_rng(number)
    faces: dict[str, Any] = {}
    for letter in "xyz":
        pair = [FACES[i] for i in random.integers(0, len(FACES), 2)]
        faces[f"{letter}_min"], faces[f"{letter}_max"] = (
            ("periodic", "periodic") if "periodic" in pair else pair)
        for name in (f"{letter}_min", f"{letter}_max"):
            if isinstance(faces[name], dict):
                speeds = list(faces[name]["wall"])
                speeds["xyz".index(letter)] = 0.0
                faces[name] = {"wall": speeds}
    cells = [int(n) for n in random.integers(1, 6, 3)]
    cells[1:] = (max(n, COMM.size if COMM.size > 1 else 1) for n in cells[1:])
    cells[2] = max(cells[2], 2 * COMM.size if COMM.size > 1 else 1)
    grid = Grid(scenes.build({"domain": {"cells": cells, "boundary": faces},
                              "time": {"end": 1, "frame": 1}}).domain, COMM)
    *velocity, T, p = (np.random.default_rng([number, COMM.rank, i]).standard_normal(grid.shape)
                       for i in range(5))
    expected: list[Any] = [field.copy() for field in (*velocity, T, p)]
    boundary.fill_velocity(grid, velocity)
    boundary.fill_temperature(grid, T, velocity, AMBIENT)
    boundary.fill_pressure(grid, p)
    now: Any = expected[:3]
    ends = [[side in [s for s, _ in _faces(grid, axis)] for side in range(2)] for axis in range(3)]
    for axis in range(3):
        for other in range(axis, 3):
            grid.exchange(other, now[axis])
        grid.exchange(axis, *now)
        for side, face in _faces(grid, axis):
            slow_velocity(now, axis, side, face, ends)
    for field, kind in zip(expected[3:], "Tp", strict=True):
        for axis in range(3):
            grid.exchange(axis, field)
            for side, face in _faces(grid, axis):
                slow_cells(field, now[axis], axis, side, face, kind)
    near = (slice(GHOSTS - 1, 1 - GHOSTS),) * 3   # p has its first ghosts set only
    expected[4] = expected[4][near]
    for name, found, wanted in zip("uvwTp", (*velocity, T, p[near]), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14, err_msg=f"{name} {faces}")
    grid.destroy()


def _faces(grid, axis):
    """Side and kind of the faces of the box at this rank that are not periodic."""
    for side, touches in enumerate((grid.at_low_end(axis), grid.at_high_end(axis))):
        face = grid.domain.face(boundary.side_name(axis, side))
        if touches and face != "periodic":
            yield side, face
