"""What do the generated bear, pumpkin and statue look like, and where should they break?

Each is the surface f = 0 of a function made of spheres and cones that melt into one another, so no
mesh file is needed. Each has one place where it is weakest, known before any eigenvector: a plane
through which the shortest ring of the surface runs that leaves a fair part on both sides.

bear     balls; its neck lies in the plane in which the balls of head and trunk meet
pumpkin  a flattened ball with grooves, of which two opposite ones are deep; a stem; the plane x = 0
         goes through the deep grooves and the stem
statue   a figure without arms, narrowest at the waist
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from partition.animal import NECK, animal, rounded_cone, smooth_minimum
from partition.graph import Ints
from partition.isosurface import surface_net

Floats = NDArray[np.float64]
Point = tuple[float, float, float]

# centre (x, y, |z|) and radius; given for z >= 0, both sides are made
TRUNK = ((0.0, 0.0, 0.0), 0.50)
HEAD = ((0.0, 0.72, 0.0), 0.36)
LIMBS: tuple[tuple[Point, float], ...] = (
    ((0.10, 1.03, 0.26), 0.12),                                             # ear
    ((0.20, 0.30, 0.44), 0.15), ((0.38, 0.20, 0.56), 0.13),                 # arm
    ((0.28, -0.42, 0.28), 0.19), ((0.48, -0.46, 0.34), 0.16),               # leg
)
SNOUT = ((0.32, 0.66, 0.0), 0.13)
GROOVES = 10            # of the pumpkin, the two deep ones included
WAIST = 0.06            # height of the statue's narrowest ring
# height and half widths in x and z of the statue's rings
RINGS = np.array([
    (-0.95, 0.26, 0.28), (-0.88, 0.16, 0.18), (-0.55, 0.17, 0.21), (-0.25, 0.24, 0.30),
    (WAIST, 0.13, 0.16), (0.34, 0.23, 0.27), (0.52, 0.19, 0.32), (0.62, 0.11, 0.12),
    (0.66, 0.10, 0.10), (0.80, 0.14, 0.12), (0.90, 0.10, 0.09), (0.95, 0.04, 0.04)])


@dataclass(frozen=True)
class Plane:
    """Where a body should break in two."""

    point: Point
    normal: Point

    def beyond(self, points: Floats) -> NDArray[np.bool_]:
        """(n,) which points (n, 3) lie on the side of the normal."""
        side: NDArray[np.bool_] = (points - self.point) @ self.normal > 0
        return side


def bear(spacing: float = 0.045) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and faces (f, 3); about 2 units tall, facing +x."""
    return surface_net(_bear, np.array([-0.7, -0.85, -0.9]), np.array([0.85, 1.35, 0.9]), spacing)


def pumpkin(spacing: float = 0.045) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and faces (f, 3); the stem points along +y."""
    return surface_net(_pumpkin, np.array([-1.0, -0.8, -1.0]), np.array([1.0, 1.1, 1.0]), spacing)


def statue(spacing: float = 0.035) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and faces (f, 3); about 2 units tall."""
    return surface_net(_statue, np.array([-0.5, -1.2, -0.6]), np.array([0.5, 1.3, 0.6]), spacing)


GENERATED: dict[str, Callable[[], tuple[Floats, Ints]]] = {
    "animal": animal, "bear": bear, "pumpkin": pumpkin, "statue": statue}


def _neck() -> Plane:
    """Of the animal: across its neck, before the head."""
    start, end, _, _ = NECK[0]
    return Plane(end, (end[0] - start[0], end[1] - start[1], end[2] - start[2]))


def _between(a: tuple[Point, float], b: tuple[Point, float]) -> Plane:
    """The plane of the circle in which two balls meet."""
    start, end = np.array(a[0]), np.array(b[0])
    far = float(np.linalg.norm(end - start))
    along = (far**2 + a[1]**2 - b[1]**2) / (2 * far)
    x, y, z = start + (end - start) * (along / far)
    u, v, w = end - start
    return Plane((x, y, z), (u, v, w))


WEAKEST = {"animal": _neck(), "bear": _between(TRUNK, HEAD),
           "pumpkin": Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
           "statue": Plane((0.0, WAIST, 0.0), (0.0, 1.0, 0.0))}


def _ball(points: Floats, ball: tuple[Point, float]) -> Floats:
    far: Floats = np.linalg.norm(points - np.array(ball[0]), axis=1) - ball[1]
    return far


def _bear(points: Floats) -> Floats:
    mirrored = points * (1, 1, 0) + np.abs(points) * (0, 0, 1)
    skin = smooth_minimum(_ball(points, TRUNK), _ball(points, HEAD), 0.06)
    skin = smooth_minimum(skin, _ball(points, SNOUT), 0.06)
    for limb in LIMBS:
        skin = smooth_minimum(skin, _ball(mirrored, limb), 0.08)
    return skin


def _pumpkin(points: Floats) -> Floats:
    x, y, z = points.T
    around = np.arctan2(z, x)
    shallow = np.abs(np.cos(GROOVES / 2 * (around - np.pi / 2)))
    deep = np.exp(-(np.cos(around) / 0.16)**2)
    out = np.hypot(x, z)
    radius = 0.85 * (1 - 0.10 * shallow**6 - 0.22 * deep)
    body = np.sqrt((out / radius)**2 + (y / 0.62)**2) - 1
    stem = rounded_cone(points, (0.0, 0.45, 0.0), (0.05, 0.88, 0.0), 0.13, 0.10)
    return smooth_minimum(0.6 * body, stem, 0.06)


def _statue(points: Floats) -> Floats:
    x, y, z = points.T
    level = np.clip(y, RINGS[0, 0], RINGS[-1, 0])
    across, along = PchipInterpolator(RINGS[:, 0], RINGS[:, 1:])(level).T
    beyond = np.maximum(np.maximum(RINGS[0, 0] - y, y - RINGS[-1, 0]), 0)
    inside = (np.sqrt((x / across)**2 + (z / along)**2 + (beyond / 0.06)**2) - 1)
    return inside * np.minimum(across, along)
