"""How does a surface come apart along its weakest lines, into exactly m pieces?

Recursively (the thesis' Algorithm 6): the Fiedler vector of the part's graph, a cut along it, and
the number of pieces shared out between the two sides by what they weigh. Parts that hang together
nowhere are told apart before any eigenproblem.

Where the smallest eigenvalue is (nearly) multiple, as on a sphere, any vector of its space would
do, and the solver's choice would depend on rounding. The vector taken is the one closest to the
coordinate along the longest axis of the part; its sign is such that its cube has a positive mean,
or else that it grows along that axis.
"""

import logging
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition import cut
from partition.bfs import PartitionError, share_out
from partition.graph import Ints
from partition.mesh import Mesh
from partition.spectral import Modes, SpectralError, modes
from partition.weights import Graph, dihedral_graph, thesis_graph
from solver.scene_body import Cut

Floats = NDArray[np.float64]
LOG = logging.getLogger(__name__)
LONG = 1.0              # seconds; longer cuts are announced
MULTIPLE = 1e-3         # eigenvalues closer than this, relative, are one
CLUSTER = 6             # modes looked at where the smallest is multiple
HIDDEN = 1e-6           # a projection below this, relative, is 0
SYMMETRIC = 1e-3        # a mean cube below this, relative, is 0


def divide(mesh: Mesh, wanted: Cut, pieces: int,
           comm: Any = None) -> tuple[Ints, list[cut.CutMade]]:
    """(f,) the piece of each triangle of a mesh, and how it was cut; raises PartitionError.

    With a communicator all its ranks call this, with the same mesh, and share the eigenproblems.
    """
    surface = dihedral_graph(mesh, wanted.mass, comm)
    size = mesh.areas if wanted.mass == "area" else np.ones(len(mesh.faces))
    parts = mesh.components
    if not int(parts.max()) < pieces <= len(parts):
        raise PartitionError(f"pieces = {pieces}: the body has {int(parts.max()) + 1} separate "
                             f"parts and {len(parts)} triangles; fix: a number between them")
    shares = share_out(pieces, np.bincount(parts, size).astype(np.float64), np.bincount(parts))
    stack = [(np.flatnonzero(parts == part), int(share)) for part, share in enumerate(shares)]
    label, made, piece = np.empty(len(parts), dtype=np.int64), [], 0
    stack.reverse()
    while stack:
        members, k = stack.pop()
        if k == 1:
            label[members] = piece
            piece += 1
            continue
        began = time.perf_counter()
        graph = induced(surface, members)
        side, found = _two_sides(mesh, members, graph, size[members], wanted, k, comm)
        heavier = side if size[members] @ side * 2 >= size[members].sum() else ~side
        both = [members[heavier], members[~heavier]]
        made.append(_record(graph, side, found, time.perf_counter() - began))
        if made[-1].seconds > LONG:
            LOG.info("cut %d: %d triangles in %.1f s", len(made), len(members), made[-1].seconds)
        share = share_out(k, np.array([size[one].sum() for one in both], dtype=np.float64),
                          np.array([len(one) for one in both]))
        stack += [(both[1], int(share[1])), (both[0], int(share[0]))]
    return label, made


def induced(graph: Graph, members: Ints) -> Graph:
    """The graph between some nodes, ascending, which are renumbered."""
    if len(members) == len(graph.mass):
        return graph
    number = np.full(len(graph.mass), -1, dtype=np.int64)
    number[members] = np.arange(len(members))
    inside = (number[graph.a] >= 0) & (number[graph.b] >= 0)
    return Graph(graph.mass[members], number[graph.a[inside]], number[graph.b[inside]],
                 graph.weight[inside], graph.length[inside], graph.cost[inside])


def _two_sides(mesh: Mesh, members: Ints, graph: Graph, size: Floats, wanted: Cut, k: int,
               comm: Any) -> tuple[cut.Bools, Modes]:
    """(n,) the side of each member, both connected, and the modes they come from."""
    nodes, faces, places = graph, None, mesh.centres[members]
    if wanted.weights == "thesis":
        part = mesh.part(members)
        nodes, faces, places = thesis_graph(part, wanted.mass), part.faces, part.vertices
    try:
        found = modes(nodes, 1, comm)
        if found.next_value <= found.values[0] * (1 + 2 * MULTIPLE):
            found = modes(nodes, min(CLUSTER, len(nodes.mass) - 1), comm)
    except SpectralError as error:
        raise PartitionError(str(error)) from None
    vector = fiedler_vector(found, nodes.mass, places)
    side = np.zeros(len(members), dtype=bool)
    values = vector if faces is None else vector[faces].mean(axis=1)
    if wanted.cut == "sign":
        side = cut.sign(values) if faces is None else \
            cut.sign(vector)[faces].sum(axis=1) >= 2
    elif wanted.cut == "median":
        side = cut.median(values, size, (k // 2) / k)
    if wanted.cut == "sweep" or side.all() or not side.any():
        side = cut.sweep(values, size, graph.a, graph.b, graph.cost)
    return cut.mend(side, size, graph.a, graph.b), found


def fiedler_vector(found: Modes, mass: Floats, places: Floats) -> Floats:
    """(n,) one vector of the slowest modes, the same however the surface is turned or numbered;
    `places` (n, 3) is where the nodes are."""
    along = _along_longest_axis(mass, places)
    space = found.vectors[:, :_multiple(found)]
    vector = space[:, 0]
    if space.shape[1] > 1:
        inside = space @ (space.T @ (mass * along))
        vector = inside if abs(inside).max() > HIDDEN * abs(along).max() else vector
    cube = mass @ (vector * vector * vector)    # ** 3 is twenty times slower
    if abs(cube) <= SYMMETRIC * (mass @ (vector * vector * abs(vector))):
        cube = mass @ (vector * along)
    return vector if cube >= 0 else -vector


def _multiple(found: Modes) -> int:
    """How many of the modes share the smallest eigenvalue."""
    return int(np.count_nonzero(found.values <= found.values[0] * (1 + MULTIPLE)))


def _along_longest_axis(mass: Floats, places: Floats) -> Floats:
    """(n,) coordinate from the centre along the axis of largest inertia; the first of x, y, z that
    lies in the space of such axes decides where there are several."""
    offset = places - (mass @ places) / mass.sum()
    values, axes = np.linalg.eigh((mass[:, None] * offset).T @ offset)
    space = axes[:, values >= values[-1] * (1 - MULTIPLE)]
    shadow = space @ space.T        # x, y and z projected into that space are its columns
    along = offset @ shadow[:, int(np.argmax(np.linalg.norm(shadow, axis=0) > 0.5))]
    cube = mass @ (along * along * along)
    skewed = abs(cube) > SYMMETRIC * (mass @ (along * along * abs(along)))
    return -along if skewed and cube < 0 else along


def _record(graph: Graph, side: cut.Bools, found: Modes, seconds: float) -> cut.CutMade:
    crossing = side[graph.a] != side[graph.b]
    after = found.values[1] if len(found.values) > 1 else found.next_value
    return cut.CutMade(
        triangles=len(side), smaller=int(min(side.sum(), (~side).sum())),
        length=float(graph.length[crossing].sum()), eigenvalue=float(found.values[0]),
        ratio=float(after / found.values[0]), residual=float(found.residuals[0]),
        iterations=found.iterations, seconds=seconds)
