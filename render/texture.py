"""What colour is a pattern at a point? Solid textures, evaluated in the coordinates at rest.

    checker  (floor x + floor y + floor z) even; the thesis compares reals, which are never equal
    brick    running bond on the plane nearest to the surface, every brick in a shade of its own
    noise    sum over octaves of Perlin noise / 2^k (Perlin 1985, with his quintic fade of 2002)
    wood     frac(g), g = 20 (1 + noise) / 2
    marble   |sin(pi (x + 2 noise))|
    image    a picture by u and v, bilinear between the middles of its pixels
"""

import numpy as np
from numpy.typing import NDArray

from render.hashing import mix
from render.kernel import kernel
from render.vector import Three

KINDS = ("checker", "brick", "noise", "wood", "marble", "image")
CHECKER, BRICK, NOISE, WOOD, MARBLE, IMAGE = range(6)
# A fixed shuffle of 0 ... 255, three times over, so that sums of two entries need no modulo
SHUFFLE = np.tile(np.random.default_rng(1985).permutation(256), 3)
# The gradients point to the twelve edges of a cube, four of them twice
SLOPES = np.array([[1, 1, 0], [-1, 1, 0], [1, -1, 0], [-1, -1, 0], [1, 0, 1], [-1, 0, 1],
                   [1, 0, -1], [-1, 0, -1], [0, 1, 1], [0, -1, 1], [0, 1, -1], [0, -1, -1],
                   [1, 1, 0], [0, -1, 1], [-1, 1, 0], [0, -1, -1]], np.float64)


@kernel
def pattern(kind: int, p: Three, n: Three) -> tuple[float, float]:
    """(share of the first colour, shade) of a pattern of unit scale at p, surface normal n."""
    if kind == CHECKER:
        odd = (np.floor(p[0] + 1e-6) + np.floor(p[1] + 1e-6) + np.floor(p[2] + 1e-6)) % 2.0
        return 1.0 - odd, 1.0
    if kind == BRICK:
        return _brick(p, n)
    if kind == NOISE:
        return min(1.0, max(0.0, 0.5 + 0.7 * fractal(p, 5))), 1.0
    if kind == WOOD:
        rings = 10.0 * (1.0 + perlin(0.5 * p[0], 0.1 * p[1], 0.5 * p[2]))
        return rings - np.floor(rings), 1.0
    return abs(np.sin(np.pi * (p[0] + 2.0 * fractal(p, 5)))), 1.0


@kernel
def _brick(p: Three, n: Three) -> tuple[float, float]:
    """Bricks 1 long and 1/3 high, mortar 0.045 wide."""
    if abs(n[1]) > max(abs(n[0]), abs(n[2])):
        s, t = p[0], p[2]
    else:
        s, t = (p[0] if abs(n[2]) >= abs(n[0]) else p[2]), p[1]
    row = np.floor(3.0 * t)
    s += 0.5 * (row % 2.0)
    column = np.floor(s)
    across, up = s - column, (3.0 * t - row) / 3.0
    key = mix(int(row) & 0xFFFFFFFF, int(column) & 0xFFFFFFFF)
    shade = 0.72 + 0.5 * key / 4294967296.0 + 0.25 * fractal((6.0 * s, 6.0 * t, 0.0), 3)
    if min(across, 1.0 - across) < 0.022 or min(up, 1.0 / 3.0 - up) < 0.022:
        return 0.0, 1.0 + 0.3 * fractal((9.0 * s, 9.0 * t, 0.0), 3)
    return 1.0, shade


@kernel
def picture(pixels: NDArray[np.float32], start: int, rows: int, columns: int, wrap: int, u: float,
            v: float) -> Three:
    """A picture at (u, v), v downwards; wrap 0 repeats it, 1 continues its edge, 2 mirrors it."""
    s, t = u * columns - 0.5, v * rows - 0.5
    i, j = np.floor(s), np.floor(t)
    x, y = s - i, t - j
    i0, i1 = _wrapped(i, columns, wrap), _wrapped(i + 1.0, columns, wrap)
    j0, j1 = _wrapped(j, rows, wrap), _wrapped(j + 1.0, rows, wrap)
    a, b = start + j0 * columns + i0, start + j0 * columns + i1
    c, d = start + j1 * columns + i0, start + j1 * columns + i1
    p, q, r, w = (1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y
    return (p * pixels[a, 0] + q * pixels[b, 0] + r * pixels[c, 0] + w * pixels[d, 0],
            p * pixels[a, 1] + q * pixels[b, 1] + r * pixels[c, 1] + w * pixels[d, 1],
            p * pixels[a, 2] + q * pixels[b, 2] + r * pixels[c, 2] + w * pixels[d, 2])


@kernel
def _wrapped(i: float, n: int, wrap: int) -> int:
    if wrap == 1:
        return int(min(max(i, 0.0), n - 1.0))
    if wrap == 2:
        i = i % (2.0 * n)
        return int(min(i, 2.0 * n - 1.0 - i))
    return int(i % n)


@kernel
def fractal(p: Three, octaves: int) -> float:
    """Sum of `octaves` Perlin noises, each of twice the frequency and half the height."""
    total, height, scale = 0.0, 1.0, 1.0
    for _ in range(octaves):
        total += height * perlin(scale * p[0], scale * p[1], scale * p[2])
        height, scale = 0.5 * height, 2.0 * scale
    return total


@kernel
def perlin(x: float, y: float, z: float) -> float:
    """Gradient noise in about [-1, 1], zero at integer points, with continuous curvature."""
    i, j, k = np.floor(x), np.floor(y), np.floor(z)
    x, y, z = x - i, y - j, z - k
    u, v, w = _fade(x), _fade(y), _fade(z)
    total = 0.0
    i0, j0, k0 = int(i) & 255, int(j) & 255, int(k) & 255
    for a in range(2):
        column = SHUFFLE[i0 + a] + j0
        for b in range(2):
            cell = SHUFFLE[column + b] + k0
            near = _slope(SHUFFLE[cell], x - a, y - b, z)
            far = _slope(SHUFFLE[cell + 1], x - a, y - b, z - 1.0) if w > 0.0 else 0.0
            total += (u if a else 1.0 - u) * (v if b else 1.0 - v) * (near + w * (far - near))
    return total


@kernel
def _fade(t: float) -> float:
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


@kernel
def _slope(key: int, x: float, y: float, z: float) -> float:
    """The rise along one of the gradients; a table, because branches would be guessed wrong."""
    h = key & 15
    return x * SLOPES[h, 0] + y * SLOPES[h, 1] + z * SLOPES[h, 2]
