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

from render.bricks import B, Bricks, Number, bricks_of, grid_of
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
    """Bricks of (blurred heat of fuel, count of fuel, count of soot if there is any).

    position (n, 3), L, what is outside the box does not count; heat (n,); soot (n,) whether a
    particle is soot; cells nx, ny, nz;
    weights (m, m, m) the normalised filter.
    """
    inside = np.all((position >= 0) & (position < size), axis=1)
    cell = np.floor(position[inside] / size * cells).astype(np.int64)
    # brick by brick, so that what lies together in memory is filled together
    order = np.argsort(cell // B @ (1, 4096, 4096 ** 2), kind="stable")
    cell, heat, soot = cell[order], heat[inside][order], soot[inside][order]
    shape = np.array(cells)
    index = np.full(grid_of(cells[::-1]), -1, np.int32)
    count = _touch(cell, shape, len(weights) // 2, index)
    channels = 3 if soot.any() else 2
    pool = np.zeros((count, B + 1, B + 1, B + 1, channels), np.float32)
    _lay(cell, heat.astype(np.float32), soot, shape, weights.astype(np.float32), index, pool)
    return bricks_of(index, pool, channels > 2)


def densest(bricks: Bricks) -> float:
    """R_max of a frame: the largest blurred count of fuel or soot in a cell."""
    return float(bricks.pool[..., 1:].max()) if len(bricks.pool) else 0.0


def mapped(bricks: Bricks, low: float, high: float, most: float) -> Bricks:
    """Turns counts into densities in [low, high], and heat into mean heat times density."""
    _map(bricks.values.reshape(-1, bricks.channels), low, high, most)
    return bricks


@kernel
def _map(values: Single, low: float, high: float, most: float) -> None:
    for v in range(values.shape[0]):
        fuel = values[v, 1]
        if fuel > 0.0:
            dense = low + (high - low) * min(fuel / most, 1.0)
            values[v, 0] *= dense / fuel
            values[v, 1] = dense
        if values.shape[1] > 2 and values[v, 2] > 0.0:
            values[v, 2] = low + (high - low) * min(values[v, 2] / most, 1.0)


@kernel
def _reach(c: int, h: int, n: int) -> tuple[int, int, int, int]:
    """Under a filter around cell c of n: first and last rim index, first and last brick.

    Rim indices are one higher than cells; a multiple of B is also the last value of the brick
    before.
    """
    first, last = max(c - h, 0) + 1, min(c + h, n - 1) + 1
    return first, last, (first - 1) // B, min(last // B, n // B)


@kernel
def _touch(cell: Integers, shape: Integers, h: int, index: Index) -> int:
    """Number the bricks that hold a value under the filter of some particle."""
    for p in range(len(cell)):
        _, _, x0, x1 = _reach(cell[p, 0], h, shape[0])
        _, _, y0, y1 = _reach(cell[p, 1], h, shape[1])
        _, _, z0, z1 = _reach(cell[p, 2], h, shape[2])
        index[z0:z1 + 1, y0:y1 + 1, x0:x1 + 1] = 0
    count = 0
    for bz in range(index.shape[0]):
        for by in range(index.shape[1]):
            for bx in range(index.shape[2]):
                if index[bz, by, bx] == 0:
                    index[bz, by, bx] = count
                    count += 1
    return count


@kernel
def _lay(cell: Integers, heat: Single, soot: NDArray[np.bool_], shape: Integers, weights: Single,
         index: Index, pool: Single) -> None:
    """Add the filter of every particle to all bricks that hold one of its values."""
    h, edge, values = weights.shape[0] // 2, B + 1, pool.reshape(-1)
    channels = pool.shape[4]
    one: Number = np.uint64(1)
    two: Number = np.uint64(2)
    next_cell: Number = np.uint64(channels)
    for p in range(len(cell)):
        # rim index r is entry r - 1 - cell + h of the filter
        ox, oy, oz = cell[p, 0] + 1 - h, cell[p, 1] + 1 - h, cell[p, 2] + 1 - h
        i0, i1, x0, x1 = _reach(cell[p, 0], h, shape[0])
        j0, j1, y0, y1 = _reach(cell[p, 1], h, shape[1])
        k0, k1, z0, z1 = _reach(cell[p, 2], h, shape[2])
        warm = heat[p]
        for bz in range(z0, z1 + 1):
            for by in range(y0, y1 + 1):
                for bx in range(x0, x1 + 1):
                    m, first = index[bz, by, bx], max(i0, bx * B)
                    for k in range(max(k0, bz * B), min(k1, bz * B + B) + 1):
                        for j in range(max(j0, by * B), min(j1, by * B + B) + 1):
                            line = weights[k - oz, j - oy]
                            row = (m * edge + k - bz * B) * edge + j - by * B
                            # unsigned, as in bricks.sample
                            at: Number = np.uint64((row * edge + first - bx * B) * channels)
                            for i in range(first, min(i1, bx * B + B) + 1):
                                weight = line[np.uint64(i - ox)]
                                if soot[p]:
                                    values[at + two] += weight
                                else:
                                    values[at] += weight * warm
                                    values[at + one] += weight
                                at += next_cell
