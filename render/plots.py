"""What did a run do? Quick diagnostics without ray tracing, as PNG files.

    slices_NNNNNN   the plane through the middle of the box, z = const: temperature, pressure, speed
                    with arrows, divergence of the velocity
    history         over time: step and its reason, iterations, divergence error, energy, what was
                    burnt, numbers of particles
    bodies          paths of the pieces, seen from the front and from the side, and their speeds
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver import files
from solver.files import Field, Snapshot

Array = NDArray[Any]
ARROWS = 24     # along each axis of a slice


def draw(run: Path, frames: Sequence[int], output: Path) -> list[Path]:
    """Draw everything that a run has; returns the files."""
    output.mkdir(parents=True, exist_ok=True)
    drawn = []
    for frame in frames:
        snapshot = files.read_snapshot(run, frame)
        if snapshot.fields:
            drawn.append(slices(snapshot, output / f"slices_{frame:06d}.png"))
    records = files.read_steps(run)
    if records:
        drawn.append(history(records, output / "history.png"))
    moments = [files.read_snapshot(run, frame, ()) for frame in files.snapshot_frames(run)]
    if len(moments[0].bodies.get("position", ())):
        drawn.append(paths(moments, output / "bodies.png"))
    return drawn


def middle(field: Field) -> Array:
    """(ny, nx) the plane through the middle of a field; the mean of two where there are two."""
    n = len(field.values)
    return np.asarray(field.values[(n - 1) // 2:n // 2 + 1].mean(axis=0), np.float64)


def velocity(fields: Mapping[str, Field]) -> tuple[Array, Array, Array, Array]:
    """u, v, w at the cell centres, and the divergence, of face values; (nz, ny, nx) each."""
    u, v, w = (np.asarray(fields[name].values, np.float64) for name in "uvw")
    dx, dy, dz = fields["u"].spacing
    return ((u[:, :, 1:] + u[:, :, :-1]) / 2, (v[:, 1:] + v[:, :-1]) / 2, (w[1:] + w[:-1]) / 2,
            np.diff(u, axis=2) / dx + np.diff(v, axis=1) / dy + np.diff(w, axis=0) / dz)


def slices(snapshot: Snapshot, path: Path) -> Path:
    """Temperature, pressure, speed and divergence on the middle plane."""
    fields = snapshot.fields
    planes = [(name, middle(fields[key]), colours) for name, key, colours in (
        ("temperature, K", "T", "inferno"), ("pressure", "p", "viridis")) if key in fields]
    arrows = None
    if all(name in fields for name in "uvw"):
        u, v, w, divergence = velocity(fields)
        half = slice((len(u) - 1) // 2, len(u) // 2 + 1)
        arrows = u[half].mean(axis=0), v[half].mean(axis=0)
        planes.append(("speed, L/s", np.sqrt(u ** 2 + v ** 2 + w ** 2)[half].mean(axis=0),
                       "viridis"))
        planes.append(("divergence, 1/s", divergence[half].mean(axis=0), "RdBu_r"))
    figure, axes = _figure(len(planes), f"frame {snapshot.frame}, t = {snapshot.time:.4g} s")
    some = next(iter(fields.values()))
    for axis, (name, plane, colours) in zip(axes, planes, strict=True):
        ny, nx = plane.shape
        extent = (0.0, nx * some.spacing[0], 0.0, ny * some.spacing[1])
        most = abs(plane).max() if colours == "RdBu_r" else None
        shown = axis.imshow(plane, origin="lower", extent=extent, cmap=colours, vmax=most,
                            vmin=None if most is None else -most)
        figure.colorbar(shown, ax=axis, shrink=0.8)
        axis.set(title=name, xlabel="x, L", ylabel="y, L")
        if name.startswith("speed") and arrows is not None:
            _arrows(axis, arrows, extent)
    return _save(figure, path)


def _arrows(axis: Any, arrows: tuple[Array, Array], extent: tuple[float, ...]) -> None:
    ny, nx = arrows[0].shape
    j, i = (np.unique(np.linspace(0, n - 1, min(n, ARROWS)).round().astype(int))
            for n in (ny, nx))
    x, y = (i + 0.5) * extent[1] / nx, (j + 0.5) * extent[3] / ny
    axis.quiver(x, y, arrows[0][np.ix_(j, i)], arrows[1][np.ix_(j, i)], color="white", pivot="mid")


def history(records: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """What the journal tells, over time."""
    time = np.array([record["time"] for record in records])
    groups = [("step dt, s", ("dt",), True), ("iterations", ("iterations",), False),
              ("largest divergence error", ("divergence",), True),
              ("kinetic energy", ("energy",), False),
              ("burnt mass, gas, heat", ("burnt", "gas", "heat"), False),
              ("particles", ("fuel", "soot", "burning"), False)]
    known = [(title, [key for key in keys if key in records[0]], log)
             for title, keys, log in groups]
    known = [group for group in known if group[1]]
    figure, axes = _figure(len(known), f"{len(records)} steps")
    for axis, (title, keys, log) in zip(axes, known, strict=True):
        for key in keys:
            values = np.array([float(record[key]) for record in records])
            if log:
                _by_reason(axis, time, values, records if key == "dt" else None)
                axis.set_yscale("log")
            else:
                axis.plot(time, values, label=key)
        axis.set(title=title, xlabel="t, s")
        if len(keys) > 1 or keys == ["dt"]:
            axis.legend()
    return _save(figure, path)


def _by_reason(axis: Any, time: Array, values: Array,
               records: Sequence[Mapping[str, Any]] | None) -> None:
    """Points, coloured by the step's reason; a logarithmic scale has no place for zeros."""
    reasons = np.array([str(record.get("reason", "")) if records is not None else ""
                        for record in records or [{}] * len(time)])
    for reason in np.unique(reasons):
        chosen = (reasons == reason) & (values > 0)
        axis.plot(time[chosen], values[chosen], ".", markersize=3, label=reason)


def paths(moments: Sequence[Snapshot], path: Path) -> Path:
    """Paths and speeds of the pieces."""
    place = np.array([moment.bodies["position"] for moment in moments])
    time = np.array([moment.time for moment in moments])
    figure, axes = _figure(3, f"{place.shape[1]} pieces")
    for axis, (a, b) in zip(axes, ((0, 1), (2, 1)), strict=False):
        axis.plot(place[..., a], place[..., b])
        axis.set(xlabel=f"{'xyz'[a]}, L", ylabel=f"{'xyz'[b]}, L", aspect="equal",
                 title="from the front" if a == 0 else "from the side")
    speed = np.linalg.norm([moment.bodies["velocity"] for moment in moments], axis=2)
    axes[2].plot(time, speed)
    axes[2].set(title="speed, L/s", xlabel="t, s")
    return _save(figure, path)


def _figure(count: int, title: str) -> tuple[Any, list[Any]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    columns = min(count, 3) if count != 4 else 2
    rows = -(-count // columns)
    figure = Figure(figsize=(4.6 * columns, 3.8 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = [figure.add_subplot(rows, columns, i + 1) for i in range(count)]
    return figure, axes


def _save(figure: Any, path: Path) -> Path:
    figure.savefig(path, dpi=110)
    return path
