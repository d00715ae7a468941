"""What came out of a sweep: one line per run, and the same as a plot."""

import csv
from pathlib import Path
from typing import Any

from runs.sweep.run import is_done, status
from runs.sweep.table import Case
from solver.files import FileError, read_steps

# Of the last step of run.log.jsonl, and how many steps there were.
MEASURES = ("steps", "time", "energy", "gas", "heat", "burnt", "fuel", "soot", "divergence")


def row(case: Case, folder: Path) -> dict[str, Any]:
    """State, values and measures of one run."""
    state = "done" if is_done(case, folder) else status(folder).get("state", "to do")
    if state == "done" and not is_done(case, folder):
        state = "out of date"
    return {"name": case.name, **case.values, "state": state, **measures(folder)}


def measures(folder: Path) -> dict[str, Any]:
    """The last step in a run's log; nothing where it has not begun, or its log is damaged."""
    try:
        last = read_steps(folder)[-1]
    except (FileError, IndexError):
        return {}
    return {"steps": last["step"]} | {name: last[name] for name in MEASURES if name in last}


def write(cases: list[Case], out: Path) -> Path:
    """OUT/summary.csv and, where a value is a number, OUT/summary.png; returns the table."""
    rows = [row(case, out / case.name) for case in cases]
    keys = list(dict.fromkeys(key for case in cases for key in case.values))
    path = out / "summary.csv"
    out.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["name", *keys, "state", *MEASURES], restval="")
        writer.writeheader()
        writer.writerows(rows)
    plot(rows, keys, out / "summary.png")
    return path


def plot(rows: list[dict[str, Any]], keys: list[str], path: Path) -> None:
    """A column per swept number, a line per measure that differs between the runs."""
    done = [row for row in rows if row["state"] == "done"]
    varied = [key for key in keys if all(_is_number(row.get(key)) for row in done)
              and len({row[key] for row in done}) > 1]
    shown = [name for name in MEASURES if len({row.get(name) for row in done}) > 1
             and all(_is_number(row.get(name)) for row in done)]
    if not varied or not shown:
        path.unlink(missing_ok=True)
        return
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(len(shown), len(varied), squeeze=False, layout="constrained",
                                figsize=(0.8 + 2.8 * len(varied), 0.6 + 1.6 * len(shown)))
    for line, name in zip(axes, shown, strict=True):
        for axis, key in zip(line, varied, strict=True):
            axis.plot([row[key] for row in done], [row[name] for row in done], "o", markersize=4,
                      alpha=0.7)
            axis.set_xlabel(key if name == shown[-1] else "")
        line[0].set_ylabel(name)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
