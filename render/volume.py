"""How do fire and smoke look along a ray? Emission and absorption, front to back.

The values of a volume (bricks.py) are heat (temperature as a share of the shown range), soot, and
perhaps the density of the fire. The absorption is s = s_fire(heat) density + s_smoke soot, and the
source colour I = (s_fire / s) density I_fire(heat) + albedo lit(x): hot gas glows, and all of it
scatters the light of its surroundings (smoke.py). A step dz of a ray does
    a = 1 - exp(-s dz),    C += (1 - A) a I,    A += (1 - A) a          (the thesis' A.3 and A.4)
until A > 0.999; what lies behind counts (1 - A). The steps divide the way through the box exactly
and end at the first surface; values are trilinear between cell centres, and turned to colour after
interpolation. Every ray shifts its sample points within the steps by one random number, which
turns bands into fine grain. Bricks in which nothing can be seen are skipped, at no loss.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.bricks import B, Bricks, sample
from render.hashing import uniform
from render.kernel import kernel
from render.primitives import slabs
from render.rays import Hits, Rays
from render.smoke import Haze, lit_at
from render.vector import Three, along, load

OPAQUE = 0.999
ENTRIES = 1024      # of the colour table
Array = NDArray[np.float64]


class Volume(NamedTuple):
    """A frame's fire and smoke.

    bricks      the values
    cells       (3,) nx, ny, nz
    size        (3,) edges of the box, L
    table       (ENTRIES, 4) by heat: emitted linear RGB, absorption per density in 1/L
    smoke       (4,) RGB of the albedo, absorption per soot in 1/L
    step        L
    haze        coarse absorption and light
    """

    bricks: Bricks
    cells: NDArray[np.int64]
    size: Array
    table: Array
    smoke: Array
    step: float
    haze: Haze


@kernel
def march(volume: Volume, rays: Rays, hits: Hits, image: Array) -> None:
    """Add what the rays see of the volume before their hits to `image`, and weaken the rays."""
    for ray in range(rays.pixel.size):
        red, green, blue, clear = along_ray(volume, load(rays.origin, ray),
                                            load(rays.direction, ray), hits.distance[ray],
                                            uniform(rays.seed[ray], 7))
        pixel = rays.pixel[ray]
        image[pixel, 0] += rays.weight[ray, 0] * red
        image[pixel, 1] += rays.weight[ray, 1] * green
        image[pixel, 2] += rays.weight[ray, 2] * blue
        for c in range(3):
            rays.weight[ray, c] *= clear


@kernel
def along_ray(volume: Volume, o: Three, d: Three, reach: float,
              xi: float) -> tuple[float, float, float, float]:
    """(red, green, blue, transparency) of the way from o to o + reach d."""
    size = volume.size
    enter, leave = slabs((0.0, 0.0, 0.0), (size[0], size[1], size[2]), o, d)
    enter, leave = max(enter, 0.0), min(leave, reach)
    red = green = blue = 0.0
    clear = 1.0
    if enter >= leave:
        return red, green, blue, clear
    # in rim indices of the bricks, g = a + t b
    bx, by, bz = (d[0] * volume.cells[0] / size[0], d[1] * volume.cells[1] / size[1],
                  d[2] * volume.cells[2] / size[2])
    ax, ay, az = (o[0] * volume.cells[0] / size[0] + 0.5, o[1] * volume.cells[1] / size[1] + 0.5,
                  o[2] * volume.cells[2] / size[2] + 0.5)
    index, values, table = volume.bricks.place, volume.bricks.values, volume.table
    channels = volume.bricks.channels
    lit, albedo = volume.haze.lit, (volume.smoke[0], volume.smoke[1], volume.smoke[2])
    # coarse cells per cell
    cx = size[0] / (volume.haze.edge[0] * volume.cells[0])
    cy = size[1] / (volume.haze.edge[1] * volume.cells[1])
    cz = size[2] / (volume.haze.edge[2] * volume.cells[2])
    steps = int(np.ceil((leave - enter) / volume.step))
    dz = (leave - enter) / steps
    edge = volume.haze.edge
    lasting, stale = int(0.5 * min(edge[0], min(edge[1], edge[2])) / dz), -1
    light = (0.0, 0.0, 0.0)
    k = 0
    while k < steps:
        t = enter + (k + xi) * dz
        x, y, z = max(ax + t * bx, 0.0), max(ay + t * by, 0.0), max(az + t * bz, 0.0)
        i = min(int(x) // B, index.shape[2] - 1)
        j = min(int(y) // B, index.shape[1] - 1)
        m = min(int(z) // B, index.shape[0] - 1)
        brick = index[m, j, i]
        if brick < 0:
            out = min(_exit(x, bx, i), min(_exit(y, by, j), _exit(z, bz, m)))
            k += max(1, int(np.ceil(out / dz)))
            continue
        k += 1
        heat, soot, density = sample(values, channels, brick, x - i * B, y - j * B, z - m * B)
        place = min(heat, 1.0) * (ENTRIES - 1)
        e = min(int(place), ENTRIES - 2)
        f = place - e
        fire = density * ((1.0 - f) * table[e, 3] + f * table[e + 1, 3])
        total = fire + volume.smoke[3] * soot
        if total <= 0.0:
            continue
        seen = clear * absorbed(total * dz)
        glow = seen * fire / total
        if k > stale:   # the light changes over coarse cells: twice per cell is often enough
            light = lit_at(lit, (x - 0.5) * cx - 0.5, (y - 0.5) * cy - 0.5, (z - 0.5) * cz - 0.5)
            stale = k + lasting
        red += glow * ((1.0 - f) * table[e, 0] + f * table[e + 1, 0]) + seen * albedo[0] * light[0]
        green += (glow * ((1.0 - f) * table[e, 1] + f * table[e + 1, 1])
                  + seen * albedo[1] * light[1])
        blue += glow * ((1.0 - f) * table[e, 2] + f * table[e + 1, 2]) + seen * albedo[2] * light[2]
        clear -= seen
        if clear < 1.0 - OPAQUE:
            return red, green, blue, 0.0
    return red, green, blue, clear


@kernel
def absorbed(depth: float) -> float:
    """1 - exp(-depth); for the thin steps of a march by its series, to 3e-8, five times faster."""
    if depth > 0.4:
        return 1.0 - np.exp(-depth)
    x = depth
    return x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (
        1.0 - x / 6.0 * (1.0 - x / 7.0))))))


@kernel
def hottest(volume: Volume, rays: Rays, hits: Hits, heat: Array) -> None:
    """The highest heat (n,) of the steps along the rays to their hits."""
    place, values, cells = volume.bricks.place, volume.bricks.values, volume.cells
    size = (volume.size[0], volume.size[1], volume.size[2])
    for ray in range(rays.pixel.size):
        o, d = load(rays.origin, ray), load(rays.direction, ray)
        enter, leave = slabs((0.0, 0.0, 0.0), size, o, d)
        enter, leave = max(enter, 0.0), min(leave, hits.distance[ray])
        heat[ray] = 0.0
        for step in range(int(np.ceil(max(leave - enter, 0.0) / volume.step))):
            p = along(o, enter + (step + 0.5) * volume.step, d)
            x, y, z = (max(p[0] * cells[0] / size[0] + 0.5, 0.0),
                       max(p[1] * cells[1] / size[1] + 0.5, 0.0),
                       max(p[2] * cells[2] / size[2] + 0.5, 0.0))
            i, j, k = (min(int(x) // B, place.shape[2] - 1), min(int(y) // B, place.shape[1] - 1),
                       min(int(z) // B, place.shape[0] - 1))
            if place[k, j, i] >= 0:
                here, _, _ = sample(values, volume.bricks.channels, place[k, j, i], x - i * B,
                                    y - j * B, z - k * B)
                heat[ray] = max(heat[ray], here)


@kernel
def _exit(x: float, slope: float, brick: int) -> float:
    """How far along the ray, L, a coordinate leaves its brick."""
    if slope > 0.0:
        return ((brick + 1) * B - x) / slope
    return (brick * B - x) / slope if slope < 0.0 else np.inf
