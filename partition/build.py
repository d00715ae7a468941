"""How do the bodies of a scene become pieces?

Each body is made, or its mesh read, placed in the scene, and broken there. Panes give solid pieces;
other bodies give what their `interior` says: sheets (closed only where a whole mesh is), shells of
some thickness, or solid pieces.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition import shapes
from partition.cut import CutMade
from partition.extrude import Surfaces, extrude, sheets, shells
from partition.fracture import Point, Sheet, labels
from partition.fragments import Fragments
from partition.generated import NAMES, generated
from partition.graph import Ints, twins
from partition.mesh import Mesh
from partition.read import read_surface
from partition.repair import repaired
from partition.shared import ERRORS, Surface, shared_mesh
from solver.scene import Scene
from solver.scene_body import Body, Fracture

Floats = NDArray[np.float64]


class BuildError(Exception):
    """Bodies that cannot be built; the message is one line for the user."""


@dataclass(frozen=True)
class Broken:
    """The pieces of one body, in the scene; all of them closed or all open; the spectral cuts that
    made them, the mesh that was broken (None for a pane), and how it was filled."""

    name: str
    surfaces: Surfaces
    closed: bool
    cuts: tuple[CutMade, ...] = ()
    mesh: Mesh | None = None
    filling: str = ""


def build(scene: Scene) -> Fragments:
    """The pieces of all bodies of a scene; raises BuildError."""
    return assemble(break_all(scene))


def break_all(scene: Scene, comm: Any = None) -> list[Broken]:
    """Make, break and place every body of a scene; raises BuildError."""
    if not scene.body:
        raise BuildError(f"{scene.path}: body: missing; fix: add a [[body]] table, there is "
                         "nothing to partition")
    broken = []
    for index, body in enumerate(scene.body):
        try:
            broken.append(_pane(body, scene, comm) if body.shape == "pane" else
                          _body(body, scene, comm))
        except ERRORS as error:
            raise BuildError(f"{scene.path}: body.{index} = {body.name!r}: {error}") from None
    return broken


def break_mesh(path: Path, body: Body, comm: Any = None) -> Broken:
    """Break one mesh, a file or a generated one, where it stands; raises BuildError."""
    try:
        name = str(path)
        whole = shared_mesh(lambda: generated(name) if name in NAMES else read_surface(path), name,
                            comm)
        return _break(body, whole, (0.0, 0.0, 0.0), comm)
    except ERRORS as error:
        raise BuildError(str(error)) from None


def read_mesh(path: Path) -> Mesh:
    """A mesh file, checked and repaired."""
    return repaired(*read_surface(path), str(path))


def assemble(broken: Sequence[Broken]) -> Fragments:
    """All pieces in one set of arrays, sorted by piece, the bodies in the order given."""
    pieces, faces, vertices, behind, body, closed = [], [], [], [], [], []
    first_piece, first_vertex = 0, 0
    for number, part in enumerate(broken):
        surfaces = part.surfaces
        count = int(surfaces.piece.max()) + 1
        owner = np.empty(len(surfaces.vertices), dtype=np.int64)
        owner[surfaces.faces] = surfaces.piece[:, None]
        order = np.argsort(owner, kind="stable")
        rank = np.empty(len(owner), dtype=np.int64)
        rank[order] = np.arange(len(owner))
        vertices.append(surfaces.vertices[order])
        by_piece = np.argsort(surfaces.piece, kind="stable")
        faces.append(rank[surfaces.faces[by_piece]] + first_vertex)
        neighbour = surfaces.neighbour[by_piece]
        behind.append(np.where(neighbour < 0, neighbour, neighbour + first_piece))
        pieces.append(np.stack([np.bincount(owner, minlength=count),
                                np.bincount(surfaces.piece, minlength=count)], axis=1))
        body.append(np.full(count, number))
        closed.append(np.full(count, part.closed))
        first_piece += count
        first_vertex += len(owner)
    starts = np.vstack([[0, 0], np.cumsum(np.concatenate(pieces), axis=0)]).astype(np.int32)
    return Fragments(
        vertices=np.concatenate(vertices), faces=np.concatenate(faces).astype(np.int32),
        face_neighbour=np.concatenate(behind).astype(np.int32),
        vertex_start=starts[:, 0], face_start=starts[:, 1],
        body=np.concatenate(body).astype(np.int32), closed=np.concatenate(closed),
        names=tuple(part.name for part in broken))


def _pane(body: Body, scene: Scene, comm: Any) -> Broken:
    from partition import triangulate       # loads Qhull
    from partition.pane import pane_points, rectangle

    stream = _stream("pane", body.name, scene.seed)
    width, height, thickness = body.size
    outline = np.array(body.outline) * (width, height) if body.outline else \
        rectangle(width, height)
    # placing moves the middle of the outline's bounding box to the origin
    outline = outline - (outline.min(axis=0) + outline.max(axis=0)) / 2
    impact = (np.array(scene.detonation.position) - body.place) @ shapes.rotation(body.rotate)
    points = pane_points(outline, body.points, stream, body.sampling,
                         (impact[0] / body.scale, impact[1] / body.scale))
    triangles = getattr(triangulate, body.triangulation)(points)
    label, cuts = _whole(len(triangles))
    if body.fracture is not None:
        placed = _placed(np.column_stack([points, np.zeros(len(points))]), body)
        sheet = Sheet(Mesh(placed, triangles, twins(triangles)))
        label, cuts = labels(sheet, body.fracture, scene.detonation.position, comm)
    solid = extrude(points, triangles, label, thickness)
    return Broken(body.name, replace(solid, vertices=_placed(solid.vertices, body)), True,
                  tuple(cuts))


def _body(body: Body, scene: Scene, comm: Any) -> Broken:
    folder = scene.path.parent
    name = str(folder / body.mesh) if _is_file(body) else body.name
    surface = shared_mesh(lambda: _surface(body, folder), name, comm)
    placed = replace(surface, vertices=_placed(surface.vertices, body))
    return _break(body, placed, scene.detonation.position, comm, scene.seed)


def _is_file(body: Body) -> bool:
    return body.shape == "mesh" and body.mesh not in NAMES


def _surface(body: Body, folder: Path) -> Surface:
    if body.shape == "mesh":
        return read_surface(folder / body.mesh) if _is_file(body) else generated(body.mesh)
    return shapes.box(body.size, body.detail) if body.shape == "box" else \
        shapes.sphere(body.radius, body.detail)


def _stream(purpose: str, name: str, seed: int) -> np.random.Generator:
    """Random numbers of one purpose for one body."""
    return np.random.default_rng([seed, zlib.crc32(f"{purpose} {name}".encode())])


def _whole(count: int) -> tuple[Ints, list[CutMade]]:
    """Nothing is cut."""
    return np.zeros(count, dtype=np.int64), []


def _placed(vertices: Floats, body: Body) -> Floats:
    return shapes.place(vertices, body.scale, body.rotate, body.place)


def _break(body: Body, mesh: Mesh, detonation: Point, comm: Any, seed: int = 1) -> Broken:
    """Pieces of a mesh that stands where it belongs."""
    if body.interior == "solid" and body.fracture is not None:
        return _solid(body, mesh, body.fracture, detonation, comm, seed)
    label, cuts = _whole(len(mesh.faces))
    if body.fracture is not None:
        label, cuts = labels(Sheet(mesh), body.fracture, detonation, comm)
    if body.interior == "shell":
        return Broken(body.name, shells(mesh, label, body.skin), True, tuple(cuts), mesh)
    return Broken(body.name, sheets(mesh, label), bool(mesh.closed and label.max() == 0),
                  tuple(cuts), mesh)


def _solid(body: Body, mesh: Mesh, wanted: Fracture, detonation: Point, comm: Any,
           seed: int) -> Broken:
    from partition import relief, solid, tetrahedra     # load Qhull

    filled = tetrahedra.fill(mesh, body.name)
    label, cuts = labels(solid.Solid(filled), wanted, detonation, comm)
    filling = (f"filled with {len(filled.cells)} tetrahedra, volume {filled.volumes.sum():.6g} "
               f"instead of {mesh.volume:.6g}")
    if body.grain == "smooth":
        filled = relief.smooth(filled, label)
    elif body.grain == "rough":
        filled = relief.rough(filled, label, _stream("grain", body.name, seed))
    return Broken(body.name, solid.skins(filled, label), True, tuple(cuts), mesh, filling)
