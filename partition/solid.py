"""How does a closed body break into closed pieces?

The body is filled with tetrahedra and these are shared out between the pieces: by breadth-first
search of the tetrahedra themselves, or by cutting the surface along its weak lines and giving
every tetrahedron to the piece of the surface that is nearest through its neighbours. The surface
of a piece is the faces between its tetrahedra and others, so two pieces meet in the very same
triangles, every piece is closed, and the volumes add up to that of the body.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from partition.bfs import PartitionError, break_up
from partition.cut import CutMade
from partition.extrude import Surfaces
from partition.fragments import NO_NEIGHBOUR
from partition.graph import NO_TWIN, Ints, numbered, separate, sides, union
from partition.measure import triangle_areas
from partition.mesh import Mesh
from partition.radial import part_edges
from partition.recover import FACES
from partition.tetrahedra import Tetrahedra
from solver.scene_body import Cut

Floats = NDArray[np.float64]
MENDING_SWEEPS = 100
EVENING_SWEEPS = 30


class Solid:
    """A body of tetrahedra, as something that `partition.fracture` can break."""

    def __init__(self, tetrahedra: Tetrahedra):
        self.tetrahedra = tetrahedra
        self.size = tetrahedra.volumes
        self.centres = tetrahedra.centres

    def part(self, members: Ints) -> "Solid":
        """The body of some of the tetrahedra."""
        return Solid(self.tetrahedra.part(members))

    def cut(self, wanted: Cut, pieces: int, near: Floats | None,
            comm: Any) -> tuple[Ints, list[CutMade]]:
        """(t,) the piece of each tetrahedron; raises PartitionError."""
        body = self.tetrahedra
        if wanted.method == "spectral":
            faces, cell = body.surface()
            twin = part_edges(body.vertices, faces, "surface", [])
            faces, original = separate(faces, twin)
            skin = Mesh(body.vertices[original], faces, twin)
            from partition.divide import divide     # loads PETSc and SLEPc

            label, made = divide(skin, wanted, pieces, comm)
            return evened(body, extended(body, label, cell, pieces), pieces), made
        size = self.size if wanted.mass == "area" else np.ones(len(self.size))
        return evened(body, break_up(body.neighbour, size, pieces, body.components, near),
                      pieces), []


def extended(body: Tetrahedra, label: Ints, cell: Ints, pieces: int) -> Ints:
    """(t,) labels of all tetrahedra from those of the surface triangles (f,) before `cell` (f,).

    Each piece is made connected: lost parts go to the neighbour they share most faces with.
    """
    found = np.full(len(body.cells), -1, dtype=np.int64)
    # where a tetrahedron has several outer faces the lowest label has it
    order = np.argsort(-label, kind="stable")
    found[cell[order]] = label[order]
    while np.any(found < 0):
        best = _commonest(found[body.neighbour] * (body.neighbour >= 0) - (body.neighbour < 0))
        grown = np.where(found < 0, best, found)
        if np.array_equal(grown, found):
            raise PartitionError("a part of the body has no surface; fix: mend the mesh")
        found = grown
    found = _mended(body, found)
    if len(np.unique(found)) < pieces:
        raise PartitionError(f"pieces = {pieces}: some are thinner than the tetrahedra of the "
                             "body; fix: fewer pieces, or method = \"bfs\"")
    return found


def evened(body: Tetrahedra, label: Ints, pieces: int) -> Ints:
    """(t,) labels with fewer jags: tetrahedra that have more area in common with another piece than
    with their own go over to it, until none is left or some sweeps are over."""
    flat = body.cells[:, FACES].reshape(-1, 3)
    area = triangle_areas(body.vertices, flat).reshape(-1, 4)
    better = label.copy()
    _go_over(body.neighbour, area, better, EVENING_SWEEPS)
    better = _mended(body, better)
    whole = len(np.unique(better)) == pieces and not np.any(_lost(body, better))
    return better if whole else label


@njit(cache=True)
def _go_over(neighbour: Ints, area: Floats, label: Ints, sweeps: int) -> None:
    """In place; the area between pieces falls with every change."""
    for _ in range(sweeps):
        changes = 0
        for t in range(len(label)):
            best, most = label[t], 0.0
            for side in range(4):
                other = neighbour[t, side]
                if other < 0 or label[other] == best:
                    continue
                gain = 0.0
                for again in range(4):
                    beyond = neighbour[t, again]
                    if beyond >= 0 and label[beyond] == label[other]:
                        gain += area[t, again]
                    elif beyond >= 0 and label[beyond] == label[t]:
                        gain -= area[t, again]
                if gain > most:
                    best, most = label[other], gain
            if best != label[t]:
                label[t] = best
                changes += 1
        if changes == 0:
            break


def _mended(body: Tetrahedra, label: Ints) -> Ints:
    """With pieces that are connected: lost parts go to the neighbour that is there most often."""
    for _ in range(MENDING_SWEEPS):
        lost = _lost(body, label)
        if not np.any(lost):
            break
        around = np.where((body.neighbour >= 0) & ~lost[body.neighbour], label[body.neighbour], -1)
        best = _commonest(around)
        label = np.where(lost & (best >= 0), best, label)
    return label


def _commonest(around: Ints) -> Ints:
    """(t,) the commonest non-negative label in each row of (t, 4), the lower of two; else -1."""
    count = (around[:, :, None] == around[:, None, :]).sum(axis=2)
    score = np.where(around >= 0, count * (around.max() + 2) - around, -1)
    return around[np.arange(len(around)), np.argmax(score, axis=1)]


def _lost(body: Tetrahedra, label: Ints) -> NDArray[np.bool_]:
    """(t,) tetrahedra outside the largest connected part of their piece."""
    cell, side = np.nonzero(body.neighbour != NO_TWIN)
    other = body.neighbour[cell, side]
    same = label[cell] == label[other]
    part = numbered(union(len(label), cell[same], other[same]))
    size = np.bincount(part, body.volumes)
    owner = np.empty(len(size), dtype=np.int64)
    owner[part] = label
    order = np.lexsort((size, owner))
    last = np.append(np.diff(owner[order]) != 0, True)
    largest = np.zeros(len(size), dtype=bool)
    largest[order[last]] = True
    outside: NDArray[np.bool_] = ~largest[part]
    return outside


def skins(body: Tetrahedra, label: Ints) -> Surfaces:
    """The closed surfaces of all pieces.

    Where a piece touches itself along an edge whose two ends it does not part, that edge is halved
    in all tetrahedra around it: the middle can then be given to either side.
    """
    while True:
        found, pinched = _skins(body, label)
        if len(pinched) == 0:
            return found
        body, label = _halved(body, label, pinched)


def _skins(body: Tetrahedra, label: Ints) -> tuple[Surfaces, Ints]:
    """Surfaces of all pieces, and the edges (e, 2) that some of them pass twice."""
    across = np.where(body.neighbour == NO_TWIN, NO_NEIGHBOUR, label[body.neighbour])
    cell, side = np.nonzero(across != label[:, None])
    order = np.argsort(label[cell], kind="stable")
    cell, side = cell[order], side[order]
    triangles = body.cells[cell[:, None], FACES[side]]
    piece = label[cell]
    vertices, faces, pinched, first = [], [], [np.zeros((0, 2), dtype=np.int64)], 0
    for number in range(int(label.max()) + 1):
        mine = triangles[piece == number]
        twin = part_edges(body.vertices, mine, f"piece {number}", [])
        own, original = separate(mine, twin)
        ends, count = np.unique(np.sort(sides(own), axis=1), axis=0, return_counts=True)
        pinched.append(original[ends[count > 2]])
        vertices.append(body.vertices[original])
        faces.append(own + first)
        first += len(original)
    return (Surfaces(np.concatenate(vertices), np.concatenate(faces), piece, across[cell, side]),
            np.unique(np.sort(np.concatenate(pinched), axis=1), axis=0))


def _halved(body: Tetrahedra, label: Ints, edges: Ints) -> tuple[Tetrahedra, Ints]:
    """Halve edges (e, 2) in all tetrahedra around them; those that share a tetrahedron with one
    halved before have to wait for the next call."""
    cells, vertices = body.cells, [body.vertices]
    busy = np.zeros(len(cells), dtype=bool)
    new_cells, new_labels, count = [], [], len(body.vertices)
    for low, high in edges:
        around = np.flatnonzero((cells == low).any(axis=1) & (cells == high).any(axis=1))
        if busy[around].any():
            continue
        busy[around] = True
        vertices.append(body.vertices[[low, high]].mean(axis=0, keepdims=True))
        for end in (low, high):
            new_cells.append(np.where(cells[around] == end, count, cells[around]))
            new_labels.append(label[around])
        count += 1
    return (Tetrahedra(np.concatenate(vertices), np.concatenate([cells[~busy], *new_cells])),
            np.concatenate([label[~busy], *new_labels]))
