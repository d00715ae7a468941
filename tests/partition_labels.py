"""`mpirun -n N python -m tests.partition_labels OUT NAME...`: meshes cut in two.

Their eigenproblems are shared between the ranks, however small they are; the last way gives the
factors so little work space at first that the solver has to ask for more.

NAME is a generated body or the path of a mesh; OUT.npz holds labels by NAME and solver.
"""

import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

from partition import spectral
from partition.build import read_mesh
from partition.divide import divide
from partition.figurines import GENERATED
from partition.repair import repaired
from solver.scene_body import Cut

WAYS = (("direct", 10**9, 100, "dihedral"), ("iterative", 1000, 100, "dihedral"),
        ("direct", 10**9, 100, "thesis"), ("cramped", 10**9, 1, "dihedral"))


def main(out: str, names: list[str]) -> None:
    spectral.ALONE = 0
    found = {}
    for name in names:
        mesh = repaired(*GENERATED[name](), name) if name in GENERATED else read_mesh(Path(name))
        for solver, spectral.DIRECT_LIMIT, spectral.ROOM, weights in WAYS:
            wanted = Cut.model_validate({"method": "spectral", "weights": weights})
            label, _ = divide(mesh, wanted, 2, MPI.COMM_WORLD)
            found[f"{Path(name).stem} {solver} {weights}"] = label
    every = MPI.COMM_WORLD.allgather({key: label.tobytes() for key, label in found.items()})
    assert all(other == every[0] for other in every), "ranks disagree"
    if MPI.COMM_WORLD.rank == 0:
        np.savez(out, **found)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
