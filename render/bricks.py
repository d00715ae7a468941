"""How is a volume stored that is mostly empty? Bricks of cells; empty ones take one integer.

The n cells of an axis get a rim that repeats the first and the last, so that cell c is rim index
c + 1 and every point of the box lies between two values: position x in cells is g = x + 1/2 in
rim indices. Brick b covers the values b B ... b B + B, B = 8: neighbours share a face of values, so
that a brick can be interpolated alone, and is empty exactly when none of its values can be seen.

Values have one to three channels. The first is heat, the temperature as a share of the shown range.
After it may come the density of the fire, and then heat is heat times density; and soot.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from render.kernel import kernel

SHIFT = 3
B = 1 << SHIFT
Array = NDArray[np.float64]
Single = NDArray[np.float32]
Number = Any     # a float32 or an unsigned index in a register


class Bricks(NamedTuple):
    """A sparse volume.

    place       (bz, by, bx) int32: place in the pool; -d for an empty brick if all bricks nearer
                than d in every direction are empty as well, so that a ray can jump over them
    values      (m * (B + 1)³ * channels,) float32, the pool in one row
    channels    1, 2 or 3: heat; density, if there is one; soot, if there is any
    soot        channel of soot, the last; 0: there is none
    """

    place: NDArray[np.int32]
    values: Single
    channels: int
    soot: int

    @property
    def pool(self) -> Single:
        """(m, B + 1, B + 1, B + 1, channels) the values of every brick."""
        return self.values.reshape(-1, B + 1, B + 1, B + 1, self.channels)

    @property
    def bytes(self) -> int:
        """Memory it takes."""
        return self.place.nbytes + self.values.nbytes


def bricks_of(place: NDArray[np.int32], pool: Single, soot: bool) -> Bricks:
    """Bricks from their pool; `place` is negative for empty ones."""
    place = np.where(place < 0, -max(place.shape), place).astype(np.int32)
    _measure(place)
    channels = pool.shape[4]
    return Bricks(place, pool.reshape(-1), channels, channels - 1 if soot else 0)


@kernel
def _measure(place: NDArray[np.int32]) -> None:
    """Lower the distances of empty bricks to those of a neighbour and 1; two sweeps see all."""
    nz, ny, nx = place.shape
    for sweep in range(2):
        for brick in range(place.size):
            n = brick if sweep == 0 else place.size - 1 - brick
            k, j, i = n // (ny * nx), n // nx % ny, n % nx
            if place[k, j, i] >= 0:
                continue
            for c in range(max(k - 1, 0), min(k + 2, nz)):
                for b in range(max(j - 1, 0), min(j + 2, ny)):
                    for a in range(max(i - 1, 0), min(i + 2, nx)):
                        place[k, j, i] = max(place[k, j, i], min(place[c, b, a], 0) - 1)


def grid_of(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Numbers of bricks that cover cells of a (nz, ny, nx) shape and their rim."""
    return tuple(n // B + 1 for n in shape)


def from_cells(warm: Single, soot: Single, onset: float, low: float = 0.0,
               high: float = 1.0) -> Bricks:
    """Bricks from dense cells (nz, ny, nx); a value can be seen if heat > onset or soot > 0.

    Heat is `warm` from `low` to `high`, clamped. A soot of no cells means none, and one channel.
    """
    index = np.empty(grid_of(warm.shape), np.int32)
    count = _number(warm, soot, low + onset * (high - low), index)
    pool = np.empty((count, B + 1, B + 1, B + 1, 2 if soot.size else 1), np.float32)
    _copy(warm, soot, low, 1.0 / (high - low), index, pool)
    return bricks_of(index, pool, soot.size > 0)


@kernel
def clipped(c: int, n: int) -> int:
    """The cell of a rim index, c + 1 counted from the rim."""
    return min(max(c, 0), n - 1)


@kernel
def _number(warm: Single, soot: Single, seen_above: float, index: NDArray[np.int32]) -> int:
    """Give every brick that can be seen a place in the pool; returns how many there are."""
    nz, ny, nx = warm.shape
    count = 0
    for bz in range(index.shape[0]):
        for by in range(index.shape[1]):
            for bx in range(index.shape[2]):
                seen = False
                for k in range(clipped(bz * B - 1, nz), clipped(bz * B + B - 1, nz) + 1):
                    for j in range(clipped(by * B - 1, ny), clipped(by * B + B - 1, ny) + 1):
                        for i in range(clipped(bx * B - 1, nx), clipped(bx * B + B - 1, nx) + 1):
                            if (warm[k, j, i] > seen_above
                                    or soot.size > 0 and soot[k, j, i] > 0.0):
                                seen = True
                                break
                        if seen:
                            break
                    if seen:
                        break
                index[bz, by, bx] = count if seen else -1
                count += seen
    return count


@kernel
def _copy(warm: Single, soot: Single, low: float, scale: float, index: NDArray[np.int32],
          pool: Single) -> None:
    nz, ny, nx = warm.shape
    for bz in range(index.shape[0]):
        for by in range(index.shape[1]):
            for bx in range(index.shape[2]):
                m = index[bz, by, bx]
                if m < 0:
                    continue
                for c in range(B + 1):
                    k = clipped(bz * B + c - 1, nz)
                    for b in range(B + 1):
                        j = clipped(by * B + b - 1, ny)
                        for a in range(B + 1):
                            i = clipped(bx * B + a - 1, nx)
                            heat = (warm[k, j, i] - low) * scale
                            pool[m, c, b, a, 0] = min(max(heat, 0.0), 1.0)
                            if soot.size > 0:
                                pool[m, c, b, a, 1] = soot[k, j, i]


@kernel
def density_channel(channels: int, soot: int) -> int:
    """The channel of density; 0: there is none."""
    return channels - 2 if soot > 0 else channels - 1


@kernel
def sample(values: Single, channels: int, soot_channel: int, m: int, x: float, y: float,
           z: float) -> tuple[float, float, float]:
    """Trilinear heat, soot and density of brick m at (x, y, z) in [0, B] from its first value."""
    i, j, k = min(int(x), B - 1), min(int(y), B - 1), min(int(z), B - 1)
    one: Number = np.float32(1.0)
    p, q, r = np.float32(x - i), np.float32(y - j), np.float32(z - k)
    edge = B + 1
    second = density_channel(channels, soot_channel)
    # one unsigned index per value: a signed index costs a look whether it counts from the end
    base = np.uint64((((m * edge + k) * edge + j) * edge + i) * channels)
    step, row = np.uint64(channels), np.uint64(edge * channels)
    layer = np.uint64(edge * edge * channels)
    soot: Number = np.float32(0.0)
    density = one
    if soot_channel > 0:
        soot = _cell(values, base + np.uint64(soot_channel), step, row, layer, p, one - q, q,
                     one - r, r)
    if second > 0:
        density = _cell(values, base + np.uint64(second), step, row, layer, p, one - q, q, one - r,
                        r)
        if density <= 0.0:
            return 0.0, float(soot), 0.0
    heat = _cell(values, base, step, row, layer, p, one - q, q, one - r, r) / density
    return float(heat), float(soot), float(density)


@kernel
def _cell(values: Single, base: Number, step: Number, row: Number, layer: Number, p: Number,
          q0: Number, q1: Number, r0: Number, r1: Number) -> Number:
    """One channel between the eight values around base."""
    a, b = values[base], values[base + step]
    c, d = values[base + row], values[base + row + step]
    near = q0 * (a + p * (b - a)) + q1 * (c + p * (d - c))
    base += layer
    a, b = values[base], values[base + step]
    c, d = values[base + row], values[base + row + step]
    return r0 * near + r1 * (q0 * (a + p * (b - a)) + q1 * (c + p * (d - c)))
