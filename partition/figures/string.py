"""How does a string vibrate, and what has that to do with graphs? (thesis, figure 4.3)

A string of n beads is a path; the eigenvectors of its Laplacian are its shapes of vibration,
cos(pi k (i + 1/2) / n) with eigenvalues 2 - 2 cos(pi k / n) for free ends. The second divides it in
two halves, one above (+) and one below (-) the place of rest.
"""

from pathlib import Path

import numpy as np

from partition.figures import paper
from partition.spectral import modes
from partition.weights import Graph

BEADS, SHAPES = 40, 3


def draw(path: str | Path) -> list[str]:
    """The picture; the eigenvalues beside their closed form."""
    one = np.ones(BEADS - 1)
    string = Graph(np.ones(BEADS), np.arange(BEADS - 1), np.arange(1, BEADS), one, one, one)
    found = modes(string, SHAPES - 1)
    values = [0.0, *found.values]
    shapes = [np.full(BEADS, 0.4), *(found.vectors * np.sqrt(BEADS / 2)).T]
    made, panels = paper.figure(10.0, 2.6, SHAPES)
    numbers = []
    for k, (axes, value, shape) in enumerate(zip(panels, values, shapes, strict=True)):
        shape = shape if shape[0] > 0 else -shape
        axes.plot([0, BEADS - 1], [0, 0], ":", color=paper.LINE)
        axes.plot(shape, ".-", color="#2f6fb3", markersize=4)
        for run in np.split(np.arange(BEADS), np.flatnonzero(np.diff(np.sign(shape))) + 1):
            axes.text(run.mean(), 1.15, "+" if shape[run[0]] > 0 else "−", ha="center",
                      va="center", fontsize=15, color=paper.INK)
        axes.set_ylim(-1.3, 1.4)
        axes.set_axis_off()
        axes.set_title(f"$\\lambda_{k + 1}$ = {value:.6f}", fontsize=11, color=paper.INK)
        exact = 2 - 2 * np.cos(np.pi * k / BEADS)
        numbers.append(f"lambda_{k + 1} = {value:.12f}, closed form {exact:.12f}")
    paper.save(made, path)
    return numbers
