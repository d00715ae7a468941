"""A run as OpenVDB: one file per frame with a sparse grid per field of the cells.

Values are those of the field minus its background (T: its lowest value over the chosen frames),
so that still, cold air takes no space; the background is kept in the metadata `offset`. Voxel
(i, j, k) has its centre at origin + (i, j, k) * spacing, in the coordinates of the box.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solver.files import Field, read_snapshot

FACES = "uvw"
TOLERANCE = 1e-6   # of a field's range: voxels so near to the background are left out
NAMES = {"T": "temperature"}   # what shaders look for


def write(run: Path, output: Path, frames: Sequence[int]) -> list[Path]:
    """Write fields_NNNNNN.vdb; returns the files."""
    import pyopenvdb as openvdb

    lows: dict[str, float] = {}
    for frame in frames:
        for name, field in read_snapshot(run, frame).fields.items():
            lows[name] = min(lows.get(name, np.inf), float(field.values.min()))
    made = []
    for frame in frames:
        snapshot = read_snapshot(run, frame)
        grids = [grid(openvdb, name, field, lows[name] if name == "T" else 0.0)
                 for name, field in snapshot.fields.items() if name not in FACES]
        made.append(output / f"fields_{frame:06d}.vdb")
        openvdb.write(str(made[-1]), grids=grids, metadata={"time": snapshot.time, "frame": frame})
    return made


def grid(openvdb: Any, name: str, field: Field, background: float) -> Any:
    """One field as a grid."""
    values = np.ascontiguousarray(field.values.transpose(2, 1, 0) - background, np.float32)
    result = openvdb.FloatGrid()
    result.name = NAMES.get(name, name)
    result.gridClass = openvdb.GridClass.FOG_VOLUME
    result["offset"] = background
    span = float(np.ptp(values))
    result.copyFromArray(values, tolerance=TOLERANCE * span)
    matrix = np.diag([*field.spacing, 1.0])
    matrix[3, :3] = field.origin
    result.transform = openvdb.createLinearTransform(matrix.tolist())
    return result
