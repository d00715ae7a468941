"""`mpirun -n N python -m tests.wanderers`: particles cross ranks at random, for 1000 steps.

Each particle steps by up to three cells per axis, as a function of its id and the step alone; some
start on cell faces, in corners and exactly on the box, and all of them in one corner of it, so that
some ranks own none at first. Every 50 steps the particles of all ranks are compared with the same
walk made by numpy. Prints "same" or what differs, from rank 0.
"""

import sys

import numpy as np
from mpi4py import MPI

from solver.grid import Grid
from solver.hashing import uniform_at
from solver.scene_physics import Domain
from solver.swarm import PARTICLE, Swarm, owners

COMM = MPI.COMM_WORLD
COUNT, STEPS, STREAM = 300, 1000, 99
CELLS, SIZE = (5, 9, 8), (1.0, 2.0, 1.5)
SPACING = np.array(SIZE) / CELLS


def jumps(identity, step):
    """(n, 3) in cells, within ± 3; every fourth is whole, so that faces are hit exactly."""
    key = np.uint64(3) * identity.astype(np.uint64)[:, None] + np.arange(3, dtype=np.uint64)
    jump = 6 * uniform_at(1, STREAM, key + np.uint64(2**20 * step)) - 3
    return np.where(identity[:, None] % 4 == 0, np.round(jump), jump)


def reflected(position):
    """Back into the box, so that none is lost; what lands on the far face stays there."""
    position = np.abs(position)
    return np.where(position > SIZE, 2 * np.array(SIZE) - position, position)


def walk(boundary):
    """What went wrong, or ""."""
    grid = Grid(Domain(cells=CELLS, size=SIZE, boundary=boundary), COMM)
    swarm = Swarm(grid)
    everyone = np.zeros(COUNT, PARTICLE)
    everyone["id"] = np.arange(COUNT)
    everyone["mass"] = 1.0
    everyone["position"] = jumps(everyone["id"], 0) % 1 * SPACING
    swarm.append(everyone[:COUNT if COMM.rank == 0 else 0])
    expected = everyone["position"].copy()
    swarm.settle()
    problem = ""
    for step in range(1, STEPS + 1):
        points = swarm.points
        moved = points["position"] + jumps(points["id"], step) * SPACING
        points["position"] = moved if boundary == "periodic" else reflected(moved)
        swarm.settle()
        expected += jumps(everyone["id"], step) * SPACING
        expected = expected % SIZE if boundary == "periodic" else reflected(expected)
        if step % 50 == 0 and not problem:
            problem = compare(swarm, grid, expected, step, boundary)
    swarm.destroy()
    grid.destroy()
    return problem


def compare(swarm, grid, expected, step, boundary):
    """What differs from the expected positions, or ""; the same on all ranks."""
    points = np.concatenate(COMM.allgather(swarm.points.copy()))
    strays = COMM.allreduce(int((owners(grid, swarm.points["position"]) != COMM.rank).sum()))
    points = points[np.argsort(points["id"])]
    if not np.array_equal(points["id"], np.arange(COUNT)):
        return f"step {step}: {len(points)} particles of {COUNT}"
    gap = np.abs(points["position"] - expected)
    if boundary == "periodic":
        gap = np.minimum(gap, np.array(SIZE) - gap)
    if gap.max() > 1e-9 or strays:
        return f"step {step}: {gap.max()} away, {strays} on a rank that does not own them"
    return ""


if __name__ == "__main__":
    problems = [f"{boundary}: {walk(boundary)}" for boundary in ("wall", "periodic")]
    if COMM.rank == 0:
        print("same" if problems == ["wall: ", "periodic: "] else "; ".join(problems))
    sys.exit(0)
