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
def rows(n: int, a: Ints, b: Ints, weight: Floats) -> tuple[Small, Small, Floats]:
    """L of links a-b (e,) between n nodes: starts (n + 1,) of the rows, ascending columns and
    values. Nodes that are linked more than once have one entry, the sum."""
    start = np.ones(n + 1, dtype=np.int32)      # one for the diagonal
    start[0] = 0
    for link in range(len(a)):
        start[a[link] + 1] += 1
        start[b[link] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    columns, values = np.empty(start[n], dtype=np.int32), np.empty(start[n])
    end = start[:-1] + 1
    for i in range(n):
        columns[start[i]], values[start[i]] = i, 0.0
    for link in range(len(a)):
        for here, there in ((a[link], b[link]), (b[link], a[link])):
            at = end[here]
            while at > start[here] and columns[at - 1] > there:
                columns[at], values[at] = columns[at - 1], values[at - 1]
                at -= 1
            columns[at], values[at] = there, -weight[link]
            end[here] += 1
    filled = 0
    for i in range(n):
        first, total, last = filled, 0.0, -1
        for at in range(start[i], end[i]):
            total -= values[at]
        for at in range(start[i], end[i]):
            value = total if columns[at] == i else values[at]
            if columns[at] == last:
                values[filled - 1] += value
                continue
            last = columns[at]
            columns[filled], values[filled] = last, value
            filled += 1
        start[i] = first
    start[n] = filled
    return start, columns[:filled], values[:filled]


@njit(cache=True)
def breadth_first(start: Small, columns: Small) -> Small:
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
                if not met[columns[at]]:
                    met[columns[at]], order[count] = True, columns[at]
                    count += 1
    return order


@njit(cache=True)
def reordered(start: Small, columns: Small, values: Floats, order: Small, rank: Small, low: int,
              high: int) -> tuple[Small, Small, Floats]:
    """Rows low ... high - 1 of a matrix whose row i and column i have become those of number
    rank[i], so that row k was row order[k]; as starts from 0, ascending columns and values."""
    starts = np.zeros(high - low + 1, dtype=np.int32)
    for k in range(low, high):
        starts[k - low + 1] = starts[k - low] + start[order[k] + 1] - start[order[k]]
    places, entries = np.empty(starts[-1], dtype=np.int32), np.empty(starts[-1])
    for k in range(low, high):
        first = starts[k - low]
        for old in range(start[order[k]], start[order[k] + 1]):
            at, place = first + old - start[order[k]], rank[columns[old]]
            while at > first and places[at - 1] > place:
                places[at], entries[at] = places[at - 1], entries[at - 1]
                at -= 1
            places[at], entries[at] = place, values[old]
    return starts, places, entries


@njit(cache=True)
def times(a: Ints, b: Ints, weight: Floats, vector: Floats) -> Floats:
    """(n,) L v, link by link."""
    product = np.zeros(len(vector))
    for link in range(len(a)):
        pull = weight[link] * (vector[a[link]] - vector[b[link]])
        product[a[link]] += pull
        product[b[link]] -= pull
    return product
