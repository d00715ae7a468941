"""The value of a field at a point, and its adjoint: trilinear, on the staggered grid.

Points are given in cells from the low corner of this rank's block, X = x / h - start. A field
whose first inner value sits at X = shift (½ at cell centres, 1 on the right face along its own
axis) is read at the array index X - shift + GHOSTS. On an axis with the index i + a, 0 ≤ a < 1,

    f = (1 - a) f[i] + a f[i + 1]

and so on for the three axes: exact for linear fields. Points up to one cell outside the block are
exact where the ghosts are filled; farther ones, and points that are not finite, read the nearest
value, never beyond the array.
"""

import numpy as np

from solver.kernel import GHOSTS, inlined

ONE = np.uint64(1)          # array indices are unsigned: no test for negative ones
CENTRE, FACE = GHOSTS - 0.5, GHOSTS - 1.0


@inlined
def split(x, last):
    """Lower index and weight of the upper neighbour, on an axis of indices 0 … last."""
    low = 0.0
    if x > low:   # false for NaN
        low = min(x, last)
    index = int(min(low, last - 1.0))
    return np.uint64(index), low - index


@inlined
def in_cells(position, per_cell, start, axis):
    """A coordinate in cells from the low corner of this rank's block; per_cell = 1 / h."""
    return position[axis] * per_cell[axis] - start[axis]


@inlined
def trilinear(f, k, j, i, c, b, a):
    """f at (k + c, j + b, i + a)."""
    up, north, east = k + ONE, j + ONE, i + ONE
    low = f[k, j, i]
    low += a * (f[k, j, east] - low)
    line = f[k, north, i]
    line += a * (f[k, north, east] - line)
    low += b * (line - low)
    high = f[up, j, i]
    high += a * (f[up, j, east] - high)
    line = f[up, north, i]
    line += a * (f[up, north, east] - line)
    high += b * (line - high)
    return low + c * (high - low)


@inlined
def last_indices(f):
    """The last index along x, y, z."""
    return f.shape[2] - 1.0, f.shape[1] - 1.0, f.shape[0] - 1.0


@inlined
def velocity_at(u, v, w, X, Y, Z):
    """(u, v, w) at a point given in cells."""
    lx, ly, lz = last_indices(u)
    (i, a), (j, b), (k, c) = split(X + CENTRE, lx), split(Y + CENTRE, ly), split(Z + CENTRE, lz)
    (p, d), (q, e), (r, f) = split(X + FACE, lx), split(Y + FACE, ly), split(Z + FACE, lz)
    return (trilinear(u, k, j, p, c, b, d), trilinear(v, k, q, i, c, e, a),
            trilinear(w, r, j, i, f, b, a))


@inlined
def air_at(u, v, w, T, X, Y, Z):
    """(u, v, w, T) at a point given in cells."""
    lx, ly, lz = last_indices(u)
    (i, a), (j, b), (k, c) = split(X + CENTRE, lx), split(Y + CENTRE, ly), split(Z + CENTRE, lz)
    (p, d), (q, e), (r, f) = split(X + FACE, lx), split(Y + FACE, ly), split(Z + FACE, lz)
    return (trilinear(u, k, j, p, c, b, d), trilinear(v, k, q, i, c, e, a),
            trilinear(w, r, j, i, f, b, a), trilinear(T, k, j, i, c, b, a))


@inlined
def scalar_at(f, X, Y, Z):
    """A cell-centred field at a point given in cells."""
    lx, ly, lz = last_indices(f)
    (i, a), (j, b), (k, c) = split(X + CENTRE, lx), split(Y + CENTRE, ly), split(Z + CENTRE, lz)
    return trilinear(f, k, j, i, c, b, a)


@inlined
def own_cell(X, count):
    """The array index of the cell that holds a point of this rank's block."""
    return np.uint64(min(max(int(X), 0), count - 1) + GHOSTS)


@inlined
def deposit(f, X, Y, Z, amount, nearest):
    """Spread an amount over the cells around a point: the adjoint of `scalar_at`, or, where
    `nearest`, all of it to the cell that holds the point. Ghosts take what lands outside."""
    if nearest:
        f[own_cell(Z, f.shape[0] - 2 * GHOSTS), own_cell(Y, f.shape[1] - 2 * GHOSTS),
          own_cell(X, f.shape[2] - 2 * GHOSTS)] += amount
        return
    lx, ly, lz = last_indices(f)
    (i, a), (j, b), (k, c) = split(X + CENTRE, lx), split(Y + CENTRE, ly), split(Z + CENTRE, lz)
    up, north, east = k + ONE, j + ONE, i + ONE
    part = amount * (1 - c) * (1 - b)
    f[k, j, i] += part * (1 - a)
    f[k, j, east] += part * a
    part = amount * (1 - c) * b
    f[k, north, i] += part * (1 - a)
    f[k, north, east] += part * a
    part = amount * c * (1 - b)
    f[up, j, i] += part * (1 - a)
    f[up, j, east] += part * a
    part = amount * c * b
    f[up, north, i] += part * (1 - a)
    f[up, north, east] += part * a
