"""How bright is smoke? Single scattering of the lamps, the fire and the sky, on a coarse grid.

Smoke and hot gas send on a share (their albedo) of the light that reaches them:
    lit(x) = I_a + sum over lamps E / 4 * exp(-tau(x, lamp)) + sum over the fire's parts E / 4 / d²
E / 4: a white wall that faces the lamp shines with E; scattered into all directions alike, the same
light shines with pi E / (4 pi). tau is the absorption integrated towards the lamp over a grid of at
most 38 cells a side, so that the side of a cloud turned away from the sun is darker: that is what
gives it shape. The same grid shades surfaces from the lamps.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.bricks import B, Bricks, Number, density_channel
from render.kernel import kernel
from render.lights import DIRECTIONAL, Lights
from render.primitives import slabs
from render.rays import Rays
from render.vector import Three, along, dot, load

Array = NDArray[np.float64]
Single = NDArray[np.float32]
ONE = np.float32(1.0)
FINEST = 32     # cells a side that the coarse grid has at least, if the volume has them
LARGEST = 8     # cells of the volume a side that count as one at most


class Haze(NamedTuple):
    """The volume on a coarse grid that covers the box with cells of `edge` (3,), L.

    dense   (gz, gy, gx) absorption, 1/L
    glow    (gz, gy, gx, 3) light that fire gives off per length, 1/L
    lit     (gz, gy, gx, 3) light that smoke would send on if it were white
    """

    dense: Single
    glow: Single
    lit: Single
    edge: Array


def coarse(bricks: Bricks, cells: NDArray[np.int64], size: Array, table: Array,
           smoke: float) -> Haze:
    """The coarse grid of a frame, not lit yet; `smoke` is the absorption of soot."""
    group = 1
    while group < LARGEST and cells.max() > FINEST * group:
        group *= 2
    shape = [-(-int(n) // group) for n in cells[::-1]]
    dense, glow = np.zeros(shape, np.float32), np.zeros((*shape, 3), np.float32)
    _gather(bricks, table, smoke, group, cells, dense, glow)
    return Haze(dense, glow, np.zeros_like(glow), size / cells * group)


def light_up(haze: Haze, lamps: Lights, fire: Lights, ambient: Array) -> None:
    """Fill `lit` with the light of lamps, of the fire's own lights and of the sky."""
    _light(haze.dense, haze.edge, lamps, fire, ambient, haze.lit)


@kernel
def _gather(bricks: Bricks, table: Array, smoke: float, group: int, cells: NDArray[np.int64],
            dense: Single, glow: Single) -> None:
    """Means over group³ cells, from the values the bricks own; cell i is rim index i + 1."""
    nz, ny, nx = bricks.place.shape
    share = 1.0 / group ** 3
    for bz in range(nz):
        for by in range(ny):
            for bx in range(nx):
                m = bricks.place[bz, by, bx]
                if m < 0:
                    continue
                end = min(bx * B + B, cells[0] + 1)
                for k in range(max(bz * B, 1), min(bz * B + B, cells[2] + 1)):
                    for j in range(max(by * B, 1), min(by * B + B, cells[1] + 1)):
                        row = ((m * (B + 1) + k - bz * B) * (B + 1) + j - by * B) * (B + 1)
                        z, y, i = (k - 1) // group, (j - 1) // group, max(bx * B, 1)
                        while i < end:      # what lies in one coarse cell together
                            x = (i - 1) // group
                            stop = min(end, (x + 1) * group + 1)
                            fog, light = _summed(bricks, row + i - bx * B, stop - i, table, smoke)
                            dense[z, y, x] += share * fog
                            glow[z, y, x, 0] += share * light[0]
                            glow[z, y, x, 1] += share * light[1]
                            glow[z, y, x, 2] += share * light[2]
                            i = stop


@kernel
def _summed(bricks: Bricks, first: int, count: int, table: Array,
            smoke: float) -> tuple[float, Three]:
    """Absorption and glow of `count` values in a row, added up."""
    values, last, fog = bricks.values, table.shape[0] - 1, 0.0
    second, third = density_channel(bricks.channels, bricks.soot), bricks.soot
    red = green = blue = 0.0
    for value in range(first, first + count):
        at: Number = np.uint64(value * bricks.channels)
        density = values[at + np.uint64(second)] if second > 0 else ONE
        if third > 0:
            fog += smoke * values[at + np.uint64(third)]
        if density > 0.0:
            entry: Number = np.uint64(min(int(values[at] / density * last), last))
            fire = density * table[entry, 3]
            fog += fire
            red += fire * table[entry, 0]
            green += fire * table[entry, 1]
            blue += fire * table[entry, 2]
    return fog, (red, green, blue)


@kernel
def _light(dense: Single, edge: Array, lamps: Lights, fire: Lights, ambient: Array,
           lit: Single) -> None:
    gz, gy, gx = dense.shape
    for k in range(gz):
        for j in range(gy):
            for i in range(gx):
                p = ((i + 0.5) * edge[0], (j + 0.5) * edge[1], (k + 0.5) * edge[2])
                light = (ambient[0], ambient[1], ambient[2])
                for lamp in range(lamps.kind.size):
                    d, strength, reach = load(lamps.place, lamp), 0.25, np.inf
                    if lamps.kind[lamp] != DIRECTIONAL:
                        d = along(d, -1.0, p)
                        reach = max(np.sqrt(dot(d, d)), 1e-9)
                        d = (d[0] / reach, d[1] / reach, d[2] / reach)
                        for _ in range(lamps.falloff[lamp]):
                            strength /= reach
                    strength *= clearness(dense, edge, p, d, reach)
                    light = along(light, strength, load(lamps.colour, lamp))
                for lamp in range(fire.kind.size):
                    d = along(load(fire.place, lamp), -1.0, p)
                    light = along(light, 0.25 / (dot(d, d) + fire.spread[lamp]),
                                  load(fire.colour, lamp))
                lit[k, j, i, 0], lit[k, j, i, 1], lit[k, j, i, 2] = light


@kernel
def escaping(dense: Single, edge: Array, place: Array, share: Array) -> None:
    """The share (n,) of light that gets out of the haze from n places: the mean over six ways."""
    for n in range(len(place)):
        share[n] = 0.0
        for axis in range(3):
            for sign in (-1.0, 1.0):
                d = (sign if axis == 0 else 0.0, sign if axis == 1 else 0.0,
                     sign if axis == 2 else 0.0)
                share[n] += clearness(dense, edge, load(place, n), d, np.inf) / 6.0


@kernel
def clearness(dense: Single, edge: Array, o: Three, d: Three, reach: float) -> float:
    """exp(-absorption) of the way from o over `reach` in direction d, in steps of a coarse cell."""
    gz, gy, gx = dense.shape
    enter, leave = slabs((0.0, 0.0, 0.0), (gx * edge[0], gy * edge[1], gz * edge[2]), o, d)
    enter, leave = max(enter, 0.0), min(leave, reach)
    if enter >= leave:
        return 1.0
    step = min(edge[0], min(edge[1], edge[2]))
    steps = int(np.ceil((leave - enter) / step))
    step, total = (leave - enter) / steps, 0.0
    # in coarse cells: the middle of step s is at p + s q
    fx, fy, fz = 1.0 / edge[0], 1.0 / edge[1], 1.0 / edge[2]
    p = along(o, enter + 0.5 * step, d)
    px, py, pz = p[0] * fx, p[1] * fy, p[2] * fz
    qx, qy, qz = step * d[0] * fx, step * d[1] * fy, step * d[2] * fz
    for s in range(steps):
        i, j, k = int(px + s * qx), int(py + s * qy), int(pz + s * qz)
        total += dense[np.uint64(min(max(k, 0), gz - 1)), np.uint64(min(max(j, 0), gy - 1)),
                       np.uint64(min(max(i, 0), gx - 1))]
    return np.exp(-total * step)


@kernel
def shade(haze: Haze, shadow: Rays, reach: Array, lamps: int) -> None:
    """Weaken the shadow rays to the first `lamps` lamps; a ray's seed is the lamp's number."""
    for ray in range(shadow.pixel.size):
        if shadow.seed[ray] < lamps:
            passed = clearness(haze.dense, haze.edge, load(shadow.origin, ray),
                               load(shadow.direction, ray), reach[ray])
            for c in range(3):
                shadow.weight[ray, c] *= passed


@kernel
def lit_at(lit: Single, x: float, y: float, z: float) -> Three:
    """Trilinear light at (x, y, z) in coarse cells from the middle of the first."""
    gz, gy, gx, _ = lit.shape
    x, y, z = min(max(x, 0.0), gx - 1.0), min(max(y, 0.0), gy - 1.0), min(max(z, 0.0), gz - 1.0)
    i, j, k = int(x), int(y), int(z)
    x, y, z = x - i, y - j, z - k
    i0: Number = np.uint64(i)
    i1: Number = np.uint64(min(i + 1, gx - 1))
    red = green = blue = 0.0
    for b in range(2):
        for a in range(2):
            m: Number = np.uint64(min(k + b, gz - 1))
            n: Number = np.uint64(min(j + a, gy - 1))
            share = (z if b else 1.0 - z) * (y if a else 1.0 - y)
            p, q = share * (1.0 - x), share * x
            red += p * lit[m, n, i0, 0] + q * lit[m, n, i1, 0]
            green += p * lit[m, n, i0, 1] + q * lit[m, n, i1, 1]
            blue += p * lit[m, n, i0, 2] + q * lit[m, n, i1, 2]
    return red, green, blue
