"""Where on a surface is a point? Texture coordinates u, v and the tangent along which u grows.

    sphere  v = acos(y / r) / pi from the north pole, u = atan2(-z, x) / 2 pi modulo 1
    box     the whole picture on every face: u along x (z on the sides), v downwards (z on lids)
    plane   u along the tangent, one unit per L
    mesh    barycentric from the corners: the file's (wrapping.py), or where it has none those of
            the bounding box at rest
"""

import numpy as np

from render.kernel import kernel
from render.primitives import BOX, SPHERE, Primitives
from render.triangles import Triangles
from render.vector import Three, along, cross, dot, unit


@kernel
def coordinates(triangles: Triangles, primitives: Primitives, surface: int, a: float, b: float,
                p: Three, n: Three) -> tuple[float, float]:
    """(u, v) at a surface's point p with outward normal n; a, b barycentric in a triangle."""
    first = triangles.material.size
    if surface < first:
        c = 1.0 - a - b
        uv = triangles.uv
        return (c * uv[surface, 0, 0] + a * uv[surface, 1, 0] + b * uv[surface, 2, 0],
                c * uv[surface, 0, 1] + a * uv[surface, 1, 1] + b * uv[surface, 2, 1])
    k, data = surface - first, primitives.data
    if primitives.kind[k] == SPHERE:
        return (np.arctan2(-n[2], n[0]) / (2.0 * np.pi)) % 1.0, np.arccos(
            min(1.0, max(-1.0, n[1]))) / np.pi
    if primitives.kind[k] == BOX:
        x, y, z = ((p[0] - data[k, 0]) / (data[k, 3] - data[k, 0]),
                   (p[1] - data[k, 1]) / (data[k, 4] - data[k, 1]),
                   (p[2] - data[k, 2]) / (data[k, 5] - data[k, 2]))
        if n[1] != 0.0:
            return x, z if n[1] > 0.0 else 1.0 - z
        if n[2] != 0.0:
            return x if n[2] > 0.0 else 1.0 - x, 1.0 - y
        return 1.0 - z if n[0] > 0.0 else z, 1.0 - y
    u = tangent(triangles, primitives, surface, n)
    o = along(p, -1.0, (data[k, 0], data[k, 1], data[k, 2]))
    return dot(o, u), dot(o, cross(n, u))


@kernel
def tangent(triangles: Triangles, primitives: Primitives, surface: int, n: Three) -> Three:
    """A unit vector in the surface along which u grows; any, where u stands still."""
    first = triangles.material.size
    t = (0.0, 0.0, 0.0)
    if surface < first:
        uv, corner = triangles.uv, triangles.corner
        v1, v2 = (uv[surface, 1, 1] - uv[surface, 0, 1], uv[surface, 2, 1] - uv[surface, 0, 1])
        u1, u2 = (uv[surface, 1, 0] - uv[surface, 0, 0], uv[surface, 2, 0] - uv[surface, 0, 0])
        twice = u1 * v2 - v1 * u2
        if abs(twice) > 1e-14:
            t = ((v2 * (corner[surface, 1, 0] - corner[surface, 0, 0])
                  - v1 * (corner[surface, 2, 0] - corner[surface, 0, 0])) / twice,
                 (v2 * (corner[surface, 1, 1] - corner[surface, 0, 1])
                  - v1 * (corner[surface, 2, 1] - corner[surface, 0, 1])) / twice,
                 (v2 * (corner[surface, 1, 2] - corner[surface, 0, 2])
                  - v1 * (corner[surface, 2, 2] - corner[surface, 0, 2])) / twice)
    elif primitives.kind[surface - first] == SPHERE:
        t = (n[2], 0.0, -n[0])
    elif primitives.kind[surface - first] == BOX and n[1] == 0.0:
        t = (n[2], 0.0, -n[0])
    return against(t, n)


@kernel
def against(t: Three, n: Three) -> Three:
    """The part of t at right angles to n, of length 1; x or y instead where there is none."""
    t = along(t, -dot(t, n), n)
    if dot(t, t) < 1e-20:
        t = (1.0, 0.0, 0.0) if abs(n[0]) < 0.9 else (0.0, 1.0, 0.0)
        t = along(t, -dot(t, n), n)
    return unit(t)


@kernel
def point_at_rest(triangles: Triangles, surface: int, a: float, b: float) -> Three:
    """The point at rest of barycentric coordinates a, b in a triangle."""
    c, rest = 1.0 - a - b, triangles.rest
    return (c * rest[surface, 0, 0] + a * rest[surface, 1, 0] + b * rest[surface, 2, 0],
            c * rest[surface, 0, 1] + a * rest[surface, 1, 1] + b * rest[surface, 2, 1],
            c * rest[surface, 0, 2] + a * rest[surface, 1, 2] + b * rest[surface, 2, 2])
