"""How is a triangle mesh broken into exactly m pieces by breadth-first search?

The thesis (Algorithm 5) cuts a set of triangles in two by the levels of a breadth-first search and
recurses. This is the same idea freed of its lost triangles and torn pieces: to break a connected
set S into k pieces,

    root   the triangle of S nearest a given point, or a peripheral one (three sweeps)
    order  breadth-first across shared edges
    A      the shortest prefix of that order with floor(k/2)/k of the weight: connected, since
           every triangle follows the one it was reached from
    B      the heaviest connected part of the rest; lighter parts touch A and are given to it

and k is shared out again by what A and B really weigh. Every piece is edge-connected, every
triangle is in exactly one piece and any 1 <= m <= number of triangles is possible. O(f log m).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.graph import Ints

Floats = NDArray[np.float64]
SWEEPS = 3


class PartitionError(Exception):
    """A body that cannot be broken as asked; the message is one line for the user."""


def break_up(neighbour: Ints, weight: Floats, pieces: int, component: Ints,
             distance: Floats | None = None) -> Ints:
    """(n,) the piece of each triangle (or other cell), numbered 0 ... pieces - 1.

    neighbour  (n, k) cells across each side, negative at a boundary
    weight     (n,) positive; pieces are balanced by it
    component  (n,) number of the connected component of each cell
    distance   (n,) from the point where the search starts; None: at a peripheral cell

    Raises PartitionError if there are fewer cells than pieces, or more components.
    """
    cells = len(weight)
    parts = int(component.max()) + 1
    if pieces > cells:
        raise PartitionError(f"pieces = {pieces}: more than the {cells} triangles there are; "
                             f"fix: at most {cells}, or a finer mesh")
    if pieces < parts:
        raise PartitionError(f"pieces = {pieces}: fewer than the {parts} separate parts of the "
                             f"body; fix: at least {parts}")
    members = np.argsort(component, kind="stable")
    counts = np.bincount(component, minlength=parts)
    heavy = np.bincount(component, weights=weight, minlength=parts).astype(np.float64)
    shares = share_out(pieces, heavy, counts)
    near = np.empty(0) if distance is None else np.ascontiguousarray(distance, dtype=np.float64)
    return _break(np.ascontiguousarray(neighbour), np.ascontiguousarray(weight, dtype=np.float64),
                  near, members, counts, shares)


def share_out(pieces: int, weights: Floats, most: Ints) -> Ints:
    """Distribute pieces in proportion to weights by largest remainder, 1 to `most` to each."""
    quota = pieces * weights / weights.sum()
    share = np.clip(np.floor(quota).astype(np.int64), 1, most)
    while (missing := pieces - int(share.sum())) != 0:
        wanting = np.where(share < most, quota - share, -np.inf) if missing > 0 else \
            np.where(share > 1, share - quota, -np.inf)
        share[np.argmax(wanting)] += np.sign(missing)
    return share


@njit(cache=True)
def _break(neighbour: Ints, weight: Floats, near: Floats, members: Ints, counts: Ints,
           shares: Ints) -> Ints:
    """Recursion of `break_up` with an explicit stack; `members` is reordered in place so that
    every set of triangles still to be broken is one of its ranges."""
    n = len(weight)
    group = np.empty(n, dtype=np.int64)      # the set to which each triangle belongs now
    seen = np.full(n, -1, dtype=np.int64)    # the last sweep that reached it
    queue = np.empty(n, dtype=np.int64)
    label = np.empty(n, dtype=np.int64)
    ends = np.cumsum(counts)
    stack = [(int(ends[part] - counts[part]), int(ends[part]), int(shares[part]))
             for part in range(len(counts))][::-1]
    groups, sweep, piece = 0, 0, 0
    while len(stack) > 0:
        low, high, k = stack.pop()
        if k == 1:
            label[members[low:high]] = piece
            piece += 1
            continue
        group[members[low:high]] = groups
        if len(near) > 0:
            root = int(members[low + np.argmin(near[members[low:high]])])
        else:
            root = int(members[low:high].min())
            for _ in range(SWEEPS):
                reached = _search(root, groups, sweep, neighbour, group, seen, queue)
                sweep += 1
                root = int(queue[reached - 1])
        reached = _search(root, groups, sweep, neighbour, group, seen, queue)
        sweep += 1
        members[low:high] = queue[:reached]
        size = _prefix(weight[members[low:high]], (k // 2) / k)
        group[members[low + size:high]] = groups + 1
        groups += 2
        middle, sweep = _keep_heaviest(low + size, low, high, groups - 1, groups - 2, sweep,
                                       members, neighbour, weight, group, seen, queue)
        part, whole = weight[members[low:middle]].sum(), weight[members[low:high]].sum()
        share = int(np.rint(k * part / whole))
        share = max(share, 1, k - (high - middle))
        share = min(share, k - 1, middle - low)
        stack.append((middle, high, k - share))
        stack.append((low, middle, share))
    return label


@njit(cache=True)
def _search(root: int, mine: int, sweep: int, neighbour: Ints, group: Ints, seen: Ints,
            queue: Ints) -> int:
    """Breadth-first search within the group `mine`; fills `queue`, returns how many it reached."""
    queue[0] = root
    seen[root] = sweep
    head, tail = 0, 1
    while head < tail:
        cell = queue[head]
        head += 1
        for side in range(neighbour.shape[1]):
            other = neighbour[cell, side]
            if other >= 0 and group[other] == mine and seen[other] != sweep:
                seen[other] = sweep
                queue[tail] = other
                tail += 1
    return tail


@njit(cache=True)
def _prefix(weight: Floats, fraction: float) -> int:
    """The length whose weight is nearest to `fraction` of all, at least 1 and not everything."""
    target = fraction * weight.sum()
    total = 0.0
    for index in range(len(weight) - 1):
        total += weight[index]
        if total >= target:
            overshoot = total - target
            shorter = index > 0 and weight[index] - overshoot < overshoot
            return index if shorter else index + 1
    return len(weight) - 1


@njit(cache=True)
def _keep_heaviest(start: int, low: int, high: int, rest: int, prefix: int, sweep: int,
                   members: Ints, neighbour: Ints, weight: Floats, group: Ints, seen: Ints,
                   queue: Ints) -> tuple[int, int]:
    """Leave only the heaviest connected part of group `rest` in members[start:high]; the other
    parts join group `prefix`. Returns where the rest now begins, and the next sweep number."""
    first = sweep
    best, heaviest, best_sweep = -1, -1.0, -1
    for index in range(start, high):
        cell = int(members[index])
        if seen[cell] >= first:
            continue
        reached = _search(cell, rest, sweep, neighbour, group, seen, queue)
        heavy = float(weight[queue[:reached]].sum())
        if heavy > heaviest:
            best, heaviest, best_sweep = cell, heavy, sweep
        sweep += 1
    if sweep == first + 1:
        return start, sweep
    for index in range(start, high):
        if seen[members[index]] != best_sweep:
            group[members[index]] = prefix
    reached = _search(best, rest, sweep, neighbour, group, seen, queue)
    sweep += 1
    middle = low
    for index in range(low, high):
        if group[members[index]] == prefix:
            members[middle] = members[index]
            middle += 1
    members[middle:high] = queue[:reached]
    return middle, sweep
