"""What do the diagrams have in common? Light paper, flat axes, pale colours for pieces."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints
from partition.picture import palette, write

Floats = NDArray[np.float64]
PAPER, INK, LINE = "#ffffff", "#22262e", "#5b6472"
DOTS = 90
COLOURS = 24


def figure(width: float, height: float, columns: int, rows: int = 1) -> tuple[Any, list[Any]]:
    """A matplotlib figure of some inches and its axes, row by row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    made = Figure(figsize=(width, height), dpi=DOTS, facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(made)
    return made, list(np.atleast_1d(made.subplots(rows, columns)).ravel())


def save(made: Any, path: str | Path) -> None:
    """With a palette."""
    write(made, path, PAPER, COLOURS)


def bare(axes: Any, title: str) -> None:
    """Equal units, no frame, a title."""
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(title, fontsize=11, color=INK)


def triangles(axes: Any, points: Floats, faces: Ints, label: Ints | None = None,
              colours: Floats | None = None) -> None:
    """Outlines of triangles; filled by piece if labels (f,) are given, with `colours` (m, 3)."""
    from matplotlib.collections import PolyCollection

    fill: Any = "none"
    if label is not None:
        chosen = palette(int(label.max()) + 1) if colours is None else colours
        fill = (chosen * 0.6 + 0.4)[label]
    axes.add_collection(PolyCollection(list(points[faces]), facecolors=fill, edgecolors=LINE,
                                       linewidths=0.6))
    axes.autoscale_view()


def cuts(axes: Any, points: Floats, faces: Ints, twin: Ints, label: Ints) -> None:
    """A bold line wherever two pieces meet."""
    from matplotlib.collections import LineCollection

    side = np.flatnonzero(twin > np.arange(len(twin)))
    side = side[label[side // 3] != label[twin[side] // 3]]
    ends = np.stack([faces.ravel()[side], np.roll(faces, -1, axis=1).ravel()[side]], axis=1)
    axes.add_collection(LineCollection(list(points[ends]), colors=INK, linewidths=2.6,
                                       capstyle="round"))
