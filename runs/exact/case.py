"""Cases with a known answer: NAME.toml is a scene like any other, NAME.answer.toml its solution.

    order = 1.9                  least order expected of velocity and pressure in L2 and L∞
    order_T = [1.9, 1.9]         of the temperature, in L2 and in L∞, with the default scheme, which
                                 is limited where T has a maximum; absent: as of the velocity
    [orders_T] donor = […] …     the same for other schemes of the temperature
    ladder = [16, 32, 64]        cells along the axes that have more than one
    u, v, w, p, T = "..."        expressions of x, y, z, t, or lists of some to be added up; those
                                 given are compared at time.end

The pressure is compared up to a constant. Errors are relative to the largest value of the answer.
"""

import time as clock
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from solver import scene as scenes
from solver.grid import INNER
from solver.state import VELOCITY, evaluate
from solver.step import Simulation

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Result:
    """One run of a case: relative errors by field, work, and processor seconds of stepping (set-up
    apart), in which other work on the machine hardly shows."""

    l2: dict[str, float]
    most: dict[str, float]
    seconds: float
    steps: int
    iterations: int


def names() -> list[str]:
    """All cases."""
    return sorted(path.name.removesuffix(".answer.toml") for path in FOLDER.glob("*.answer.toml"))


def answer(name: str) -> dict[str, Any]:
    """What is known of a case."""
    return tomllib.loads((FOLDER / f"{name}.answer.toml").read_text(encoding="utf-8"))


def temperature_schemes(name: str) -> list[str]:
    """The schemes of the temperature that a case knows the orders of; "" is the default."""
    return ["", *answer(name).get("orders_T", {})]


def expected(name: str, field: str, scheme: str = "") -> tuple[float, float]:
    """The least orders of a field, in L2 and in L∞."""
    known = answer(name)
    both = known["order"], known["order"]
    if field == "T":
        both = known["orders_T"][scheme] if scheme else known.get("order_T", both)
    return float(both[0]), float(both[1])


def build(name: str, cells: int, overrides: list[str]) -> scenes.Scene:
    """The scene of a case with so many cells along each axis that has more than one."""
    known = scenes.load(FOLDER / f"{name}.toml", overrides)
    counts = [cells if n > 1 else 1 for n in known.domain.cells]
    return scenes.load(FOLDER / f"{name}.toml", [*overrides, f"domain.cells={counts}"])


def run(name: str, cells: int, overrides: list[str]) -> Result:
    """Simulate the case and compare."""
    scene = build(name, cells, overrides)
    simulation = Simulation(scene)
    start = clock.process_time()
    iterations = sum(simulation.state.iterations for _ in simulation.run_to(scene.time.end))
    seconds = clock.process_time() - start
    l2, most = {}, {}
    for field, formula in answer(name).items():
        if field in (*VELOCITY, "p", "T"):
            l2[field], most[field] = compare(simulation, field, formula)
    result = Result(l2, most, seconds, simulation.state.step, iterations)
    simulation.destroy()
    return result


def compare(simulation: Simulation, field: str, formula: str | list[str]) -> tuple[float, float]:
    """Relative errors of a field in L2 and L∞ at the current time."""
    state, grid = simulation.state, simulation.state.grid
    wanted, part = grid.field(), grid.field()
    for text in [formula] if isinstance(formula, str) else formula:
        evaluate(grid, text, part, VELOCITY.index(field) if field in VELOCITY else None,
                 state.time)
        wanted += part
    exact, found = wanted[INNER], getattr(state, field)[INNER]
    cells = float(np.prod(grid.cells))
    if field == "p":
        sums = grid.comm.allreduce(np.array([exact.sum(), found.sum()])) / cells
        exact, found = exact - sums[0], found - sums[1]
    square = grid.comm.allreduce(float(((found - exact) ** 2).sum())) / cells
    largest = grid.comm.allgather((float(np.abs(found - exact).max()), float(np.abs(exact).max())))
    error, scale = (max(values) for values in zip(*largest, strict=True))
    scale = scale or 1.0
    return float(np.sqrt(square)) / scale, error / scale
