"""A run as the solver would leave it, made up: a pane in flight before a turbulent hot ball."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from partition import fragments
from partition.build import build as break_up
from render.frame import Film
from solver import files, files_write, scene

WINDOW: dict[str, Any] = {
    "time": {"end": 0.2, "frame": 0.01},
    "domain": {"cells": [32, 32, 32]},
    "fuel": {}, "soot": {},
    "body": [{"name": "pane", "shape": "pane", "size": [0.6, 0.5, 0.01], "points": 60,
              "place": [0.5, 0.5, 0.6], "areal_density": 20.0, "fracture": {"pieces": 16}}],
    "render": {"width": 32, "height": 32},
}


def make(out: Path, data: dict[str, Any], text: str, frames: int = 3, flight: float = 0.4) -> None:
    """Write OUT: scene.toml with `text`, fragments.h5 and `frames` snapshots."""
    found = scene.build(data)
    (out / "snapshots").mkdir(parents=True)
    (out / "scene.toml").write_text(text, encoding="utf-8")
    pieces = break_up(found) if found.body else None
    if pieces is not None:
        fragments.write(out / "fragments.h5", pieces, {})
    writer = files_write.SnapshotWriter(out)
    for frame in range(frames):
        share = frame / max(frames - 1, 1)
        blocks = {} if pieces is None else bodies(
            pieces, found, flight * share, flight / (max(frames - 1, 1) * found.time.frame))
        if found.has_temperature:
            blocks |= fire(found, share)
        whole = {name: files_write.Block(values, (0,) * values.ndim, values.shape,
                                         attributes(found, values))
                 for name, values in blocks.items()}
        writer.write(frame, whole, {"time": frame * found.time.frame, "step": frame})


def attributes(found: scene.Scene, values: Any) -> dict[str, Any]:
    """Spacing and origin of a field; nothing for tables."""
    if values.ndim != 3:
        return {}
    spacing = np.array(found.domain.size) / found.domain.cells
    return {"spacing": spacing, "origin": spacing / 2}


def bodies(pieces: fragments.Fragments, found: scene.Scene, flight: float,
           rate: float = 0.0) -> dict[str, Any]:
    """Poses of pieces that fly from the detonation, faster near it, and tumble; `rate` is the
    change of `flight` with time."""
    random = np.random.default_rng(5)
    centre = np.array([pieces.piece(i)[0].mean(axis=0) for i in range(pieces.count)])
    away = centre - np.array(found.detonation.position)
    push = away / np.linalg.norm(away, axis=1, keepdims=True) ** 3
    push /= np.linalg.norm(push, axis=1).max()
    spin = random.normal(size=(pieces.count, 3)) * 6 * flight
    angle = np.linalg.norm(spin, axis=1, keepdims=True)
    axis = np.divide(spin, angle, out=np.zeros_like(spin), where=angle > 0)
    turned = np.column_stack([np.cos(angle / 2), axis * np.sin(angle / 2)])
    return {"bodies/position": centre + 1.6 * flight * push, "bodies/orientation": turned,
            "bodies/rest_centre": centre, "bodies/velocity": 1.6 * rate * push,
            "bodies/angular_velocity": np.zeros_like(centre)}


def fire(found: scene.Scene, share: float) -> dict[str, Any]:
    """A ball with a ragged edge that grows with `share`, and soot above it."""
    nx, ny, nz = found.domain.cells
    size = found.domain.size
    k, j, i = np.indices((nz, ny, nx))
    x, y, z = (((index + 0.5) / n * edge - middle) for index, n, edge, middle in
               zip((i, j, k), (nx, ny, nz), size, found.detonation.position, strict=True))
    random = np.random.default_rng(3)
    rough = sum(amplitude * _normal(gaussian_filter(random.normal(size=(nz, ny, nx)), nx * scale))
                for amplitude, scale in ((1.0, 0.09), (0.5, 0.04), (0.3, 0.02)))
    radius = 0.03 + 0.27 * share ** 0.6
    depth = (radius - np.sqrt(x * x + y * y + z * z)) / radius + 0.22 * rough
    hot = np.clip(depth, 0, 1) ** 0.8
    ambient = found.fluid.ambient_temperature
    soot = random.normal(size=(3000, 3)) * radius * 0.6 + np.array(found.detonation.position)
    soot[:, 1] += radius * 1.2
    soot = soot[((soot > 0) & (soot < size)).all(axis=1)] if share > 0 else soot[:0]
    temperature = ambient + 60 * (1 - 0.4 * share) * hot
    burning = np.argwhere(hot > 0.3)[:, ::-1]
    burning = burning[random.integers(0, len(burning), 500)] if len(burning) else burning
    fuel = (burning + random.random(burning.shape)) / (nx, ny, nz) * size
    heat = temperature[burning[:, 2], burning[:, 1], burning[:, 0]]
    return {"fields/T": temperature, "particles/soot/position": soot,
            "particles/soot/mass": np.full(len(soot), 0.36 * 0.02),
            "particles/soot/temperature": np.full(len(soot), 2.0 * ambient),
            "particles/fuel/position": fuel, "particles/fuel/mass": np.full(len(fuel), 0.3),
            "particles/fuel/temperature": heat}


def _normal(values: Any) -> Any:
    return values / values.std()


def still(look: dict[str, Any], **rest: Any) -> Any:
    """(height, width, 3) light of a scene without a run: [render] and other sections as given."""
    found = scene.build({"time": {"end": 1.0, "frame": 1.0}, "render": look, **rest})
    assert found.render is not None
    nothing = files.Snapshot(0, 0.0, 0, {}, {}, {})
    return Film(found, found.render, None, None).frame(nothing).light
