"""A film as one small picture: frames side by side; if it was not filmed, the flow as arrows."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial import ConvexHull

from render.image import load_png
from render.plots import middle
from render.sequence import frame_path
from runs.watch import Run
from solver.files import read_snapshot, snapshot_frames

COLUMNS, ROWS = 5, 2
WIDTH = 1000        # of a strip, pixels
QUALITY = 80        # of its JPEG
ARROWS = 13         # along each axis


def make(run: Run, path: Path) -> Path:
    """Write the strip of a run; returns its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    chosen = spread(snapshot_frames(run.path), COLUMNS * ROWS)
    if run.scene.render is None:
        return arrows(run, chosen[::2], path.with_suffix(".png"))
    tiles = [Image.fromarray(load_png(frame_path(run.path / "frames", frame))) for frame in chosen]
    width = WIDTH // COLUMNS
    height = round(width * tiles[0].height / tiles[0].width)
    sheet = Image.new("RGB", (COLUMNS * width, ROWS * height))
    for place, tile in enumerate(tiles):
        sheet.paste(tile.resize((width, height), Image.Resampling.LANCZOS),
                    (place % COLUMNS * width, place // COLUMNS * height))
    sheet.save(path, "JPEG", quality=QUALITY, optimize=True)
    return path


def spread(frames: list[int], count: int) -> list[int]:
    """So many of the frames, evenly in the power 1.6 of their place: denser at the beginning."""
    places = np.linspace(0, 1, min(count, len(frames))) ** 1.6 * (len(frames) - 1)
    return [frames[round(place)] for place in places]


def arrows(run: Run, chosen: list[int], path: Path) -> Path:
    """The flow in the middle plane and the outline of the body, one panel per frame."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    frames = snapshot_frames(run.path)
    figure = Figure(figsize=(2.6 * len(chosen), 2.8), layout="constrained")
    FigureCanvasAgg(figure)
    for panel, frame in enumerate(chosen):
        axis = figure.add_subplot(1, len(chosen), panel + 1)
        fields = read_snapshot(run.path, frame).fields
        x, u = at_centres(fields["u"], 1)
        y, v = at_centres(fields["v"], 0)
        axis.quiver(x[None, :], y[:, None], u, v, color="0.6", pivot="mid", width=0.008)
        done = frames.index(frame) + 1
        axis.plot(*run.position[:done, 0, :2].T, color="C0", linewidth=1)
        axis.fill(*outline(run.shape[done - 1][:, :2]).T, color="C3")
        axis.set(title=f"t = {run.time[done - 1]:.2g} s", aspect="equal", xticks=(), yticks=(),
                 xlim=(0, run.scene.domain.size[0]), ylim=(0, run.scene.domain.size[1]))
    figure.savefig(path, dpi=90)
    return path


def at_centres(field: Any, axis: int) -> tuple[Any, Any]:
    """(n,) coordinates of some cells along the axis of a face field, and its values there."""
    plane = middle(field)
    faces = plane.shape[axis] - 1
    plane = (np.delete(plane, 0, axis) + np.delete(plane, faces, axis)) / 2
    j, i = (np.linspace(0, n - 1, ARROWS).round().astype(int) for n in plane.shape)
    along = (i, j)[1 - axis]
    return (along + 0.5) * field.spacing[1 - axis], plane[np.ix_(j, i)]


def outline(points: Any) -> Any:
    """The convex hull of points (n, 2), counter-clockwise."""
    return points[ConvexHull(points).vertices]
