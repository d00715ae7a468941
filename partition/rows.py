"""How are the rows of a graph's matrix found, in which order do they stand, and what is L v?

The Laplacian L = B W B^T, B having a column e_a - e_b for every link a-b: in row i the weights of
the links of node i with a minus sign, their sum on the diagonal. Assembled row by row from the list
of links, several times faster than by sorting them. Neighbours in a graph stand near each other,
in memory and on the ranks that share a matrix, if its nodes are taken breadth-first (the order of
Cuthill and McKee, without its sorting by degree).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.graph import Ints

Floats = NDArray[np.float64]
Small = NDArray[np.int32]       # numbers of nodes and links; half the memory is half the time


@njit(cache=True)
def adjacency(n: int, a: Ints, b: Ints, weight: Floats) -> tuple[Small, Small, Floats]:
    """Starts (n + 1,) of the neighbours of each of n nodes in a list of them, and the weights of
    the links a-b (e,) to them."""
    start = np.zeros(n + 1, dtype=np.int32)
    for link in range(len(a)):
        start[a[link] + 1] += 1
        start[b[link] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    end = start[:-1].copy()
    neighbour, weights = np.empty(start[n], dtype=np.int32), np.empty(start[n])
    for link in range(len(a)):
        for here, there in ((a[link], b[link]), (b[link], a[link])):
            neighbour[end[here]], weights[end[here]] = there, weight[link]
            end[here] += 1
    return start, neighbour, weights


@njit(cache=True)
def breadth_first(start: Small, neighbour: Small) -> Small:
    """(n,) the nodes in the order in which they are met from node 0; parts that cannot be reached
    from there follow."""
    order = np.empty(len(start) - 1, dtype=np.int32)
    met = np.zeros(len(order), dtype=np.bool_)
    count, done = 0, 0
    for first in range(len(order)):
        if met[first]:
            continue
        met[first], order[count] = True, first
        count += 1
        while done < count:
            node = order[done]
            done += 1
            for at in range(start[node], start[node + 1]):
                if not met[neighbour[at]]:
                    met[neighbour[at]], order[count] = True, neighbour[at]
                    count += 1
    return order


@njit(cache=True)
def rows(start: Small, neighbour: Small, weights: Floats, order: Small, low: int,
         high: int) -> tuple[Small, Small, Floats]:
    """Rows low ... high - 1 of L, row and column k being node order[k]: starts from 0, ascending
    columns and values. Nodes linked more than once have one entry, the sum."""
    place, most = np.empty(len(order), dtype=np.int32), high - low
    for k in range(len(order)):
        place[order[k]] = k
    for k in range(low, high):
        most += start[order[k] + 1] - start[order[k]]
    starts = np.zeros(high - low + 1, dtype=np.int32)
    columns, values = np.empty(most, dtype=np.int32), np.empty(most)
    for k in range(low, high):
        first = starts[k - low]
        columns[first], values[first] = k, 0.0
        end, total = first + 1, 0.0
        for at in range(start[order[k]], start[order[k] + 1]):
            end = _added(columns, values, first, end, place[neighbour[at]], -weights[at])
            total += weights[at]
        starts[k - low + 1] = _added(columns, values, first, end, k, total)
    return starts, columns[:starts[-1]], values[:starts[-1]]


@njit(inline="always")
def _added(columns: Small, values: Floats, first: int, end: int, column: int,
           value: float) -> int:
    """The end of a row first ... end - 1 of ascending columns after adding to one of them."""
    at = end
    while at > first and columns[at - 1] > column:
        at -= 1
    if at > first and columns[at - 1] == column:
        values[at - 1] += value
        return end
    for later in range(end, at, -1):
        columns[later], values[later] = columns[later - 1], values[later - 1]
    columns[at], values[at] = column, value
    return end + 1


@njit(cache=True)
def times(a: Ints, b: Ints, weight: Floats, vector: Floats) -> Floats:
    """(n,) L v, link by link."""
    product = np.zeros(len(vector))
    for link in range(len(a)):
        pull = weight[link] * (vector[a[link]] - vector[b[link]])
        product[a[link]] += pull
        product[b[link]] -= pull
    return product
