"""What is a triangle to the renderer? Corners, normals, texture coordinates, material and piece."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Triangles(NamedTuple):
    """n triangles.

    corner      (n, 3, 3) positions, L
    normal      (n, 3) unit geometric normals, outward
    smooth      (n, 3, 3) unit shading normals at the corners
    rest        (n, 3, 3) the corners at rest, where textures are fixed
    uv          (n, 3, 2) texture coordinates of the corners
    glow        (n, 3) light of its own, beside its material's
    material    (n,)
    piece       (n,) the piece it belongs to, -1 for objects that are only rendered
    """

    corner: Array
    normal: Array
    smooth: Array
    rest: Array
    uv: Array
    glow: Array
    material: Integers
    piece: Integers


def no_triangles() -> Triangles:
    """A scene without meshes."""
    return Triangles(np.empty((0, 3, 3)), np.empty((0, 3)), np.empty((0, 3, 3)),
                     np.empty((0, 3, 3)), np.empty((0, 3, 2)), np.empty((0, 3)),
                     np.empty(0, np.int64), np.empty(0, np.int64))


def joined(parts: list[Triangles]) -> Triangles:
    """All triangles of several lots."""
    return Triangles(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def normals(corner: Array) -> Array:
    """(n, 3) unit normals of triangles (n, 3, 3); zero for degenerate ones."""
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)


def smooth_normals(corner: Array, piece: Integers, crease: Array) -> Array:
    """(n, 3, 3) normals at the corners of triangles (n, 3, 3).

    The area-weighted mean over the faces of the same piece that meet there within the crease angle
    (n,), in degrees, of the face itself.
    """
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = normals(corner)
    result = np.repeat(normal[:, None], 3, axis=1)
    if not np.any(crease > 0):
        return result
    # Corners of one piece at one place share a number
    size = np.ptp(corner, axis=(0, 1)).max() or 1.0
    place = np.round(corner.reshape(-1, 3) / (size * 1e-7)).astype(np.int64)
    keys = np.column_stack([place, np.repeat(piece, 3)])
    _, point = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(point, kind="stable")
    starts = np.searchsorted(point[order], np.arange(point.max() + 2))
    lowest = np.cos(np.radians(crease))
    for count in np.unique(np.diff(starts)):
        groups = order[starts[:-1][np.diff(starts) == count][:, None] + np.arange(count)]
        face = groups // 3
        near = np.einsum("pad,pbd->pab", normal[face], normal[face]) >= lowest[face][..., None]
        total = np.einsum("pab,pbd->pad", near, cross[face])
        length = np.linalg.norm(total, axis=2, keepdims=True)
        mean = np.divide(total, length, out=normal[face], where=length > 0)
        result[face, groups % 3] = mean
    return result


def box_coordinates(corner: Array, body: Integers) -> Array:
    """(n, 3, 2) u and v of each body's bounding box, on the axis that a triangle faces most."""
    result = np.zeros((len(corner), 3, 2))
    axis = np.abs(normals(corner)).argmax(axis=1)
    for one in np.unique(body):
        low = corner[body == one].min(axis=(0, 1))
        span = np.maximum(corner[body == one].max(axis=(0, 1)) - low, 1e-12)
        for facing, (u, v) in enumerate(((2, 1), (0, 2), (0, 1))):
            chosen = (body == one) & (axis == facing)
            share = (corner[chosen] - low) / span
            result[chosen] = np.stack([share[..., u], 1 - share[..., v]], axis=-1)
    return result
