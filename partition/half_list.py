"""What did the thesis' breadth-first search really do? (Algorithm 5 with its mended list, 4.1)

The triangles are listed breadth-first from the first one, a child sharing a vertex with its
parent; those that are not reached are put at the end; the list is halved and both halves are
treated likewise. Nothing is lost and sizes differ by one at most, but the halves, and so the
pieces, are often torn. Kept as an option, to compare; where m is not a power of two the list is
divided in proportion to the pieces that the two parts become.
"""

import numpy as np
from numba import njit

from partition.graph import Ints


def half_list(faces: Ints, pieces: int) -> Ints:
    """(f,) the piece of each triangle (f, 3); 1 <= pieces <= f."""
    order = np.argsort(faces.ravel(), kind="stable")
    start = np.zeros(int(faces.max()) + 2, dtype=np.int64)
    np.cumsum(np.bincount(faces.ravel()), out=start[1:])
    return _halve(faces, start, order // 3, pieces)


@njit(cache=True)
def _halve(faces: Ints, start: Ints, around: Ints, pieces: int) -> Ints:
    """`around[start[v]:start[v + 1]]` are the triangles at vertex v."""
    n = len(faces)
    members = np.arange(n)
    group = np.zeros(n, dtype=np.int64)
    label = np.zeros(n, dtype=np.int64)
    stack = [(0, n, pieces)]
    groups, piece = 0, 0
    while len(stack) > 0:
        low, high, k = stack.pop()
        if k == 1:
            label[members[low:high]] = piece
            piece += 1
            continue
        groups += 1
        group[members[low:high]] = groups
        _list_all(members[low:high], groups, faces, start, around, group)
        middle = low + max(k // 2, ((high - low) * (k // 2)) // k)
        stack.append((middle, high, k - k // 2))
        stack.append((low, middle, k // 2))
    return label


@njit(cache=True)
def _list_all(members: Ints, mine: int, faces: Ints, start: Ints, around: Ints,
              group: Ints) -> None:
    """Sort `members`, all of group `mine`, breadth-first from the first, in place; the group of
    what is listed becomes -mine."""
    given = members.copy()
    members[0] = given[0]
    group[given[0]] = -mine
    tail = 1
    for head in range(len(members)):
        if head == tail:
            break
        for corner in faces[members[head]]:
            for triangle in around[start[corner]:start[corner + 1]]:
                if group[triangle] == mine:
                    group[triangle] = -mine
                    members[tail] = triangle
                    tail += 1
    for triangle in given:
        if group[triangle] == mine:
            members[tail] = triangle
            tail += 1
