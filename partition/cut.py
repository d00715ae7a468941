"""Where along an eigenvector is a surface cut in two?

Every triangle has a value; the triangles up to a threshold are one side. The threshold is

sign    0 (what is 0 up to rounding counts as positive), as in the thesis
median  where both sides weigh as much as the pieces they are to become
sweep   of all thresholds that leave a tenth of the weight on either side, the one with the least
        (cost of the links cut) / (weight of the lighter side), the Cheeger ratio

and stands only where successive values differ by more than rounding, so that the same surface is
cut alike however it was turned, numbered or distributed. Sides that are not connected are then
mended: all but the heaviest part of a side go over to the other, which they touch.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.graph import Ints, numbered, union

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
GAP = 1e-7          # of the largest value: closer ones are not told apart
ZERO = 1e-8         # of the largest value
LEAST = 0.1         # of the weight, on the lighter side of a sweep
TIE = 1e-6          # relative: ratios closer than this are equal, the first threshold wins


@dataclass(frozen=True)
class CutMade:
    """One cut: triangles before, of its smaller side, length, lambda_2, lambda_3 / lambda_2,
    residual relative to lambda_2, iterations, seconds."""

    triangles: int
    smaller: int
    length: float
    eigenvalue: float
    ratio: float
    residual: float
    iterations: int
    seconds: float


def sign(values: Floats) -> Bools:
    """(n,) whether each triangle is on the negative side."""
    negative: Bools = values < -ZERO * abs(values).max()
    return negative


def median(values: Floats, weight: Floats, fraction: float) -> Bools:
    """(n,) the side of the low values, with about `fraction` of the weight."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order])[:-1] / weight.sum()
    allowed = _distinct(values[order])
    return _up_to(order, int(np.argmin(np.where(allowed, abs(below - fraction), np.inf))))


def sweep(values: Floats, weight: Floats, a: Ints, b: Ints, cost: Floats) -> Bools:
    """(n,) the side of the low values at the threshold of the least Cheeger ratio; `cost` (e,) is
    that of cutting the link a-b."""
    order = np.argsort(values, kind="stable")
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    cut = _cut_costs(place, a, b, cost)
    below = np.cumsum(weight[order])[:-1]
    lighter = np.minimum(below, weight.sum() - below)
    least = min(LEAST * weight.sum(), lighter.max())
    allowed = _distinct(values[order]) & (lighter >= least * (1 - TIE))
    if not np.any(allowed):
        allowed = _distinct(values[order])
    ratio = np.where(allowed, cut / lighter, np.inf)
    return _up_to(order, int(np.argmax(ratio <= ratio.min() * (1 + TIE))))


@njit(cache=True)
def _cut_costs(place: Ints, a: Ints, b: Ints, cost: Floats) -> Floats:
    """(n - 1,) what a cut behind each place costs: links that it runs between the ends of."""
    change = np.zeros(len(place))
    for link in range(len(a)):
        here, there = place[a[link]], place[b[link]]
        change[min(here, there)] += cost[link]
        change[max(here, there)] -= cost[link]
    return np.cumsum(change)[:-1]


def mend(side: Bools, weight: Floats, a: Ints, b: Ints) -> Bools:
    """(n,) sides that are both connected, as long as the whole is; raises ValueError if a side is
    empty."""
    if side.all() or not side.any():
        raise ValueError("one side of the cut is empty")
    for one in (True, False):
        part = _parts(side, a, b)
        if part.max() == 1:     # each side hangs together
            break
        heaviest = np.argmax(np.bincount(part, np.where(side == one, weight, 0)))
        side = np.where((side == one) & (part != heaviest), not one, side)
    return side


def _parts(side: Bools, a: Ints, b: Ints) -> Ints:
    """(n,) numbers of the connected parts of both sides."""
    same = side[a] == side[b]
    return numbered(union(len(side), a[same], b[same]))


def _distinct(ascending: Floats) -> Bools:
    """(n - 1,) whether a threshold can stand behind each value."""
    gaps = np.diff(ascending)
    apart: Bools = gaps > GAP * abs(ascending).max()
    return apart if np.any(apart) else gaps >= gaps.max()


def _up_to(order: Ints, last: int) -> Bools:
    side = np.zeros(len(order), dtype=bool)
    side[order[:last + 1]] = True
    return side
