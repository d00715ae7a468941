"""Results of benchmarks as CSV files and plots that name the command that made them."""

import platform
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np
import scipy

LARGE = 6   # significant digits


def machine() -> str:
    """Where and with what it was measured."""
    model = "unknown processor"
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.split(":", 1)[1].strip() for line in info.read_text().splitlines()
                 if line.startswith("model name")]
        model = f"{len(names)} × {names[0]}" if names else model
    return (f"{model}, Python {platform.python_version()}, numpy {np.__version__}, scipy "
            f"{scipy.__version__}, numba {numba.__version__}")


def write_csv(path: Path, heading: str, rows: Iterable[Sequence[Any]], command: str) -> None:
    """A table with a first line that says how it was made."""
    lines = [f"# {command}; {machine()}", heading]
    lines += [",".join(f"{value:.{LARGE}g}" if isinstance(value, float) else str(value)
                       for value in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def lines(path: Path, curves: Sequence[tuple[str, Any, Any, str]], x: str, y: str, title: str,
          logarithmic: bool = False, x_scale: str = "linear") -> None:
    """A plot of (label, x, y, style) curves."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7 if len(curves) <= 8 else 10, 5),
                                   layout="constrained")
    for label, xs, ys, style in curves:
        axes.plot(xs, ys, style, label=label, linewidth=1.2, markersize=4)
    axes.set_xscale(x_scale)
    if logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.grid(alpha=0.3, which="both")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=9)
    many = len(curves) > 8
    axes.legend(fontsize=8, **({"loc": "upper left", "bbox_to_anchor": (1, 1)} if many else {}))
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def bars(path: Path, names: Sequence[str], parts: Mapping[str, Sequence[float]], x: str, title: str,
         logarithmic: bool = False) -> None:
    """Horizontal bars, one per name, stacked from the parts (label: a value per name)."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7, 1 + 0.4 * len(names)), layout="constrained")
    left = np.zeros(len(names))
    for label, values in parts.items():
        axes.barh(list(names), values, left=left, label=label, height=0.6)
        left = left + np.array(values)
    for row, total in enumerate(left):
        axes.text(total, row, f" {total:.3g}", va="center", fontsize=8)
    axes.invert_yaxis()
    if logarithmic:
        axes.set_xscale("log")
    axes.margins(x=0.1)
    axes.set_xlabel(x)
    axes.set_title(title, fontsize=9)
    if len(parts) > 1:
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
