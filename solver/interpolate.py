"""The value of a field at a point: trilinear, on the staggered grid.

Points are given in cells from the low corner of this rank's block, X = (x / h) - start. A field
whose first inner value sits at X = shift (½ at cell centres, 1 on the right face along its own
axis) is read at X - shift + GHOSTS. Points up to one cell outside the block are exact where the
ghosts are filled; farther ones read the nearest value.
"""

import math

from solver.kernel import GHOSTS, inlined


@inlined
def cell_of(x, length):
    """Lower index and weight of the upper neighbour, kept inside an axis of `length` values."""
    low = math.floor(x)
    if low < 0:
        return 0, 0.0
    if low > length - 2:
        return length - 2, 1.0
    return int(low), x - low


@inlined
def trilinear(f, x, y, z):
    """f at fractional array indices (x along the last axis)."""
    i, a = cell_of(x, f.shape[2])
    j, b = cell_of(y, f.shape[1])
    k, c = cell_of(z, f.shape[0])
    low = ((1 - b) * ((1 - a) * f[k, j, i] + a * f[k, j, i + 1])
           + b * ((1 - a) * f[k, j + 1, i] + a * f[k, j + 1, i + 1]))
    high = ((1 - b) * ((1 - a) * f[k + 1, j, i] + a * f[k + 1, j, i + 1])
            + b * ((1 - a) * f[k + 1, j + 1, i] + a * f[k + 1, j + 1, i + 1]))
    return (1 - c) * low + c * high


@inlined
def velocity_at(u, v, w, X, Y, Z):
    """(u, v, w) at a point given in cells."""
    centre, face = GHOSTS - 0.5, GHOSTS - 1.0
    return (trilinear(u, X + face, Y + centre, Z + centre),
            trilinear(v, X + centre, Y + face, Z + centre),
            trilinear(w, X + centre, Y + centre, Z + face))


@inlined
def scalar_at(f, X, Y, Z):
    """A cell-centred field at a point given in cells."""
    centre = GHOSTS - 0.5
    return trilinear(f, X + centre, Y + centre, Z + centre)


@inlined
def deposit(f, X, Y, Z, amount, nearest):
    """Spread an amount over the cells around a point: the adjoint of `scalar_at`, or, where
    `nearest`, all of it to the cell that holds the point. Ghosts take what lands outside."""
    if nearest:
        f[min(max(int(Z), 0), f.shape[0] - 2 * GHOSTS - 1) + GHOSTS,
          min(max(int(Y), 0), f.shape[1] - 2 * GHOSTS - 1) + GHOSTS,
          min(max(int(X), 0), f.shape[2] - 2 * GHOSTS - 1) + GHOSTS] += amount
        return
    centre = GHOSTS - 0.5
    i, a = cell_of(X + centre, f.shape[2])
    j, b = cell_of(Y + centre, f.shape[1])
    k, c = cell_of(Z + centre, f.shape[0])
    f[k, j, i] += amount * (1 - a) * (1 - b) * (1 - c)
    f[k, j, i + 1] += amount * a * (1 - b) * (1 - c)
    f[k, j + 1, i] += amount * (1 - a) * b * (1 - c)
    f[k, j + 1, i + 1] += amount * a * b * (1 - c)
    f[k + 1, j, i] += amount * (1 - a) * (1 - b) * c
    f[k + 1, j, i + 1] += amount * a * (1 - b) * c
    f[k + 1, j + 1, i] += amount * (1 - a) * b * c
    f[k + 1, j + 1, i + 1] += amount * a * b * c
