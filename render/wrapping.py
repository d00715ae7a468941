"""Which texture coordinates did the mesh file of a body give to its surface?

A body's outer triangles are those of its file, placed: scale Rz Ry Rx (X - middle) + place, with
the middle of the bounding box. Each takes u and v of the file's triangle with the same centroid.
Triangles that cutting has made or changed find none and keep the coordinates they have.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from render.meshes import file_triangles
from solver.files import FileError
from solver.scene_body import Body

Array = NDArray[np.float64]
SAME = 1e-5     # share of the size that rounding may move a centroid


def wrapped(body: Body, folder: Path, corner: Array, uv: Array) -> Array:
    """(n, 3, 2) coordinates of a body's triangles (n, 3, 3) at rest: the file's, or `uv`."""
    path = folder / body.mesh
    if not path.is_file():      # a generated mesh; or the run has gone elsewhere without its mesh
        return uv
    try:
        shape, given = file_triangles(path)
    except FileError:           # a format that only the partition reads
        return uv
    if given is None:
        return uv
    middle = (shape.min(axis=(0, 1)) + shape.max(axis=(0, 1))) / 2
    turn = Rotation.from_euler("xyz", body.rotate, degrees=True).as_matrix()
    placed = body.scale * (shape - middle) @ turn.T + np.array(body.place)
    away, source = cKDTree(placed.mean(axis=1)).query(corner.mean(axis=1))
    known = away < SAME * np.ptp(placed, axis=(0, 1)).max()
    gaps = np.linalg.norm(corner[known][:, :, None] - placed[source[known]][:, None], axis=3)
    nearest = gaps.argmin(axis=2)
    result = uv.copy()
    result[known] = np.take_along_axis(given[source[known]], nearest[:, :, None], axis=1)
    return result
