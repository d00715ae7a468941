"""Which triangle, or tetrahedron, belongs to which piece?

A scene's `fracture` names a method. With `first`, the body is cut twice, as in the thesis' scenes:
first in a few parts (a head from a body), then one of those parts into all other pieces.
"""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from partition.bfs import PartitionError, break_up
from partition.cut import CutMade
from partition.graph import Ints, neighbours
from partition.half_list import half_list
from partition.mesh import Mesh
from solver.scene_body import Cut, Fracture

Floats = NDArray[np.float64]
Point = tuple[float, float, float]


class Breakable(Protocol):
    """A body of n cells of some size (n,) and centre (n, 3)."""

    size: Floats
    centres: Floats

    def part(self, members: Ints) -> "Breakable":
        """The body of some of its cells."""

    def cut(self, wanted: Cut, pieces: int, near: Floats | None,
            comm: Any) -> tuple[Ints, list[CutMade]]:
        """(n,) the piece of each cell, and the spectral cuts made; `near` (n,) is the distance
        from where the search is to start; raises PartitionError."""


class Sheet:
    """A surface, as something that can be broken: its cells are triangles."""

    def __init__(self, mesh: Mesh):
        self.mesh = mesh
        self.size, self.centres = mesh.areas, mesh.centres

    def part(self, members: Ints) -> "Sheet":
        """The surface of some of the triangles."""
        return Sheet(self.mesh.part(members))

    def cut(self, wanted: Cut, pieces: int, near: Floats | None,
            comm: Any) -> tuple[Ints, list[CutMade]]:
        """(f,) the piece of each triangle; raises PartitionError."""
        mesh = self.mesh
        if wanted.method == "spectral":
            from partition.divide import divide     # loads PETSc and SLEPc

            return divide(mesh, wanted, pieces, comm)
        if wanted.order == "half_list":
            if pieces > len(mesh.faces):
                raise PartitionError(f"pieces = {pieces}: more than the {len(mesh.faces)} "
                                     "triangles there are; fix: a finer mesh")
            return half_list(mesh.faces, pieces), []
        size = self.size if wanted.mass == "area" else np.ones(len(self.size))
        return break_up(neighbours(mesh.twin), size, pieces, mesh.components, near), []


def labels(body: Breakable, wanted: Fracture, detonation: Point,
           comm: Any = None) -> tuple[Ints, list[CutMade]]:
    """(n,) the piece of each cell, and the spectral cuts made; raises PartitionError.

    comm is an mpi4py communicator whose ranks all call this, or None for this process alone.
    """
    if wanted.first is None:
        return _cut(body, wanted, wanted.pieces, detonation, comm)
    label, made = _cut(body, wanted.first, wanted.first.pieces, detonation, comm)
    chosen = _chosen(body, label, wanted, detonation)
    members = np.flatnonzero(label == chosen)
    finer, more = _cut(body.part(members), wanted, wanted.pieces - wanted.first.pieces + 1,
                       detonation, comm)
    label = label - (label > chosen)
    label[members] = wanted.first.pieces - 1 + finer
    return label, made + more


def _chosen(body: Breakable, label: Ints, wanted: Fracture, detonation: Point) -> int:
    """The part that is broken further."""
    if wanted.side == "detonation":
        return int(label[np.argmin(_distances(body, detonation))])
    size = np.bincount(label, body.size)
    return int(np.argmin(size) if wanted.side == "smallest" else np.argmax(size))


def _cut(body: Breakable, wanted: Cut, pieces: int, detonation: Point,
         comm: Any) -> tuple[Ints, list[CutMade]]:
    near = _distances(body, detonation) if wanted.root == "detonation" else None
    return body.cut(wanted, pieces, near, comm)


def _distances(body: Breakable, point: Point) -> Floats:
    """(n,) from the centre of each cell."""
    distance: Floats = np.linalg.norm(body.centres - point, axis=1)
    return distance
