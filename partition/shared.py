"""How does every rank get a mesh that is read once?

The last rank reads it and welds its vertices, the first repairs the rest and hands it to all;
meanwhile each loads the compiled functions that it is going to need, which takes as long as their
work on several hundred thousand triangles. Whatever goes wrong is raised on all ranks.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition.bfs import PartitionError
from partition.extrude import sheets
from partition.graph import NO_TWIN, Ints
from partition.mesh import Mesh, MeshError
from partition.repair import joined, repaired, welded
from partition.rows import adjacency, breadth_first, rows, times
from partition.weights import dihedral_graph

Surface = tuple[NDArray[np.float64], Ints]
ERRORS = (PartitionError, MeshError)


def shared_mesh(read: Callable[[], Surface], name: str, comm: Any = None) -> Mesh:
    """The mesh of the vertices (v, 3) and faces (f, 3) that `read` gives, checked and repaired;
    raises MeshError or PartitionError. All ranks of `comm` (None: this process) call this."""
    if comm is None or comm.size == 1:
        return repaired(*read(), name)
    last, found = comm.size - 1, None
    if comm.rank == last:
        comm.send(_tried(lambda: welded(*read(), name)), 0)
        _load_weighing()
    elif comm.rank == 0:
        _load_repairing()
        found = comm.recv(source=last)
        if not isinstance(found, Exception):
            vertices, faces, notes = found
            found = _tried(lambda: joined(vertices, faces, notes, name))
    else:
        _load_weighing()
    found = comm.bcast(found)
    if isinstance(found, Exception):
        raise found
    assert isinstance(found, Mesh)
    return found


def _tried(make: Callable[[], Any]) -> Any:
    """What is made, or the error."""
    try:
        return make()
    except ERRORS as error:
        return error


def _load_repairing() -> None:
    corners = np.vstack([np.zeros(3), np.eye(3)])
    repaired(corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), "corner")


def _load_weighing() -> None:
    triangle = Mesh(np.eye(3), np.array([[0, 1, 2]]), np.full(3, NO_TWIN))
    graph = dihedral_graph(triangle, "area")
    linked = adjacency(1, graph.a, graph.b, graph.weight)
    rows(*linked, breadth_first(*linked[:2]), 0, 1)
    times(graph.a, graph.b, graph.weight, graph.mass)
    sheets(triangle, triangle.components)
