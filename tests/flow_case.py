"""Small flows for the tests: a scene in a line, a simulation that is always freed, whole fields."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI

from solver import scene as scenes
from solver.grid import AXES
from solver.kernel import GHOSTS
from solver.step import Simulation

COMM = MPI.COMM_WORLD
FACES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


def faces(*kinds: Any) -> dict[str, Any]:
    """A boundary table from six kinds, in the order of `FACES`."""
    return dict(zip(FACES, kinds, strict=True))


def make_scene(cells, boundary="periodic", size=(1.0, 1.0, 1.0), **sections) -> scenes.Scene:
    """A scene with `time` and whatever other sections are given."""
    data = {"domain": {"cells": list(cells), "size": list(size), "boundary": boundary},
            "time": {"end": 1.0, "frame": 1.0}}
    for name, values in sections.items():
        data[name] = {**data.get(name, {}), **values}
    return scenes.build(data)


@contextmanager
def simulation(scene: scenes.Scene, fragments: Any = None) -> Iterator[Simulation]:
    """A simulation on all ranks, freed at the end."""
    made = Simulation(scene, COMM, fragments)
    try:
        yield made
    finally:
        made.destroy()


def gathered(grid: Any, field: np.ndarray, face_axis: int | None = None) -> np.ndarray:
    """The field of the whole box on every rank, without ghosts; a face field with its low face."""
    region = [slice(GHOSTS, -GHOSTS)] * 3
    shape = list(reversed(grid.cells))
    starts = list(reversed(grid.start))
    if face_axis is not None:
        axis = AXES[face_axis]
        region[axis] = slice(GHOSTS - 1, -GHOSTS)
        shape[axis] += 1
    whole = np.zeros(shape)
    for start, part in grid.comm.allgather((starts, field[tuple(region)])):
        whole[tuple(slice(s, s + n) for s, n in zip(start, part.shape, strict=True))] = part
    return whole


def velocity(state: Any) -> list[np.ndarray]:
    """u, v, w of the whole box, each with its low boundary face."""
    return [gathered(state.grid, field, axis) for axis, field in enumerate(state.velocity)]


def divergence(faces_of: list[np.ndarray], spacing: Any) -> np.ndarray:
    """∇·u in every cell, from whole face fields u, v, w."""
    u, v, w = faces_of
    return (np.diff(u, axis=2) / spacing[0] + np.diff(v, axis=1) / spacing[1]
            + np.diff(w, axis=0) / spacing[2])


def set_random(sim: Simulation, seed: int = 3) -> None:
    """Random fields everywhere, ghosts filled by the rules of the faces; the same on any ranks."""
    state, grid = sim.state, sim.state.grid
    random = np.random.default_rng(seed)
    fields = [*state.velocity] + ([state.T] if state.T is not None else [])
    for field in fields:
        whole = random.standard_normal([n + 2 * GHOSTS for n in reversed(grid.cells)])
        part = tuple(slice(s, s + n + 2 * GHOSTS)
                     for s, n in zip(reversed(grid.start), reversed(grid.count), strict=True))
        field[...] = whole[part]
    sim._fill_ghosts()
