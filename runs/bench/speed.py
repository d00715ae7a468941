"""How long a step of the flow takes, stage by stage, measured against a bare fast transform.

The yardstick is scipy's dctn + idctn pair on the same number of cells, on one core, timed in turn
with what it is compared to, so that other work on the machine slows both. Times are medians.

    python -m runs bench speed [cells ...] [key=value ...]
    python -m runs bench speed memory
    python -m runs bench speed preconditioners
"""

import resource
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.fft

from solver import pressure, scene as scenes
from solver.step import Simulation

VORTEX: dict[str, Any] = {
    "domain": {"boundary": "wall"}, "time": {"end": 1e3, "frame": 1e3},
    "fluid": {"reynolds": 1600.0},
    "initial": {"u": "sin(2*pi*x)*cos(2*pi*y)", "v": "-cos(2*pi*x)*sin(2*pi*y)", "T": "5+x"}}


def make(cells: list[int], overrides: list[str]) -> Simulation:
    """A vortex in a closed box of so many cells with temperature, two steps old."""
    data = {name: dict(values) for name, values in VORTEX.items()}
    data["domain"]["cells"] = cells
    for override in overrides:
        scenes.apply_override(data, override)
    simulation = Simulation(scenes.build(data))
    for _ in range(2):
        simulation.advance(1e3)
    return simulation


def transform_pair(cells: int) -> Callable[[], None]:
    """dctn followed by idctn on cells³ doubles."""
    values = np.random.default_rng(1).standard_normal((cells,) * 3)

    def pair() -> None:
        scipy.fft.idctn(scipy.fft.dctn(values))
    return pair


def solve_job(simulation: Simulation) -> Callable[[], None]:
    """One pressure solve with a random right side."""
    solver = simulation.stages["project"][1].solver
    right = np.random.default_rng(2).standard_normal(solver.b.shape)
    right -= right.mean()
    sums = float(right.sum()), float((right**2).sum())

    def solve() -> None:
        solver.b[...] = right
        solver.solve(*sums)
    return solve


def memory(cells: int, overrides: list[str]) -> float:
    """float64 per cell: the peak of a run of cells³ above what a run of 32³ leaves behind."""
    make([32] * 3, overrides).destroy()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    make([cells] * 3, overrides).destroy()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return 1024 * (peak - before) / 8 / cells**3


def preconditioners(cells: int, overrides: list[str]) -> dict[str, float]:
    """Seconds of a solve (set-up apart) to the same tolerance with PETSc's own preconditioners."""
    found = {}
    for name in ("transform", "gamg", "bjacobi", "none"):
        options = "" if name == "transform" else f"-pressure_pc_type {name}"
        pressure.set_options(options)
        simulation = make([cells] * 3, overrides)
        job = solve_job(simulation)
        job()
        found[name] = min(in_turn(3, solve=job)["solve"])
        simulation.destroy()
        pressure.clear_options(options)
    return found


def in_turn(repeats: int, **jobs: Callable[[], Any]) -> dict[str, list[float]]:
    """Seconds of each job, every repeat running all of them one after the other."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            seconds[name].append(time.perf_counter() - start)
    return seconds


def measure(cells: int, overrides: list[str], repeats: int) -> dict[str, float]:
    """Medians in seconds: pair, CG solve, step and its stages (per substep), and the ratios."""
    simulation = make([cells] * 3, overrides)
    simulation.seconds = dict.fromkeys(simulation.seconds, 0.0)
    seconds = in_turn(repeats, pair=transform_pair(cells),
                      solve=solve_job(simulation),
                      step=lambda: simulation.advance(1e3))
    substeps = simulation.substeps
    found = {name: statistics.median(values) for name, values in seconds.items()}
    found["iterations per solve"] = simulation.state.iterations / substeps
    found["solve / pair"] = found["solve"] / found["pair"]
    found["step / (pair × projections)"] = found["step"] / found["pair"] / substeps
    found["step / (pair × projections), best"] = (
        min(seconds["step"]) / min(seconds["pair"]) / substeps)
    found["solve / pair, best"] = min(seconds["solve"]) / min(seconds["pair"])
    for name, total in simulation.seconds.items():
        found[f"{name} per substep / pair"] = total / repeats / substeps / statistics.fmean(
            seconds["pair"])
    found["Mcell-steps / s"] = cells**3 / found["step"] / 1e6
    simulation.destroy()
    return found


def main(argv: list[str]) -> None:
    """Print the tables; see the module."""
    overrides = [a for a in argv if "=" in a]
    if argv[:1] == ["memory"]:
        print(f"{memory(128, overrides):.1f} float64 per cell at 128³")
        return
    if argv[:1] == ["preconditioners"]:
        for name, seconds in preconditioners(64, overrides).items():
            print(f"  64³ {name:<12} {seconds:9.4f} s per solve")
        return
    for cells in [int(a) for a in argv if "=" not in a] or [32, 128]:
        found = measure(cells, overrides, 200 if cells <= 48 else 12)
        print(f"{cells}³  {' '.join(overrides)}")
        for name, value in found.items():
            print(f"  {name:<40} {value:10.5f}")
