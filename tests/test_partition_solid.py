"""A broken pane is a set of closed, outward solids that meet in identical walls."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from partition.build import Broken, assemble, build
from partition.extrude import extrude
from partition.fragments import NO_NEIGHBOUR, Fragments
from partition.graph import sides
from partition.measure import triangle_areas
from partition.triangulate import delaunay
from solver import scene

Floats = NDArray[np.float64]
TILTED = np.array([(0.1, 0.0), (1.3, 0.4), (1.0, 1.7), (-0.3, 1.1), (0.5, 0.6)])


def pane(**body: object) -> Fragments:
    table = {"name": "pane", "shape": "pane", "size": [0.7, 0.6, 0.02], "areal_density": 20.0,
             "rotate": [20.0, 30.0, 40.0], "scale": 1.5, "fracture": {"pieces": 16}, **body}
    return build(scene.build({"time": {"end": 1.0, "frame": 0.1}, "body": [table]}))


def assert_solid(fragments: Fragments) -> None:
    """Every directed edge once, its opposite once; volumes positive."""
    for index in range(fragments.count):
        _, faces = fragments.piece(index)
        ends = sides(faces.astype(np.int64))
        edges = {(int(a), int(b)) for a, b in ends}
        assert len(edges) == len(ends)
        assert edges == {(b, a) for a, b in edges}
    assert fragments.closed.all()
    assert (fragments.measures()[1] > 0).all()


@pytest.mark.parametrize("triangulation", ["trisection", "delaunay"])
@pytest.mark.parametrize("pieces", [1, 2, 16, 61])
def test_closed_outward_and_filling_the_pane(triangulation: str, pieces: int) -> None:
    fragments = pane(triangulation=triangulation, fracture={"pieces": pieces})
    assert fragments.count == pieces
    assert_solid(fragments)
    volume = fragments.measures()[1]
    assert volume.sum() == pytest.approx(1.5**3 * 0.7 * 0.6 * 0.02, rel=1e-12)


def test_tilted_outline_volume_is_area_times_thickness() -> None:
    """An axis-parallel outline would hide a wrong corner of a wall."""
    triangles = delaunay(TILTED)
    label = np.arange(len(triangles))
    solid = extrude(TILTED, triangles, label, 0.1)
    fragments = assemble([Broken("tilted", solid, True)])
    assert_solid(fragments)
    flat = np.column_stack([TILTED, np.zeros(5)])
    assert fragments.measures()[1] == pytest.approx(0.1 * triangle_areas(flat, triangles))


def test_walls_of_two_pieces_are_the_same_triangles() -> None:
    """Each inner wall occurs once in either piece, with opposite winding."""
    fragments = pane(fracture={"pieces": 9})
    owner, behind = fragments.piece_of_face, fragments.face_neighbour
    walls: dict[tuple[int, int], set[tuple[bytes, ...]]] = {}
    for face in np.flatnonzero(behind != NO_NEIGHBOUR):
        corners = [fragments.vertices[v].tobytes() for v in fragments.faces[face]]
        first = corners.index(min(corners))
        key = tuple(corners[first:] + corners[:first])
        walls.setdefault((int(owner[face]), int(behind[face])), set()).add(key)
    assert len({a for a, _ in walls}) == 9
    for (a, b), triangles in walls.items():
        assert walls[b, a] == {(p, r, q) for p, q, r in triangles}


def test_rim_and_faces_have_no_neighbour() -> None:
    """What is not an inner wall adds up to the surface of the whole pane."""
    fragments = pane(fracture={"pieces": 12})
    outside = fragments.face_neighbour == NO_NEIGHBOUR
    area = triangle_areas(fragments.vertices, fragments.faces)[outside].sum()
    assert area == pytest.approx(1.5**2 * 2 * (0.7 * 0.6 + 0.7 * 0.02 + 0.6 * 0.02), rel=1e-12)


def test_piece_touching_itself_in_a_point_stays_manifold() -> None:
    """Three of four triangles round a vertex, the fourth reached round the outside."""
    ring = np.array([(np.cos(t), np.sin(t)) for t in np.arange(6) * np.pi / 3])
    points = np.vstack([ring, [(0.0, 0.0)]])
    triangles = np.array([(6, i, (i + 1) % 6) for i in range(6)])
    label = np.array([0, 1, 0, 1, 2, 2])
    fragments = assemble([Broken("star", extrude(points, triangles, label, 0.2), True)])
    assert_solid(fragments)


def test_every_piece_owns_its_vertices() -> None:
    fragments = pane()
    used = fragments.piece_of_vertex[fragments.faces]
    assert np.array_equal(used, np.repeat(fragments.piece_of_face[:, None], 3, axis=1))
    assert set(fragments.faces.ravel()) == set(range(len(fragments.vertices)))


def test_neighbours_of_the_second_body_count_from_its_first_piece() -> None:
    tables = [{"name": name, "shape": "pane", "areal_density": 20.0, "fracture": {"pieces": 5}}
              for name in ("left", "right")]
    both = build(scene.build({"time": {"end": 1.0, "frame": 0.1}, "body": tables}))
    inner = both.face_neighbour != NO_NEIGHBOUR
    assert np.array_equal(both.body[both.face_neighbour[inner]],
                          both.body[both.piece_of_face[inner]])
    assert both.names == ("left", "right")
    assert not np.array_equal(both.piece(0)[0], both.piece(5)[0])


def test_same_pane_from_the_same_seed_only() -> None:
    def corners(seed: int) -> Floats:
        table = {"name": "p", "shape": "pane", "areal_density": 1.0, "fracture": {"pieces": 4}}
        return build(scene.build({"seed": seed, "time": {"end": 1.0, "frame": 0.1},
                                  "body": [table]})).vertices

    first, again, other = corners(1), corners(1), corners(2)
    assert np.array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_pieces_are_stored_one_after_the_other() -> None:
    fragments = pane()
    for first, last in pairwise(fragments.face_start):
        assert len(np.unique(fragments.piece_of_vertex[fragments.faces[first:last]])) == 1
