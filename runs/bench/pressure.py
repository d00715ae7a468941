"""The pressure solve by each preconditioner, to the same tolerance, and the bare transform pair.

    python -m runs bench pressure [cells ...]     (default 64 128; also part of `bench speed`)

CG to 1e-10 with one random right side in a closed box; the set-up (matrix, hierarchy, factors) is
timed apart. What PETSc was built without is left out. Writes results/speed_pressure.csv and .png.
"""

import statistics
import time
from pathlib import Path
from typing import Any

from mpi4py import MPI

from runs.bench import chart
from runs.bench.clock import in_turn, solve_job, transform_pair
from solver import pressure, scene as scenes
from solver.grid import Grid

RESULTS = Path(__file__).parent / "results"
PAIR, OURS = "dctn + idctn alone", "transform"
OPTIONS = {
    OURS: "",
    "multigrid on the grid": "-pressure_pc_type mg -pressure_pc_mg_levels {levels} "
                             "-pressure_pc_mg_galerkin both",
    "GAMG": "-pressure_pc_type gamg",
    "hypre": "-pressure_pc_type hypre",
    "ICC": "-pressure_pc_type bjacobi -pressure_sub_pc_type icc",
    "none": "-pressure_pc_type none"}
Row = tuple[Any, ...]


def main(argv: list[str]) -> None:
    """Print and store the table of each size."""
    RESULTS.mkdir(exist_ok=True)
    sizes = [int(a) for a in argv] or [64, 128]
    rows = [row for cells in sizes for row in table(cells)]
    chart.write_csv(RESULTS / "speed_pressure.csv", "cells per edge,preconditioner,seconds,"
                    "set-up seconds,iterations,times the transform", rows,
                    f"python -m runs bench pressure {' '.join(argv)}".rstrip())
    names = [PAIR, *(row[1] for row in rows if row[0] == sizes[-1] and row[1] != PAIR)]
    seconds = {row[1]: row[2] for row in rows if row[0] == sizes[-1]}
    chart.bars(RESULTS / "speed_pressure.png", names, {"": [seconds[name] for name in names]},
               "seconds per solve to 1e-10", f"Pressure at {sizes[-1]}³, one rank: python -m runs "
               "bench pressure", logarithmic=True)


def table(cells: int) -> list[Row]:
    """One row per preconditioner, the pair first."""
    pair = statistics.median(in_turn(10, pair=transform_pair(cells))["pair"])
    found = [(PAIR, pair, 0.0, 0)]
    for name, options in OPTIONS.items():
        try:
            found.append((name, *solve(cells, options, 10 if name == OURS else 1)))
        except scenes.SceneError as error:
            print(f"{cells}³ {name}: {error}")
    ours = next(seconds for name, seconds, *_ in found if name == OURS)
    for name, seconds, set_up, iterations in found:
        print(f"{cells}³ {name:<24} {seconds:9.4f} s, set-up {set_up:6.2f} s, {iterations:4d} "
              f"iterations, {seconds / ours:7.2f} × the transform", flush=True)
    return [(cells, *row, row[1] / ours) for row in found]


def solve(cells: int, options: str, repeats: int) -> tuple[float, float, int]:
    """Median seconds of a solve, seconds of the set-up, iterations."""
    levels = (cells & -cells).bit_length() - 1   # halved until 2 cells (or an odd number) are left
    options = options.format(levels=max(levels, 1))
    domain = scenes.build({"domain": {"cells": [cells] * 3, "boundary": "wall"},
                           "time": {"end": 1, "frame": 1}}).domain
    pressure.set_options(options)
    start = time.perf_counter()
    try:
        grid = Grid(domain, MPI.COMM_WORLD)
        solver = pressure.PressureSolver(grid)
    finally:
        pressure.clear_options(options)
    set_up = time.perf_counter() - start
    job = solve_job(solver)
    if repeats > 1:
        job()   # warm-up
    found: list[int] = []
    seconds = in_turn(repeats, solve=lambda: found.append(job()))["solve"]
    solver.destroy()
    grid.destroy()
    return statistics.median(seconds), set_up, found[-1]
