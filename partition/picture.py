"""What do the pieces look like, pulled apart?

Every piece moves away from the centre of its body by a fraction of its distance from it. The
triangles are then projected in parallel, sorted from back to front and filled with the colour of
their piece, shaded by one light (painter's algorithm). The inner faces of a fracture are darker.
"""

import colorsys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition.fragments import NO_NEIGHBOUR, Fragments

Floats = NDArray[np.float64]
GOLDEN_RATIO = 0.6180339887
LIGHT = np.array([-0.35, 0.75, 0.55]) / np.linalg.norm([-0.35, 0.75, 0.55])
INNER = 0.62
INCHES, DOTS = 10.0, 90
BACKGROUND, INK = "#15171c", "#d8dce4"
COLOURS = 256           # of the palette


def save(path: str | Path, fragments: Fragments, title: str, explode: float = 0.35,
         azimuth: float = 30.0, elevation: float = 18.0) -> None:
    """Write a PNG (or whatever the suffix says); angles in degrees, explode as a factor."""
    figure = dark_figure(INCHES, INCHES)
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.92))
    draw(axes, fragments, explode, azimuth, elevation)
    figure.text(0.5, 0.965, title, color=INK, ha="center", va="center", fontsize=15)
    write(figure, path)


def dark_figure(width: float, height: float) -> Any:
    """An empty matplotlib figure that no window shows; inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DOTS, facecolor=BACKGROUND)
    FigureCanvasAgg(figure)
    return figure


def write(figure: Any, path: str | Path, background: str = BACKGROUND,
          colours: int = COLOURS) -> None:
    """As the suffix says; a PNG with a palette, a quarter of the bytes that full colour takes."""
    if Path(path).suffix != ".png":
        figure.savefig(path, facecolor=background)
        return
    from PIL import Image

    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[:, :, :3]
    image = Image.fromarray(pixels).quantize(colours, kmeans=3, dither=Image.Dither.NONE)
    image.save(path, optimize=True)


def draw(axes: Any, fragments: Fragments, explode: float, azimuth: float,
         elevation: float) -> None:
    """The pieces, into matplotlib axes."""
    from matplotlib.collections import PolyCollection

    corners, colours = _scene(fragments, explode, _view(azimuth, elevation))
    flat = corners[:, :, :2]
    axes.add_collection(PolyCollection(list(flat), facecolors=colours, edgecolors=colours,
                                       linewidths=0.3))
    middle = (flat.min(axis=(0, 1)) + flat.max(axis=(0, 1))) / 2
    reach = 0.53 * np.ptp(flat, axis=(0, 1)).max()
    axes.set_xlim(middle[0] - reach, middle[0] + reach)
    axes.set_ylim(middle[1] - reach, middle[1] + reach)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _view(azimuth: float, elevation: float) -> Floats:
    """Rows: right, up and towards the viewer, y being up in the scene."""
    a, e = np.radians([azimuth, elevation])
    towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    return np.stack([right, np.cross(towards, right), towards])


def _scene(fragments: Fragments, explode: float, view: Floats) -> tuple[Floats, Floats]:
    """Projected triangles (t, 3, 3) and colours (t, 3), back to front."""
    area, _, centre = fragments.measures()
    number = fragments.body
    total = np.bincount(number, area)
    middle = np.stack([np.bincount(number, area * x) / total for x in centre.T], axis=1)
    shift = explode * (centre - middle[number])
    piece = fragments.piece_of_face
    corners = (fragments.vertices + shift[fragments.piece_of_vertex])[fragments.faces] @ view.T
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    shown = (normal[:, 2] > 0) | ~fragments.closed[piece]
    towards = np.where(normal[:, 2:] < 0, -normal, normal)
    bright = 0.36 + 0.64 * np.clip(towards @ LIGHT, 0, 1)
    bright = bright * np.where(fragments.face_neighbour != NO_NEIGHBOUR, INNER, 1.0)
    bright = bright * np.where(normal[:, 2] < 0, INNER, 1.0)
    colours = palette(fragments.count)[piece] * bright[:, None]
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    order = order[shown[order]]
    return corners[order], np.clip(colours[order], 0, 1)


def palette(count: int) -> Floats:
    """(count, 3) well separated colours: hues a golden section apart, three levels of lightness."""
    return np.array([colorsys.hls_to_rgb((0.58 + GOLDEN_RATIO * i) % 1, (0.66, 0.75, 0.58)[i % 3],
                                         0.60) for i in range(count)])
