"""What is the matrix of a graph?

The Laplacian L = B W B^T, B having a column e_a - e_b for every link a-b: in row i the weights of
the links of node i with a minus sign, their sum on the diagonal. Assembled row by row from the list
of links, several times faster than by sorting them.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array

from partition.graph import Ints
from partition.weights import Graph

Floats = NDArray[np.float64]
AnyInts = NDArray[np.integer]


def laplacian(graph: Graph) -> csr_array:
    """L as a sparse matrix (n, n)."""
    return assembled(len(graph.mass), graph.a, graph.b, graph.weight)


def assembled(n: int, a: Ints, b: Ints, weight: Floats) -> csr_array:
    """L of links a-b (e,) between n nodes."""
    start, columns, values = _rows(n, a, b, weight)
    matrix = csr_array((values, columns, start), shape=(n, n))
    matrix.sum_duplicates()     # nodes may be linked more than once
    return matrix


@njit(cache=True)
def reordered(start: AnyInts, columns: AnyInts, values: Floats, order: AnyInts, rank: Ints,
              low: int, high: int) -> tuple[Ints, Ints, Floats]:
    """Rows low ... high - 1 of a matrix whose row i and column i have become those of number
    rank[i], so that row k was row order[k]; as starts from 0, ascending columns and values."""
    starts = np.zeros(high - low + 1, dtype=np.int64)
    for k in range(low, high):
        starts[k - low + 1] = starts[k - low] + start[order[k] + 1] - start[order[k]]
    places, entries = np.empty(starts[-1], dtype=np.int64), np.empty(starts[-1])
    for k in range(low, high):
        first = starts[k - low]
        for old in range(start[order[k]], start[order[k] + 1]):
            at = first + old - start[order[k]]
            while at > first and places[at - 1] > rank[columns[old]]:
                places[at], entries[at] = places[at - 1], entries[at - 1]
                at -= 1
            places[at], entries[at] = rank[columns[old]], values[old]
    return starts, places, entries


@njit(cache=True)
def _rows(n: int, a: Ints, b: Ints, weight: Floats) -> tuple[Ints, Ints, Floats]:
    """Rows with ascending columns."""
    start = np.zeros(n + 1, dtype=np.int64)
    for link in range(len(a)):
        start[a[link] + 1] += 1
        start[b[link] + 1] += 1
    start = np.cumsum(start) + np.arange(n + 1)     # one more for the diagonal
    columns = np.empty(start[n], dtype=np.int64)
    values = np.empty(start[n])
    place = start[:-1] + 1
    for i in range(n):
        columns[start[i]], values[start[i]] = i, 0.0
    for link in range(len(a)):
        for here, there in ((a[link], b[link]), (b[link], a[link])):
            at = place[here]
            while at > start[here] and columns[at - 1] > there:
                columns[at], values[at] = columns[at - 1], values[at - 1]
                at -= 1
            columns[at], values[at] = there, -weight[link]
            place[here] += 1
    for i in range(n):
        total = 0.0
        for at in range(start[i], start[i + 1]):
            total -= values[at]
        for at in range(start[i], start[i + 1]):
            if columns[at] == i:
                values[at] = total
                break
    return start, columns, values
