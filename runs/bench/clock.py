"""Timing jobs in turn, so that other work on the machine slows all of them alike."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.fft

from solver.pressure import PressureSolver


def in_turn(repeats: int, **jobs: Callable[[], Any]) -> dict[str, list[float]]:
    """Seconds of each job, every repeat running all of them one after the other."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            seconds[name].append(time.perf_counter() - start)
    return seconds


def transform_pair(cells: int) -> Callable[[], None]:
    """The yardstick: scipy's dctn followed by idctn on cells³ doubles."""
    values = np.random.default_rng(1).standard_normal((cells,) * 3)

    def pair() -> None:
        scipy.fft.idctn(scipy.fft.dctn(values))
    return pair


def solve_job(solver: PressureSolver) -> Callable[[], int]:
    """One pressure solve in a closed box, with a random right side without mean; returns the
    iterations."""
    right = np.random.default_rng(2).standard_normal(solver.b.shape)
    right -= right.mean()
    sums = float(right.sum()), float((right**2).sum())
    solver.b[...] = right   # once: the solve leaves it as it is
    p = solver.grid.field()

    def solve() -> int:
        return solver.solve(p, *sums)
    return solve
