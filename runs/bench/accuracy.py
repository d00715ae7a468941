"""Error against run time: every exact case with every scheme on a ladder of grids.

    python -m runs bench accuracy [case ...] [longest=10]     (all with an order; 10 minutes)

Seconds are processor seconds of stepping on one rank, after a warm-up. A finer grid is left out for
a scheme that would take more than `longest` seconds there. A scheme is worth having where it lies
on the Pareto front: no other reaches a smaller error in less time. Writes the rows of its cases to
results/accuracy.csv and a plot per case, and prints how much faster the default is than the thesis'
scheme at the same error, and which points of other schemes beat it.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from runs.bench import chart
from runs.exact import case
from solver import pressure

RESULTS = Path(__file__).parent / "results"
DEFAULT, THESIS = "default", "thesis"
THESIS_FAST = "thesis' scheme with the fast pressure"


def scheme(integrator: str, advection: str, temperature: str, cfl: float) -> list[str]:
    """Overrides of a scene."""
    return [f'time.integrator="{integrator}"', f'fluid.advection="{advection}"',
            f'fluid.temperature_advection="{temperature}"', f"time.cfl={cfl}"]


# name: (overrides, PETSc options, plot style). Everything the scene does not say is the default.
# Where there are options PETSc solves alone, from 0, which is slower by a fifth of the step.
SCHEMES: dict[str, tuple[list[str], str, str]] = {
    DEFAULT: ([], "", "ko-"),
    "rk3 central cfl 0.5": (scheme("rk3", "central", "tvd", 0.5), "", "C0s-"),
    "rk3 central cfl 1": (scheme("rk3", "central", "tvd", 1.0), "", "C1^-"),
    "rk3 central4 cfl 0.5": (scheme("rk3", "central4", "tvd", 0.5), "", "C6*-"),
    "rk3 central4 cfl 0.25": (scheme("rk3", "central4", "tvd", 0.25), "", "C7*--"),
    "default, tolerance 1e-4": ([], "-pressure_ksp_rtol 1e-4", "C8p:"),
    "default, CG without preconditioner 1e-6": ([], "-pressure_pc_type none "
                                                "-pressure_ksp_rtol 1e-6", "C9h:"),
    "rk2 central cfl 0.5": (scheme("rk2", "central", "tvd", 0.5), "", "C5d-"),
    "rk3 tvd cfl 1": (scheme("rk3", "tvd", "tvd", 1.0), "", "C2v-"),
    "rk2 tvd cfl 0.5": (scheme("rk2", "tvd", "tvd", 0.5), "", "C4<-"),
    THESIS_FAST: (scheme("euler", "donor", "donor", 0.5), "", "C3x-"),
    THESIS: (scheme("euler", "donor", "donor", 0.5),
             "-pressure_pc_type none -pressure_ksp_rtol 1e-6", "C3+--"),
    "thesis, tolerance 1e-3": (scheme("euler", "donor", "donor", 0.5),
                               "-pressure_pc_type none -pressure_ksp_rtol 1e-3", "C3.:"),
}
Row = tuple[Any, ...]   # the columns of the table


def main(argv: list[str]) -> None:
    """Run the ladder of the named cases."""
    longest = float(next((a.partition("=")[2] for a in argv if a.startswith("longest=")), 10))
    names = [a for a in argv if "=" not in a] or [
        name for name in case.names() if "order" in case.answer(name)]
    RESULTS.mkdir(exist_ok=True)
    for name in names:
        rows = list(ladder(name, longest))
        keep(name, rows)
        plot(name, rows)
        print(f"{name}: at equal error {speed_up(rows, THESIS):.3g} times faster than the thesis' "
              f"scheme, {speed_up(rows, THESIS_FAST):.3g} with the fast pressure for both; "
              f"{beaten(rows)}", flush=True)


def keep(name: str, rows: list[Row]) -> None:
    """Put the rows of a case in the place of those that the table has."""
    path = RESULTS / "accuracy.csv"
    old = path.read_text(encoding="utf-8").splitlines()[2:] if path.exists() else []
    others = [tuple(line.split(",")) for line in old if not line.startswith(f"{name},")]
    chart.write_csv(path, "case,scheme,cells,seconds,steps,iterations,l2_velocity,max_velocity,"
                    "l2_p,max_p,l2_T,max_T", sorted([*others, *rows], key=lambda row: row[0]),
                    "python -m runs bench accuracy")


def ladder(name: str, longest: float) -> Iterator[Row]:
    """One row per scheme and grid."""
    cells = case.answer(name)["ladder"]
    growth = 2.0 ** (1 + sum(n > 1 for n in case.build(name, cells[0], []).domain.cells))
    for label, (overrides, options, _) in SCHEMES.items():
        pressure.set_options(options)
        case.run(name, cells[0], overrides)   # warm-up
        seconds = 0.0
        for n in cells:
            if growth * seconds > longest:
                break
            found = case.run(name, n, overrides)
            seconds = found.seconds
            yield (name, label.replace(",", ";"), n, seconds, found.steps, found.iterations,
                   *(errors(found, field, norm) for field in ("velocity", "p", "T")
                     for norm in ("l2", "most")))
        pressure.clear_options(options)


def errors(found: case.Result, field: str, norm: str) -> float:
    """The error of p or T, or the largest of the velocity components; NaN where none is known."""
    values = getattr(found, norm)
    known = [values[f] for f in ("uvw" if field == "velocity" else field) if f in values]
    return max(known, default=float("nan"))


def measured(row: Row) -> float:
    """The error that a plot shows: of the velocity, or of T where that is exact."""
    return float(row[6] if row[6] > 1e-12 else row[10])


def speed_up(rows: list[Row], other: str) -> float:
    """Seconds of another scheme over those of the default at an error both can reach: the smallest
    of the other, the default's time read off its (log-log) curve or, where even its coarsest grid
    is better, the time of that grid: a lower bound."""
    best = min((row for row in rows if row[1] == other), key=measured)
    curve = sorted((measured(row), row[3]) for row in rows if row[1] == DEFAULT)
    seconds = np.exp(np.interp(np.log(measured(best)), *np.log(np.array(curve)).T))
    return float(best[3] / seconds)


def beaten(rows: list[Row]) -> str:
    """Which points of the default are not on the Pareto front."""
    found = []
    for row in (row for row in rows if row[1] == DEFAULT):
        better = {other[1] for other in rows if other[3] < 0.95 * row[3]
                  and measured(other) < 0.95 * measured(row)} - {"default; tolerance 1e-4"}
        if better:
            found.append(f"{row[2]}: {' and '.join(sorted(better))}")
    return f"the default is beaten at {', '.join(found)}" if found else (
        "the default lies on the Pareto front")


def plot(name: str, rows: list[Row]) -> None:
    """Error against seconds, with the Pareto front of all schemes."""
    by_label = {label: [row for row in rows if row[1] == label.replace(",", ";")]
                for label in SCHEMES}
    curves = [(label, [row[3] for row in mine], [measured(row) for row in mine], SCHEMES[label][2])
              for label, mine in by_label.items()]
    front, best = [], np.inf
    for seconds, error in sorted((row[3], measured(row)) for row in rows):
        if error < best:
            front.append((seconds, error))
            best = error
    curves.append(("Pareto front", *np.array(front).T, "y-"))
    chart.lines(RESULTS / f"accuracy_{name}.png", curves, "processor seconds",
                "relative error in L2", f"{name}: python -m runs bench accuracy", logarithmic=True)
