"""How do fire and smoke look along a ray? Emission and absorption, front to back.

The values of a volume (bricks.py) are heat (temperature as a share of the shown range), soot, and
perhaps the density of the fire. The absorption is s = s_fire(heat) density + s_smoke soot, and the
source colour I = (s_fire / s) density I_fire(heat) + albedo lit(x): hot gas glows, and all of it
scatters the light of its surroundings (smoke.py). A step dz of a ray does
    a = 1 - exp(-s dz),    C += (1 - A) a I,    A += (1 - A) a          (the thesis' A.3 and A.4)
until A > 0.999; what lies behind counts (1 - A). A reflected or refracted ray that carries the
share w of its sample stops at w (1 - A) < 0.001 already, and where w < 1/4 its steps are twice as
long: their error counts w. The steps divide the way through the box
exactly and end at the first surface; values are trilinear between cell centres, and turned to
colour after interpolation. Every ray shifts its sample points within the steps by one random
number, which turns bands into fine grain. Bricks in which nothing can be seen are skipped at no
loss, as many at a time as their distance to the next filled one allows.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.bricks import SHIFT, B, Bricks, Number, sample
from render.hashing import uniform
from render.kernel import kernel
from render.primitives import slabs
from render.rays import Hits, Rays
from render.smoke import Haze, lit_at
from render.vector import Three, add_to, along, largest, load, scaled, store, times

OPAQUE = 0.999
WEAK = 0.25         # share of its sample below which a ray makes longer steps
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
def march(volume: Volume, rays: Rays, hits: Hits, image: Array, sample_weight: float) -> None:
    """Add what the rays see of the volume before their hits to `image`, and weaken the rays.

    `sample_weight` is about the weight with which a ray leaves the camera.
    """
    for ray in range(rays.pixel.size):
        weight = load(rays.weight, ray)
        share = largest(weight) / sample_weight
        faint = (1.0 - OPAQUE) * min(1.0 / share, 500.0)
        red, green, blue, clear = along_ray(volume, load(rays.origin, ray),
                                            load(rays.direction, ray), hits.distance[ray],
                                            uniform(rays.seed[ray], 7), faint,
                                            1.0 if share > WEAK else 2.0)
        add_to(image, rays.pixel[ray], times(weight, (red, green, blue)))
        store(rays.weight, ray, scaled(weight, clear))


@kernel
def along_ray(volume: Volume, o: Three, d: Three, reach: float, xi: float,
              faint: float = 1.0 - OPAQUE,
              stride: float = 1.0) -> tuple[float, float, float, float]:
    """(red, green, blue, transparency) of the way from o to o + reach d.

    A transparency below `faint` ends the way and counts as 0; steps are `stride` times as long as
    the volume says.
    """
    size = volume.size
    enter, leave = slabs((0.0, 0.0, 0.0), (size[0], size[1], size[2]), o, d)
    enter, leave = max(enter, 0.0), min(leave, reach)
    red = green = blue = 0.0
    clear = 1.0
    if enter >= leave:
        return red, green, blue, clear
    steps = int(np.ceil((leave - enter) / (stride * volume.step)))
    dz = (leave - enter) / steps
    # step k samples at a + k b, in rim indices of the bricks
    fx, fy, fz = (volume.cells[0] / size[0], volume.cells[1] / size[1], volume.cells[2] / size[2])
    start = enter + xi * dz
    ax, ay, az = ((o[0] + start * d[0]) * fx + 0.5, (o[1] + start * d[1]) * fy + 0.5,
                  (o[2] + start * d[2]) * fz + 0.5)
    bx, by, bz = d[0] * fx * dz, d[1] * fy * dz, d[2] * fz * dz
    rx, ry, rz = _inverse(bx), _inverse(by), _inverse(bz)
    index, values = volume.bricks.place, volume.bricks.values
    channels, soot_channel = volume.bricks.channels, volume.bricks.soot
    nx, ny, nz = index.shape[2] - 1, index.shape[1] - 1, index.shape[0] - 1
    table, lit, edge = volume.table, volume.haze.lit, volume.haze.edge
    albedo, soot_absorption = (volume.smoke[0], volume.smoke[1], volume.smoke[2]), volume.smoke[3]
    cx, cy, cz = 1.0 / (edge[0] * fx), 1.0 / (edge[1] * fy), 1.0 / (edge[2] * fz)
    lasting, stale = int(min(edge[0], min(edge[1], edge[2])) / dz), -1
    light = (0.0, 0.0, 0.0)
    k = 0
    while k < steps:
        x, y, z = max(ax + k * bx, 0.0), max(ay + k * by, 0.0), max(az + k * bz, 0.0)
        i, j, m = min(int(x) >> SHIFT, nx), min(int(y) >> SHIFT, ny), min(int(z) >> SHIFT, nz)
        # unsigned: a signed index costs a look whether it counts from the end
        brick = index[np.uint64(m), np.uint64(j), np.uint64(i)]
        if brick < 0:
            out = min(_exit(x, rx, i, brick), min(_exit(y, ry, j, brick), _exit(z, rz, m, brick)))
            k += max(1, int(min(np.ceil(out), steps)))
            continue
        k += 1
        heat, soot, density = sample(values, channels, soot_channel, brick, x - i * B, y - j * B,
                                     z - m * B)
        place = min(heat, 1.0) * (ENTRIES - 1)
        e: Number = np.uint64(min(int(place), ENTRIES - 2))
        f, next_e = place - e, e + np.uint64(1)
        fire = density * ((1.0 - f) * table[e, 3] + f * table[next_e, 3])
        total = fire + soot_absorption * soot
        if total <= 0.0:
            continue
        seen = clear * absorbed(total * dz)
        glow = seen * fire / total
        if k > stale:   # the light changes over coarse cells: once per cell is often enough
            light = lit_at(lit, (x - 0.5) * cx - 0.5, (y - 0.5) * cy - 0.5, (z - 0.5) * cz - 0.5)
            stale = k + lasting
        red += (glow * ((1.0 - f) * table[e, 0] + f * table[next_e, 0])
                + seen * albedo[0] * light[0])
        green += (glow * ((1.0 - f) * table[e, 1] + f * table[next_e, 1])
                  + seen * albedo[1] * light[1])
        blue += (glow * ((1.0 - f) * table[e, 2] + f * table[next_e, 2])
                 + seen * albedo[2] * light[2])
        clear -= seen
        if clear < faint:
            return red, green, blue, 0.0
    return red, green, blue, clear


@kernel
def absorbed(depth: float) -> float:
    """1 - exp(-depth); for the thin steps of a march by its series, to 3e-8, five times faster."""
    if depth > 0.4:
        return 1.0 - np.exp(-depth)
    x = depth
    return x * (1.0 - x * (1 / 2) * (1.0 - x * (1 / 3) * (1.0 - x * (1 / 4) * (
        1.0 - x * (1 / 5) * (1.0 - x * (1 / 6) * (1.0 - x * (1 / 7)))))))


@kernel
def hottest(volume: Volume, rays: Rays, hits: Hits, heat: Array) -> None:
    """The highest heat (n,) of the steps along the rays to their hits."""
    bricks, cells = volume.bricks, volume.cells
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
            nz, ny, nx = bricks.place.shape
            i, j, k = (min(int(x) // B, nx - 1), min(int(y) // B, ny - 1), min(int(z) // B, nz - 1))
            brick = bricks.place[k, j, i]
            if brick >= 0:
                here, _, _ = sample(bricks.values, bricks.channels, bricks.soot, brick, x - i * B,
                                    y - j * B, z - k * B)
                heat[ray] = max(heat[ray], here)


@kernel
def _inverse(b: float) -> float:
    """1 / b, or almost infinity."""
    return 1.0 / b if abs(b) > 1e-12 else 1e12


@kernel
def _exit(x: float, inverse: float, brick: int, empty: int) -> float:
    """After how many steps of length 1 / inverse a coordinate leaves the empty bricks around it."""
    beyond = brick - empty if inverse > 0.0 else brick + 1 + empty
    return (beyond * B - x) * inverse
