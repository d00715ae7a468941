"""Small scenes with particles or bodies, for the tests of particles and bodies."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from partition.build import build as build_fragments
from solver import scene
from solver.step import Simulation
from solver.swarm import PARTICLE

COMM = MPI.COMM_WORLD
QUIET = {"particles": 0, "ignited": 0}    # [fuel] that makes no particle of its own


def merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """`base` with nested tables overridden."""
    result = dict(base)
    for key, value in changes.items():
        known = result.get(key)
        result[key] = (merged(known, value) if isinstance(known, dict) and isinstance(value, dict)
                       else value)
    return result


def build(**sections: Any) -> scene.Scene:
    """A still, open unit box of 8³ cells, with the given sections."""
    base = {"time": {"end": 1.0, "frame": 0.1}, "domain": {"cells": [8, 8, 8]}}
    return scene.build(merged(base, sections))


@contextmanager
def running(**sections: Any) -> Iterator[Simulation]:
    """A simulation of `build(**sections)`, freed at the end."""
    built = build(**sections)
    simulation = Simulation(built, COMM, build_fragments(built) if built.body else None)
    try:
        yield simulation
    finally:
        simulation.destroy()


def add(simulation: Simulation, position: Any, **columns: Any) -> None:
    """Put fuel particles (mass 1, at ambient temperature) into a simulation; call on all ranks."""
    position = np.atleast_2d(np.asarray(position, float))
    records = np.zeros(len(position), PARTICLE)
    records["position"] = position
    records["mass"] = 1.0
    records["temperature"] = simulation.scene.fluid.ambient_temperature
    records["id"] = np.arange(1, len(position) + 1) << 16
    for name, values in columns.items():
        records[name] = values
    swarm = simulation.state.swarm
    swarm.append(records[:len(records) if COMM.rank == 0 else 0])
    swarm.settle()


def gathered(simulation: Simulation) -> NDArray[np.void]:
    """All particles of all ranks, on all ranks, sorted by id."""
    parts = COMM.allgather(simulation.state.swarm.points.copy())
    points: NDArray[np.void] = np.concatenate(parts)
    return points[np.argsort(points["id"], kind="stable")]


def run(simulation: Simulation, until: float) -> int:
    """Advance to a time; returns how many steps that took."""
    return sum(1 for _ in simulation.run_to(until))
