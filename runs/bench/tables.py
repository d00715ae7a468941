"""Flows without a formula, against published tables: lid-driven cavities, Taylor-Green turbulence.

    python -m runs bench tables cavity_2d [key=value ...]     Botella & Peyret 1998, Re 1000
    python -m runs bench tables cavity_2d fluid.reynolds=100  Ghia, Ghia & Shin 1982
    python -m runs bench tables cavity_3d                     Albensoeder & Kuhlmann 2005, Re 1000
    python -m runs bench tables taylor_green                  512³ spectral, Re 1600

Prints the largest deviation and writes what was compared to runs/bench/results/.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from runs.bench import chart
from solver import scene as scenes
from solver.grid import INNER
from solver.step import Simulation

EXACT = Path(__file__).parent.parent / "exact"
RESULTS = Path(__file__).parent / "results"
Array = NDArray[np.float64]


def main(argv: list[str]) -> None:
    """Run one of the tables; see the module."""
    kinds = {"cavity_2d": cavity_2d, "cavity_3d": cavity_3d, "taylor_green": taylor_green}
    if not argv or argv[0] not in kinds:
        raise SystemExit(f"bench tables: fix: name one of {', '.join(kinds)}")
    RESULTS.mkdir(exist_ok=True)
    kinds[argv[0]](argv[1:])


def table(name: str) -> Array:
    """Columns of a table, comments and heading dropped; empty cells are NaN."""
    return np.genfromtxt(EXACT / "tables" / f"{name}.csv", delimiter=",", comments="#",
                         skip_header=0)[1:]


def cavity_2d(overrides: list[str]) -> None:
    """u(y) on x = ½ and v(x) on y = ½."""
    scene = scenes.load(EXACT / "lid_cavity_2d.toml", overrides)
    spectral = scene.fluid.reynolds == 1000
    column = 3 if spectral else 1
    rows_u, rows_v = table("cavity_2d_u"), table("cavity_2d_v")
    cavity(scene, "cavity_2d", rows_u[:, [0, column]], rows_v[:, [0, column]])


def cavity_3d(overrides: list[str]) -> None:
    """u(y) on x = z = ½ and v(x) on y = z = ½."""
    rows = table("cavity_3d_re1000")
    cavity(scenes.load(EXACT / "lid_cavity_3d.toml", overrides), "cavity_3d", rows[:, :2],
           rows[:, 2:4])


def cavity(scene: scenes.Scene, name: str, wanted_u: Array, wanted_v: Array) -> None:
    """Run to the steady state and compare both profiles at all points of the table."""
    simulation = Simulation(scene)
    start = time.perf_counter()
    for _ in simulation.run_to(scene.time.end):
        pass
    seconds = time.perf_counter() - start
    u, v = simulation.state.u[INNER], simulation.state.v[INNER]
    nz, n, _ = u.shape
    middle = [nz // 2] if nz % 2 else [nz // 2 - 1, nz // 2]
    centres = np.concatenate([[0], (np.arange(n) + 0.5) / n, [1]])
    profile_u = np.concatenate([[0], u[middle][:, :, n // 2 - 1].mean(axis=0), [1]])
    profile_v = np.concatenate([[0], v[middle][:, n // 2 - 1, :].mean(axis=0), [0]])
    found = []
    for label, rows, profile in (("u", wanted_u, profile_u), ("v", wanted_v, profile_v)):
        values = CubicSpline(centres, profile)(rows[:, 0])
        found += [(label, *row, value, value - row[1]) for row, value in zip(rows, values,
                                                                             strict=True)]
    worst = max(abs(row[-1]) for row in found)
    chart.write_csv(RESULTS / f"{name}_re{scene.fluid.reynolds:g}_{n}.csv",
                    "component,place,table,found,difference", found,
                    f"python -m runs bench tables {name}: {n} cells, {scene.time.integrator}, "
                    f"{scene.fluid.advection}, {simulation.state.step} steps, {seconds:.0f} s; "
                    f"largest difference {worst:.5f} of the lid speed")
    print(f"{name} Re {scene.fluid.reynolds:g} {n} cells: largest difference {100 * worst:.3f} % "
          f"of the lid speed, {simulation.state.step} steps, {seconds:.0f} s")
    simulation.destroy()


def taylor_green(overrides: list[str]) -> None:
    """Kinetic energy and dissipation in time."""
    scene = scenes.load(EXACT / "taylor_green_re1600.toml", overrides)
    simulation = Simulation(scene)
    start = time.perf_counter()
    volume = float(np.prod(scene.domain.size))
    series: list[tuple[float, float]] = [(0.0, simulation.report.energy / volume)]
    for report in simulation.run_to(scene.time.end):
        series.append((simulation.state.time, report.energy / volume))
    seconds = time.perf_counter() - start
    times, energy = np.array(series).T
    dissipation = -CubicSpline(times, energy)(times, 1)
    wanted = table("taylor_green_re1600")
    wanted = wanted[wanted[:, 0] <= times[-1]]
    found = CubicSpline(times, dissipation)(wanted[:, 0])
    peak = wanted[:, 2].max()
    n = scene.domain.cells[0]
    rows = [(*row, value) for row, value in zip(wanted[:, [0, 2]], found, strict=True)]
    text = (f"taylor_green Re 1600 {n}³, {scene.time.integrator} {scene.fluid.advection}: "
            f"dissipation off by at most {100 * np.abs(found - wanted[:, 2]).max() / peak:.1f} %, "
            f"on average {100 * np.abs(found - wanted[:, 2]).mean() / peak:.1f} % of the peak; "
            f"{simulation.state.step} steps, {seconds:.0f} s")
    print(text)
    name = f"taylor_green_re1600_{n}_{scene.fluid.advection}"
    chart.write_csv(RESULTS / f"{name}.csv", "t,table,found", rows, text)
    curves: list[Any] = [("512³ spectral", wanted[:, 0], wanted[:, 2], "k-")]
    for path in sorted(RESULTS.glob("taylor_green_re1600_*.csv")):
        t, _, eps = np.genfromtxt(path, delimiter=",", comments="#", skip_header=2).T
        curves.append((path.stem.removeprefix("taylor_green_re1600_"), t, eps, "-"))
    chart.lines(RESULTS / "taylor_green_re1600.png", curves, "t", "-dE/dt",
                "python -m runs bench tables taylor_green")
    simulation.destroy()
