"""What does the generated animal look like?

A calf-sized quadruped made of rounded cones (a segment with a radius at each end), melted into one
another by the polynomial smooth minimum (Quilez): min(a, b) - h^2 k / 4 with
h = max(k - |a - b|, 0) / k. It faces +x and stands on y = 0; z is its left and right, and it is
about 2 units long. No mesh file, and so no licence, is needed for scenes and tests.
"""

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints
from partition.isosurface import surface_net

Floats = NDArray[np.float64]
Point = tuple[float, float, float]
Cone = tuple[Point, Point, float, float]

TRUNK: tuple[Cone, ...] = (
    ((-0.62, 0.93, 0.0), (0.40, 0.90, 0.0), 0.31, 0.31),
    ((-0.10, 0.80, 0.0), (0.20, 0.80, 0.0), 0.30, 0.30),
    ((-0.66, 1.05, 0.0), (-0.60, 0.98, 0.0), 0.20, 0.26),
    ((0.42, 1.02, 0.0), (0.45, 0.85, 0.0), 0.24, 0.24),
)
NECK: tuple[Cone, ...] = (
    ((0.52, 1.02, 0.0), (0.84, 1.26, 0.0), 0.21, 0.135),
)
HEAD: tuple[Cone, ...] = (
    ((0.90, 1.33, 0.0), (1.02, 1.28, 0.0), 0.155, 0.14),
    ((1.02, 1.27, 0.0), (1.24, 1.12, 0.0), 0.125, 0.095),
    ((1.24, 1.13, 0.035), (1.24, 1.13, -0.035), 0.09, 0.09),
)
# given for the left side (z > 0) and mirrored
PAIRED: tuple[tuple[float, tuple[Cone, ...]], ...] = (
    (0.05, (((0.88, 1.40, 0.11), (0.84, 1.41, 0.27), 0.050, 0.062),      # ear
            ((0.84, 1.41, 0.27), (0.84, 1.38, 0.33), 0.062, 0.040))),
    (0.03, (((0.93, 1.45, 0.08), (0.95, 1.54, 0.15), 0.052, 0.046),      # horn
            ((0.95, 1.54, 0.15), (1.00, 1.62, 0.17), 0.046, 0.032))),
    (0.12, (((0.40, 0.78, 0.16), (0.42, 0.42, 0.18), 0.150, 0.080),      # foreleg
            ((0.42, 0.42, 0.18), (0.40, 0.10, 0.18), 0.078, 0.060),
            ((0.40, 0.07, 0.18), (0.44, 0.06, 0.18), 0.072, 0.060))),
    (0.14, (((-0.60, 0.84, 0.15), (-0.52, 0.58, 0.19), 0.220, 0.120),    # hind leg
            ((-0.52, 0.58, 0.19), (-0.68, 0.38, 0.19), 0.105, 0.075),
            ((-0.68, 0.38, 0.19), (-0.62, 0.10, 0.19), 0.072, 0.060),
            ((-0.62, 0.07, 0.19), (-0.58, 0.06, 0.19), 0.072, 0.060))),
)
TAIL: tuple[Cone, ...] = (
    ((-0.86, 1.12, 0.0), (-0.97, 0.90, 0.0), 0.055, 0.048),
    ((-0.97, 0.90, 0.0), (-0.98, 0.62, 0.0), 0.048, 0.045),
    ((-0.98, 0.62, 0.0), (-0.97, 0.47, 0.0), 0.065, 0.045),
)
UDDER: tuple[Cone, ...] = (
    ((-0.34, 0.60, 0.0), (-0.28, 0.58, 0.0), 0.13, 0.12),
)
SPACING = 0.045


def animal(spacing: float = SPACING) -> tuple[Floats, Ints]:
    """Vertices and faces of the mesh; about 9000 triangles, 18 / spacing^2, at the default, at
    which it is known to be closed."""
    return surface_net(distance, np.array([-1.2, -0.1, -0.5]), np.array([1.5, 1.8, 0.5]), spacing)


def distance(points: Floats) -> Floats:
    """(n,) signed distance, roughly, of points (n, 3) from the animal's skin; negative inside."""
    mirrored = points * (1, 1, 0) + np.abs(points) * (0, 0, 1)
    skin = _melted(points, TRUNK, 0.20)
    skin = smooth_minimum(skin, _melted(points, UDDER, 0.05), 0.08)
    skin = smooth_minimum(skin, _melted(points, NECK, 0.05), 0.22)
    skin = smooth_minimum(skin, _melted(points, HEAD, 0.07), 0.06)
    skin = smooth_minimum(skin, _melted(points, TAIL, 0.03), 0.07)
    for blend, cones in PAIRED:
        skin = smooth_minimum(skin, _melted(mirrored, cones, 0.05), blend)
    return skin


def smooth_minimum(a: Floats, b: Floats, k: float) -> Floats:
    """The minimum of a and b, rounded where they differ by less than k."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def rounded_cone(points: Floats, a: Point, b: Point, ra: float, rb: float) -> Floats:
    """Distance from a segment a-b less a radius that goes linearly from ra to rb."""
    start, axis = np.array(a), np.subtract(b, a)
    along = np.clip((points - start) @ axis / (axis @ axis), 0, 1)
    nearest = start + along[:, None] * axis
    return np.linalg.norm(points - nearest, axis=1) - (ra + along * (rb - ra))


def _melted(points: Floats, cones: tuple[Cone, ...], k: float) -> Floats:
    skin = rounded_cone(points, *cones[0])
    for cone in cones[1:]:
        skin = smooth_minimum(skin, rounded_cone(points, *cone), k)
    return skin
