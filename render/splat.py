"""How do particles become a volume? Counted in fine cells, blurred, mapped, in sparse bricks.

Every particle counts in its cell; counts are convolved with the thesis' filter of n³ cells, n odd,
    F(a, b, c) = exp(-(a² + b² + c²) / (2 alpha²)) / ((2 pi)^(3/2) alpha³),   a, b, c = -h ... h,
h = (n - 1) / 2, divided by the sum S of its entries, so that the counts still add up to the number
of particles. Since most cells are empty the filter is laid down once per particle instead of once
per cell; the sums are the same. Heat is blurred as heat times count, and divided by the blurred
count.
Counts R > 0 then become densities min_density + (max_density - min_density) R / R_max, at most
max_density; an empty cell stays 0, and R_max is one number for the whole sequence.
"""

import numpy as np
from numpy.typing import NDArray

from render.bricks import B, Bricks, bricks_of, grid_of
from render.kernel import kernel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Index = NDArray[np.int32]
Single = NDArray[np.float32]


def gaussian(alpha: float, n: int) -> Array:
    """(n, n, n) the thesis' filter, not normalised."""
    a = np.arange(n) - (n - 1) / 2
    line = np.exp(-a * a / (2 * alpha * alpha)) / (np.sqrt(2 * np.pi) * alpha)
    return np.asarray(np.einsum("k,j,i->kji", line, line, line))


def counted(position: Array, heat: Array, soot: NDArray[np.bool_], cells: tuple[int, int, int],
            size: Array, weights: Array) -> Bricks:
    """Bricks of (blurred heat of fuel, count of soot, count of fuel) from particles in the box.

    position (n, 3), L; heat (n,); soot (n,) whether a particle is soot; cells nx, ny, nz;
    weights (m, m, m) the normalised filter.
    """
    inside = np.all((position >= 0) & (position < size), axis=1)
    cell = np.floor(position[inside] / size * cells).astype(np.int64)
    shape = np.array(cells)
    index = np.full(grid_of(cells[::-1]), -1, np.int32)
    count = _touch(cell, shape, len(weights) // 2, index)
    pool = np.zeros((count, B + 1, B + 1, B + 1, 3), np.float32)
    _lay(cell, heat[inside], soot[inside], shape, weights, index, pool)
    _share_faces(index, pool)
    return bricks_of(index, pool)


def densest(bricks: Bricks) -> float:
    """R_max of a frame: the largest blurred count of fuel or soot in a cell."""
    return float(bricks.pool[..., 1:].max()) if len(bricks.pool) else 0.0


def mapped(bricks: Bricks, low: float, high: float, most: float) -> Bricks:
    """Counts as densities in [low, high], and heat as mean heat times density."""
    heat, soot, fuel = (bricks.pool[..., c] for c in range(3))
    mean = np.divide(heat, fuel, out=np.zeros_like(heat), where=fuel > 0)

    def density(counts: Single) -> Single:
        return np.where(counts > 0, low + (high - low) * np.minimum(counts / most, 1), 0)

    dense = density(fuel)
    values = np.stack([mean * dense, density(soot), dense], axis=-1)
    return bricks_of(bricks.place, values.astype(np.float32))


@kernel
def _touch(cell: Integers, shape: Integers, h: int, index: Index) -> int:
    """Number the bricks that hold a value under the filter of some particle."""
    for p in range(len(cell)):
        # values c - h ... c + h in the box, at rim indices one higher; a multiple of B is also the
        # last value of the brick before
        x0, x1 = max(cell[p, 0] - h, 0) + 1, min(cell[p, 0] + h, shape[0] - 1) + 1
        y0, y1 = max(cell[p, 1] - h, 0) + 1, min(cell[p, 1] + h, shape[1] - 1) + 1
        z0, z1 = max(cell[p, 2] - h, 0) + 1, min(cell[p, 2] + h, shape[2] - 1) + 1
        for bz in range((z0 - 1) // B, min(z1 // B, index.shape[0] - 1) + 1):
            for by in range((y0 - 1) // B, min(y1 // B, index.shape[1] - 1) + 1):
                for bx in range((x0 - 1) // B, min(x1 // B, index.shape[2] - 1) + 1):
                    index[bz, by, bx] = 0
    count = 0
    for bz in range(index.shape[0]):
        for by in range(index.shape[1]):
            for bx in range(index.shape[2]):
                if index[bz, by, bx] == 0:
                    index[bz, by, bx] = count
                    count += 1
    return count


@kernel
def _lay(cell: Integers, heat: Array, soot: NDArray[np.bool_], shape: Integers, weights: Array,
         index: Index, pool: Single) -> None:
    """Add the filter of every particle, each value to the brick that owns it."""
    h = weights.shape[0] // 2
    for p in range(len(cell)):
        for c in range(-h, h + 1):
            z = cell[p, 2] + c + 1
            if z < 1 or z > shape[2]:
                continue
            for b in range(-h, h + 1):
                y = cell[p, 1] + b + 1
                if y < 1 or y > shape[1]:
                    continue
                for a in range(-h, h + 1):
                    x = cell[p, 0] + a + 1
                    if x < 1 or x > shape[0]:
                        continue
                    weight = weights[c + h, b + h, a + h]
                    if x // B == index.shape[2] or y // B == index.shape[1] or (
                            z // B == index.shape[0]):
                        continue
                    m = index[z // B, y // B, x // B]
                    if soot[p]:
                        pool[m, z % B, y % B, x % B, 1] += weight
                    else:
                        pool[m, z % B, y % B, x % B, 0] += weight * heat[p]
                        pool[m, z % B, y % B, x % B, 2] += weight


@kernel
def _share_faces(index: Index, pool: Single) -> None:
    """Copy the values that a brick shares with those above it along x, y, z."""
    nz, ny, nx = index.shape
    for bz in range(nz):
        for by in range(ny):
            for bx in range(nx):
                m = index[bz, by, bx]
                if m < 0:
                    continue
                for c in range(B + 1):
                    for b in range(B + 1):
                        for a in range(B + 1):
                            if a < B and b < B and c < B:
                                continue
                            i, j, k = bx + a // B, by + b // B, bz + c // B
                            if i >= nx or j >= ny or k >= nz or index[k, j, i] < 0:
                                continue
                            o = index[k, j, i]
                            for channel in range(3):
                                pool[m, c, b, a, channel] = pool[o, c % B, b % B, a % B, channel]
