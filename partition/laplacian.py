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
