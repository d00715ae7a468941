"""Error against run time: every exact case with every scheme on a ladder of grids.

    python -m runs bench accuracy [case ...]      (default: all that have an order; a few minutes)

Seconds are processor seconds of stepping on one rank, after a warm-up. A scheme is worth having
where it lies on the Pareto front: no other reaches a smaller error in less time. Writes
results/accuracy.csv, a plot per case, and prints the observed orders and how much faster the
default is than the thesis' scheme at the same error.
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


def scheme(integrator: str, advection: str, temperature: str, cfl: float) -> list[str]:
    """Overrides of a scene."""
    return [f'time.integrator="{integrator}"', f'fluid.advection="{advection}"',
            f'fluid.temperature_advection="{temperature}"', f"time.cfl={cfl}"]


# name: (overrides, PETSc options, plot style). Everything the scene does not say is the default.
SCHEMES: dict[str, tuple[list[str], str, str]] = {
    DEFAULT: ([], "", "ko-"),
    "rk3 central cfl 0.5": (scheme("rk3", "central", "tvd", 0.5), "", "C0s-"),
    "rk3 central cfl 1": (scheme("rk3", "central", "tvd", 1.0), "", "C1^-"),
    "rk3 central4 cfl 0.5": (scheme("rk3", "central4", "tvd", 0.5), "", "C6*-"),
    "rk2 central cfl 0.5": (scheme("rk2", "central", "tvd", 0.5), "", "C5d-"),
    "rk3 tvd cfl 1": (scheme("rk3", "tvd", "tvd", 1.0), "", "C2v-"),
    "rk2 tvd cfl 0.5": (scheme("rk2", "tvd", "tvd", 0.5), "", "C4<-"),
    "thesis' scheme with the fast pressure": (scheme("euler", "donor", "donor", 0.5), "", "C3x-"),
    THESIS: (scheme("euler", "donor", "donor", 0.5),
             "-pressure_pc_type none -pressure_ksp_rtol 1e-6", "C3+--"),
}
Row = tuple[Any, ...]


def main(argv: list[str]) -> None:
    """Run the ladder of the named cases."""
    names = argv or [name for name in case.names() if "order" in case.answer(name)]
    RESULTS.mkdir(exist_ok=True)
    rows = [row for name in names for row in ladder(name)]
    chart.write_csv(RESULTS / "accuracy.csv", "case,scheme,cells,seconds,steps,iterations,"
                    "l2_velocity,max_velocity,l2_p,max_p,l2_T,max_T", rows,
                    f"python -m runs bench accuracy {' '.join(argv)}".rstrip())
    for name in names:
        mine = [row for row in rows if row[0] == name]
        orders(name, [row for row in mine if row[1] == DEFAULT])
        plot(name, mine)
        print(f"  at equal error {speed_up(mine):.0f} times faster than the thesis' scheme")


def ladder(name: str) -> Iterator[Row]:
    """One row per scheme and grid."""
    cells = case.answer(name)["ladder"]
    for label, (overrides, options, _) in SCHEMES.items():
        pressure.set_options(options)
        case.run(name, cells[0], overrides)   # warm-up
        for n in cells:
            found = case.run(name, n, overrides)
            yield (name, label, n, found.seconds, found.steps, found.iterations,
                   *(errors(found, field, norm) for field in ("velocity", "p", "T")
                     for norm in ("l2", "most")))
        pressure.clear_options(options)


def errors(found: case.Result, field: str, norm: str) -> float:
    """The error of p or T, or the largest of the velocity components; NaN where none is known."""
    values = getattr(found, norm)
    known = [values[f] for f in ("uvw" if field == "velocity" else field) if f in values]
    return max(known, default=float("nan"))


def orders(name: str, rows: list[Row]) -> None:
    """Print the observed orders of the default between the two finest grids."""
    coarse, fine = rows[-2], rows[-1]
    found = [np.log2(a / b) if b > 1e-13 else float("nan")
             for a, b in zip(coarse[6:], fine[6:], strict=True)]
    print(f"{name:<26} order of velocity {found[0]:.2f} {found[1]:.2f}, p {found[2]:.2f} "
          f"{found[3]:.2f}, T {found[4]:.2f} {found[5]:.2f} (L2, L∞)")


def measured(row: Row) -> float:
    """The error that a plot shows: of the velocity, or of T where that is exact."""
    return float(row[6] if row[6] > 1e-12 else row[10])


def speed_up(rows: list[Row]) -> float:
    """Seconds of the thesis' scheme over those of the default at an error both can reach: the
    smallest of the thesis' scheme, the default's time read off its (log-log) curve or, where even
    its coarsest grid is better, the time of that grid: a lower bound."""
    thesis = min((row for row in rows if row[1] == THESIS), key=measured)
    curve = sorted((measured(row), row[3]) for row in rows if row[1] == DEFAULT)
    seconds = np.exp(np.interp(np.log(measured(thesis)), *np.log(np.array(curve)).T))
    return float(thesis[3] / seconds)


def plot(name: str, rows: list[Row]) -> None:
    """Error against seconds, with the Pareto front of all schemes."""
    curves = [(label, [row[3] for row in rows if row[1] == label],
               [measured(row) for row in rows if row[1] == label], style)
              for label, (_, _, style) in SCHEMES.items()]
    front, best = [], np.inf
    for seconds, error in sorted((row[3], measured(row)) for row in rows):
        if error < best:
            front.append((seconds, error))
            best = error
    curves.append(("Pareto front", *np.array(front).T, "y-"))
    chart.lines(RESULTS / f"accuracy_{name}.png", curves, "processor seconds",
                "relative error in L2", f"{name}: python -m runs bench accuracy", logarithmic=True)
