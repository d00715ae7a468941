"""Soot appears where fuel has burnt.

A fuel particle whose soot reaches the threshold c_soot makes one soot particle, once, of the mass
that the fuel particle had at first (the thesis); with `repeat` it makes one of mass c_soot for
every c_soot. The new particle has its parent's velocity and temperature, and stands within
± perturbation cells of it. Its random numbers follow from its id, so no rank count or order of
particles changes them.
"""

import numpy as np
from numpy.typing import NDArray

from solver.hashing import uniform_at
from solver.scene_physics import Fuel, Soot
from solver.swarm import SOOT, Swarm

PLACE_STREAM = 12


def bear_soot(swarm: Swarm, fuel: Fuel, soot: Soot, seed: int) -> None:
    """Make the soot particles that are due; `settle` must follow, they may stand on any rank."""
    points = swarm.points
    due = np.flatnonzero(points["soot_due"])
    if len(due) == 0:
        return
    number = points["soot_due"][due]
    born = points[np.repeat(due, number)].copy()
    child = np.arange(len(born)) - np.repeat(np.cumsum(number) - number, number)
    born["id"] += 1 + born["soot_made"] + child
    points["soot_made"][due] += number
    points["soot_due"][due] = 0
    born["position"] += soot.perturbation * shift(seed, born["id"]) * swarm.grid.spacing
    born["mass"] = soot.threshold if soot.repeat else fuel.mass
    born["kind"] = SOOT
    for unused in ("ignited", "soot", "soot_due", "soot_made"):
        born[unused] = 0
    swarm.append(born)


def shift(seed: int, identity: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, 3) uniform in [-1, 1), a function of the particle's id."""
    key = np.uint64(3) * identity.astype(np.uint64)[:, None] + np.arange(3, dtype=np.uint64)
    return 2 * uniform_at(seed, PLACE_STREAM, key) - 1
