"""How do the bodies of a scene become pieces?

Each body is made (or its mesh read), broken in its own coordinates, where a pane is flat and
shapes are exact, and its pieces are then placed in the scene. Panes give solid pieces; other
bodies are surfaces, whole ones closed where the mesh is, pieces of them open.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition import animal, mesh, shapes, triangulate
from partition.bfs import PartitionError, break_up
from partition.extrude import Surfaces, extrude, shells
from partition.fragments import Fragments
from partition.graph import Ints, components, neighbours, twins
from partition.measure import triangle_areas
from partition.pane import pane_points
from partition.read import read_surface
from partition.repair import repaired
from solver.scene import Scene
from solver.scene_body import Body, Fracture

Floats = NDArray[np.float64]
ERRORS = (PartitionError, mesh.MeshError, triangulate.TriangulationError)


class BuildError(Exception):
    """Bodies that cannot be built; the message is one line for the user."""


@dataclass(frozen=True)
class Broken:
    """The pieces of one body, in the scene; all of them closed or all open."""

    name: str
    surfaces: Surfaces
    closed: bool


def build(scene: Scene) -> Fragments:
    """The pieces of all bodies of a scene; raises BuildError."""
    if not scene.body:
        raise BuildError(f"{scene.path}: body: missing; fix: add a [[body]] table, there is "
                         "nothing to partition")
    broken = []
    for index, body in enumerate(scene.body):
        try:
            broken.append(break_body(body, scene.seed, scene.path.parent,
                                     scene.detonation.position))
        except ERRORS as error:
            raise BuildError(f"{scene.path}: body.{index} = {body.name!r}: {error}") from None
    return assemble(broken)


def build_mesh(path: Path, fracture: Fracture) -> Fragments:
    """The pieces of one mesh file, where it stands; raises BuildError."""
    try:
        whole = read_mesh(path)
        return assemble([_break_mesh(path.stem, whole, whole.vertices, fracture, (0.0, 0.0, 0.0))])
    except ERRORS as error:
        raise BuildError(str(error)) from None


def break_body(body: Body, seed: int, folder: Path,
               detonation: tuple[float, float, float]) -> Broken:
    """Make one body, break it and place it; a relative mesh path starts at `folder`."""
    if body.shape == "pane":
        return _pane(body, seed, detonation)
    surface = _surface(body, folder)
    vertices = shapes.place(surface.vertices, body.scale, body.rotate, body.place)
    return _break_mesh(body.name, surface, vertices, body.fracture, detonation)


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


def _pane(body: Body, seed: int, detonation: tuple[float, float, float]) -> Broken:
    stream = np.random.default_rng([seed, zlib.crc32(f"pane {body.name}".encode())])
    width, height, thickness = body.size
    points = pane_points(width, height, body.points, stream)
    triangles = getattr(triangulate, body.triangulation)(points)
    label = np.zeros(len(triangles), dtype=np.int64)
    if body.fracture is not None:
        flat = np.column_stack([points, np.zeros(len(points))])
        placed = shapes.place(flat, body.scale, body.rotate, body.place)
        label = _labels(placed, triangles, twins(triangles), body.fracture, detonation)
    solid = extrude(points, triangles, label, thickness)
    placed = shapes.place(solid.vertices, body.scale, body.rotate, body.place)
    return Broken(body.name, Surfaces(placed, solid.faces, solid.piece, solid.neighbour), True)


def read_mesh(path: Path) -> mesh.Mesh:
    """A mesh file, checked and repaired."""
    return repaired(*read_surface(path), str(path))


def _break_mesh(name: str, surface: mesh.Mesh, vertices: Floats, fracture: Fracture | None,
                detonation: tuple[float, float, float]) -> Broken:
    label = np.zeros(len(surface.faces), dtype=np.int64)
    if fracture is not None:
        label = _labels(vertices, surface.faces, surface.twin, fracture, detonation)
    return Broken(name, shells(vertices, surface.faces, label),
                  bool(surface.closed and label.max() == 0))


def _surface(body: Body, folder: Path) -> mesh.Mesh:
    if body.shape == "mesh" and body.mesh != "animal":
        return read_mesh(folder / body.mesh)
    vertices, faces = (shapes.box(body.size, body.detail) if body.shape == "box" else
                       shapes.sphere(body.radius, body.detail) if body.shape == "sphere" else
                       animal.animal())
    return repaired(vertices, faces, body.name)


def _labels(vertices: Floats, faces: Ints, twin: Ints, fracture: Fracture,
            detonation: tuple[float, float, float]) -> Ints:
    """(f,) the piece of each triangle."""
    weight = (triangle_areas(vertices, faces) if fracture.balance == "area"
              else np.ones(len(faces)))
    distance = None
    if fracture.root == "detonation":
        distance = np.linalg.norm(vertices[faces].mean(axis=1) - detonation, axis=1)
    return break_up(neighbours(twin), weight, fracture.pieces, components(len(faces), twin),
                    distance)
