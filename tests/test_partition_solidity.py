"""A closed body breaks into closed pieces that fill it, and share their inner faces."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from partition.build import Broken, BuildError, assemble, build
from partition.extrude import shells
from partition.fracture import Sheet, labels
from partition.fragments import NO_NEIGHBOUR, Fragments
from partition.graph import Ints
from partition.inside import winding
from partition.measure import triangle_areas
from partition.mesh import MeshError
from partition.relief import rough, smooth
from partition.repair import repaired
from partition.shapes import sphere
from partition.solid import Solid, evened, skins
from partition.tetrahedra import Tetrahedra, fill
from solver import scene
from solver.scene_body import Fracture
from tests.partition_shapes import dumb_bell, folded_sheet

BELL = dumb_bell(0.12)


@pytest.fixture(scope="module")
def body() -> Tetrahedra:
    return fill(BELL, "bell")


def pieces_of(body: Tetrahedra, **fracture: object) -> Fragments:
    wanted = Fracture.model_validate(fracture)
    label, _ = labels(Solid(body), wanted, (0.7, 0, 0))
    return assemble([Broken("bell", skins(body, label), True)])


def as_trimesh(fragments: Fragments, index: int) -> trimesh.Trimesh:
    vertices, faces = fragments.piece(index)
    return trimesh.Trimesh(vertices, faces, process=False)


@pytest.mark.parametrize("fracture", [
    {"pieces": 1}, {"pieces": 2}, {"pieces": 17}, {"pieces": 33}, {"pieces": 100},
    {"pieces": 7, "mass": "count", "root": "detonation"},
    {"pieces": 2, "method": "spectral"}, {"pieces": 9, "method": "spectral"},
    {"pieces": 17, "first": {"method": "spectral"}},
    {"pieces": 9, "first": {"method": "spectral", "weights": "thesis"}, "method": "spectral"}],
    ids=str)
def test_exactly_so_many_watertight_pieces_that_fill_the_body(body: Tetrahedra,
                                                              fracture: dict[str, object]) -> None:
    fragments = pieces_of(body, **fracture)
    assert fragments.count == fracture["pieces"]
    _, volume, centre = fragments.measures()
    for index in range(fragments.count):
        solid = as_trimesh(fragments, index)
        assert solid.is_watertight and solid.is_winding_consistent and solid.is_volume
        assert solid.volume == pytest.approx(volume[index], rel=1e-9)
        assert solid.center_mass == pytest.approx(centre[index], abs=1e-9)
    whole = body.volumes.sum()
    assert volume.sum() == pytest.approx(whole, rel=1e-9)
    assert volume @ centre / whole == pytest.approx(body.volumes @ body.centres / whole, abs=1e-9)


def test_pieces_are_connected(body: Tetrahedra) -> None:
    for method in ("bfs", "spectral"):
        label, _ = labels(Solid(body), Fracture.model_validate({"pieces": 12, "method": method}),
                          (0, 0, 0))
        for piece in range(12):
            assert body.part(np.flatnonzero(label == piece)).components.max() == 0


def roughness(body: Tetrahedra, label: Ints) -> float:
    """Area of the inner faces."""
    fragments = assemble([Broken("bell", skins(body, label), True)])
    inner = fragments.face_neighbour != NO_NEIGHBOUR
    return float(triangle_areas(fragments.vertices, fragments.faces)[inner].sum())


def test_grain_of_inner_faces(body: Tetrahedra) -> None:
    """Smooth faces are smaller, rough ones larger; the body and its volume stay."""
    label, _ = labels(Solid(body), Fracture(pieces=8), (0, 0, 0))
    kinds = {"raw": body, "smooth": smooth(body, label),
             "rough": rough(body, label, np.random.default_rng(1))}
    for changed in kinds.values():
        assert changed.volumes.min() > 0
        assert changed.volumes.sum() == pytest.approx(body.volumes.sum(), rel=1e-12)
        outer, _ = changed.surface()
        assert np.array_equal(changed.vertices[outer], body.vertices[outer])
    area = {name: roughness(changed, label) for name, changed in kinds.items()}
    assert area["smooth"] < 0.95 * area["raw"] and area["rough"] > 1.02 * area["raw"]


def test_jags_are_evened(body: Tetrahedra) -> None:
    """Pieces strewn with lost tetrahedra become whole again; the area between pieces falls."""
    label, _ = labels(Solid(body), Fracture(pieces=6), (0, 0, 0))
    rng = np.random.default_rng(2)
    jagged = np.where(rng.random(len(label)) < 0.05, rng.integers(0, 6, len(label)), label)
    even = evened(body, jagged, 6)
    for piece in range(6):
        assert body.part(np.flatnonzero(even == piece)).components.max() == 0
    assert roughness(body, even) < 0.7 * roughness(body, jagged)
    assert np.count_nonzero(even != label) < 0.2 * np.count_nonzero(jagged != label)
    assert np.array_equal(evened(body, label, 6), label)


def test_inner_faces_are_shared_and_tagged(body: Tetrahedra) -> None:
    """Every inner face occurs on either side, opposite; the others are the surface of the body."""
    fragments = pieces_of(body, pieces=20)
    owner, behind = fragments.piece_of_face, fragments.face_neighbour
    inner = behind != NO_NEIGHBOUR
    faces = fragments.vertices[fragments.faces]
    sides = {(int(owner[f]), int(behind[f]), *sorted(map(bytes, faces[f])))
             for f in np.flatnonzero(inner)}
    assert len(sides) == np.count_nonzero(inner)
    assert sides == {(b, a, *corners) for a, b, *corners in sides}
    outer, _ = body.surface()
    outside = triangle_areas(fragments.vertices, fragments.faces)[~inner].sum()
    assert outside == pytest.approx(triangle_areas(body.vertices, outer).sum(), rel=1e-12)


def test_body_stays_near_its_mesh(body: Tetrahedra) -> None:
    """Its surface goes through every vertex of the mesh and encloses the same volume."""
    assert body.volumes.min() > 0 and body.components.max() == 0
    assert body.volumes.sum() == pytest.approx(BELL.volume, rel=1e-9)
    faces, _ = body.surface()
    on_skin = set(map(bytes, body.vertices[faces].reshape(-1, 3)))
    assert on_skin >= set(map(bytes, BELL.vertices))


def test_same_tetrahedra_every_time(body: Tetrahedra) -> None:
    again = fill(BELL, "bell")
    assert np.array_equal(again.cells, body.cells)
    assert np.array_equal(again.vertices, body.vertices)


@settings(max_examples=40)
@given(st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3))
def test_winding_number_of_a_sphere_in_a_sphere(point: list[float]) -> None:
    """2 inside both, 1 inside the outer; every ray meets some edge or vertex exactly."""
    vertices, faces = sphere(1.0, 2)
    both = np.concatenate([vertices, 0.5 * vertices]), np.concatenate([faces,
                                                                       faces + len(vertices)])
    far = np.linalg.norm(point)
    assume(min(abs(far - 1), abs(far - 0.5)) > 0.05)
    assert winding(np.array([point]), *both)[0] == int(far < 1) + int(far < 0.5)
    through = np.concatenate([vertices * 0.7, vertices * 1.3, vertices[faces].mean(axis=1) * 0.3])
    expected = np.repeat([1, 0, 2], [len(vertices), len(vertices), len(faces)])
    assert np.array_equal(winding(through, *both), expected)


def test_neighbours_of_tetrahedra() -> None:
    two = Tetrahedra(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1.0)]),
                     np.array([(0, 1, 2, 3), (1, 2, 3, 4)]))
    assert two.volumes == pytest.approx([1 / 6, 1 / 3])
    assert two.neighbour.tolist() == [[1, -1, -1, -1], [-1, -1, -1, 0]]
    assert two.surface()[0].shape == (6, 3)
    assert Solid(two).size.sum() == pytest.approx(skin_volume(two))


def skin_volume(body: Tetrahedra) -> float:
    """By the divergence theorem, from the outward faces."""
    faces, _ = body.surface()
    a, b, c = (body.vertices[corner] for corner in faces.T)
    return float((a * np.cross(b, c)).sum() / 6)


def test_pieces_that_meet_in_an_edge_stay_manifold() -> None:
    """Two opposite quarters of a cube, joined round the back, touch along the middle axis."""
    corner = np.arange(27).reshape(3, 3, 3)
    points = np.argwhere(corner >= 0).astype(float)
    cells, label = [], []
    paths = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    for i, j, k in np.ndindex(2, 2, 2):
        for path in paths:
            steps = [np.array([i, j, k])]
            for axis in path:
                steps.append(steps[-1] + np.eye(3, dtype=int)[axis])
            odd = paths.index(path) in (1, 2, 5)
            numbers = [int(corner[tuple(step)]) for step in steps]
            cells.append(numbers[:2] + numbers[2:][::-1] if odd else numbers)
            label.append(1 if k == 0 and i != j else 0)
    body = Tetrahedra(points, np.array(cells))
    assert body.volumes == pytest.approx(1 / 6)
    fragments = assemble([Broken("cube", skins(body, np.array(label)), True)])
    for index, volume in enumerate((6, 2)):
        solid = as_trimesh(fragments, index)
        assert solid.is_watertight and solid.volume == pytest.approx(volume)


@pytest.mark.parametrize("pieces", [1, 6])
def test_shells_are_closed_and_as_thick_as_asked(pieces: int) -> None:
    ball = repaired(*sphere(1.0, 3), "ball")
    label, _ = labels(Sheet(ball), Fracture(pieces=pieces), (0, 0, 0))
    fragments = assemble([Broken("ball", shells(ball, label, 0.1), True)])
    assert fragments.count == pieces
    for index in range(pieces):
        assert as_trimesh(fragments, index).is_watertight
    inside = ball.volume * 0.9**3
    assert fragments.measures()[1].sum() == pytest.approx(ball.volume - inside, rel=1e-2)


def test_open_surface_has_no_inside() -> None:
    with pytest.raises(MeshError, match='interior = \'solid\': the surface has a border; fix'):
        fill(folded_sheet(0), "sheet")


def test_scene_asks_for_the_interior() -> None:
    table = {"name": "ball", "shape": "sphere", "density": 1.0, "detail": 2,
             "fracture": {"pieces": 4}}
    kinds = {}
    for interior in ("open", "shell", "solid"):
        fragments = build(scene.build({"time": {"end": 1.0, "frame": 0.1},
                                       "body": [table | {"interior": interior, "skin": 0.05}]}))
        assert fragments.count == 4
        kinds[interior] = (bool(fragments.closed.all()), fragments.measures()[1].sum())
    assert kinds["open"] == (False, 0.0)
    assert kinds["shell"][0] and kinds["solid"][0]
    assert kinds["shell"][1] < kinds["solid"][1] == pytest.approx(np.pi / 6, rel=0.1)


def test_solid_needs_a_closed_mesh(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    path = tmp_path / "one.obj"
    path.write_text(text, encoding="utf-8")
    table = {"name": "one", "shape": "mesh", "mesh": str(path), "density": 1.0,
             "interior": "solid", "fracture": {"pieces": 1}}
    with pytest.raises(BuildError, match=r"body.0 = 'one': .*has a border"):
        build(scene.build({"time": {"end": 1.0, "frame": 0.1}, "body": [table]}))
