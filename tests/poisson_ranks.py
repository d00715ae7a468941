"""Run by tests/test_flow_transform.py on any number of ranks: the largest error of the inverse of
the Laplacian alone, over mixtures of faces, against what the assembled 7-point operator says.

    mpirun -n N python -m tests.poisson_ranks
"""

import itertools

import numpy as np

from solver.grid import Grid
from solver.poisson import InverseLaplacian
from tests.flow_case import COMM, faces, make_scene
from tests.test_flow_transform import PAIRS, assembled

CELLS, SIZE = (6, 13, 15), (1.0, 0.8, 1.7)


def main() -> None:
    """-∇²p must give back r less its mean, if no face is open."""
    worst = 0.0
    r = np.random.default_rng(7).standard_normal(tuple(reversed(CELLS)))
    for pairs in itertools.product(PAIRS, repeat=3):
        grid = Grid(make_scene(CELLS, faces(*itertools.chain(*pairs)), SIZE).domain, COMM)
        inverse = InverseLaplacian(grid)
        here = tuple(slice(s, s + n) for s, n in zip(reversed(grid.start), reversed(grid.count),
                                                     strict=True))
        mine = np.empty(tuple(reversed(grid.count)))
        inverse.solve(np.ascontiguousarray(r[here]), mine)
        p = np.zeros(r.shape)
        for there, values in COMM.allgather((here, mine)):
            p[there] = values
        closed = not any("open" in pair for pair in pairs)
        defect = assembled(CELLS, SIZE, pairs) @ p.ravel() - (r - r.mean() * closed).ravel()
        worst = max(worst, np.abs(defect).max(), abs(p.mean()) if closed else 0.0)
        inverse.destroy()
        grid.destroy()
    if COMM.rank == 0:
        print(f"largest error {worst:.3g}")


if __name__ == "__main__":
    main()
