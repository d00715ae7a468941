"""Boxes, spheres, the animal and meshes: closed, outward, placed where the scene says."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from partition import shapes
from partition.animal import animal, distance
from partition.build import BuildError, assemble, break_mesh, build, read_mesh
from partition.fragments import Fragments
from partition.graph import components, sides, twins
from partition.measure import measures
from solver import scene
from solver.scene_body import Body, Fracture

Floats = NDArray[np.float64]


def bodies(*tables: dict[str, object]) -> Fragments:
    full = [{"name": f"body {i}", "density": 1.0, **table} for i, table in enumerate(tables)]
    return build(scene.build({"time": {"end": 1.0, "frame": 0.1}, "body": full}))


def is_closed_and_outward(vertices: Floats, faces: NDArray[np.int64]) -> bool:
    ends = sides(faces)
    twin = twins(faces)
    volume = measures(vertices, faces, np.zeros(len(faces), int), np.array([True]))[1]
    return bool(np.all(twin >= 0) and np.array_equal(ends, ends[twin][:, ::-1]) and volume > 0)


def test_box() -> None:
    fragments = bodies({"shape": "box", "size": [0.2, 0.4, 0.6], "place": [1.0, 2.0, 3.0]})
    area, volume, centre = fragments.measures()
    assert area == pytest.approx(2 * (0.08 + 0.12 + 0.24), rel=1e-12)
    assert volume == pytest.approx(0.048, rel=1e-12)
    assert centre[0] == pytest.approx((1.0, 2.0, 3.0), rel=1e-12)
    assert len(fragments.faces) == 12 * 4**3
    assert is_closed_and_outward(*shapes.box((1, 2, 3), 2))


@pytest.mark.parametrize("detail", [0, 1, 4])
def test_sphere(detail: int) -> None:
    vertices, faces = shapes.sphere(0.5, detail)
    assert len(faces) == 20 * 4**detail
    assert is_closed_and_outward(vertices, faces)
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.5, rel=1e-12)


def test_animal_is_one_closed_surface_without_handles() -> None:
    vertices, faces = animal()
    assert is_closed_and_outward(vertices, faces)
    twin = twins(faces)
    assert components(len(faces), twin).max() == 0
    assert len(vertices) - len(twin) // 2 + len(faces) == 2
    assert 5_000 < len(faces) < 10_000
    assert abs(distance(vertices)).max() < 0.01


def test_rotation_is_about_x_then_y_then_z() -> None:
    turn = shapes.rotation((90.0, 90.0, 0.0))
    assert turn @ (0, 1, 0) == pytest.approx((1, 0, 0), abs=1e-15)     # y -> z -> x
    turn = shapes.rotation((0.0, 90.0, 90.0))
    assert turn @ (0, 0, 1) == pytest.approx((0, 1, 0), abs=1e-15)     # z -> x -> y


def test_place_puts_the_middle_of_the_bounding_box() -> None:
    triangle = np.array([(0, 0, 0), (4, 2, 0), (1, 1, 1.0)])
    vertices = shapes.place(triangle, 0.5, (0, 0, 0), (9, 9, 9))
    assert vertices.min(axis=0) == pytest.approx((8, 8.5, 8.75))
    assert vertices.max(axis=0) == pytest.approx((10, 9.5, 9.25))


def test_whole_is_closed_and_pieces_of_a_surface_are_open() -> None:
    fragments = bodies({"shape": "sphere"}, {"shape": "sphere", "fracture": {"pieces": 5}})
    assert list(fragments.closed) == [True] + [False] * 5
    assert list(fragments.body) == [0] + [1] * 5
    area = fragments.measures()[0]
    assert area[1:].sum() == pytest.approx(area[0], rel=1e-12)


def test_start_at_the_detonation() -> None:
    table = {"name": "ball", "density": 1.0, "shape": "sphere",
             "fracture": {"pieces": 6, "root": "detonation"}}
    where = [0.5, 1.5, 0.5]
    fragments = build(scene.build({"time": {"end": 1.0, "frame": 0.1}, "body": [table],
                                   "detonation": {"position": where}}))
    nearest = np.argmin(np.linalg.norm(fragments.measures()[2] - where, axis=1))
    assert nearest == 0


def test_mesh_file_is_welded(tmp_path: Path) -> None:
    """A cube written as twelve loose triangles is one closed body."""
    vertices, faces = shapes.box((1, 1, 1), 0)
    rows = vertices[faces].reshape(-1, 3)
    text = [f"v {x} {y} {z}" for x, y, z in rows]
    text += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(12)]
    path = tmp_path / "loose.obj"
    path.write_text("\n".join(text), encoding="utf-8")
    surface = read_mesh(path)
    assert len(surface.vertices) == 8 and surface.closed
    body = Body(name="loose", shape="mesh", fracture=Fracture(pieces=3))
    fragments = assemble([break_mesh(path, body)])
    assert fragments.count == 3 and fragments.names == ("loose",)
    assert fragments.measures()[0].sum() == pytest.approx(6.0)


def test_scene_without_bodies_is_refused() -> None:
    with pytest.raises(BuildError, match=r"body: missing; fix: add a \[\[body\]\]"):
        bodies()


def test_errors_name_the_body() -> None:
    with pytest.raises(BuildError, match=r"body.0 = 'body 0': .*missing.obj: no such mesh"):
        bodies({"shape": "mesh", "mesh": "missing.obj"})
    with pytest.raises(BuildError, match=r"body.0 = 'body 0': pieces = 99: more than the 20 tri"):
        bodies({"shape": "sphere", "detail": 0, "fracture": {"pieces": 99}})


@pytest.mark.parametrize("table, complaint", [
    ({"shape": "sphere", "fracture": {"pieces": 2, "first": {"pieces": 3}}},
     "body.0.fracture.pieces = 2: fewer than its first cut makes"),
    ({"shape": "sphere", "interior": "solid", "fracture": {"order": "half_list"}},
     "body.0.fracture.order = 'half_list'"),
    ({"shape": "pane", "interior": "shell"}, "body.0.interior = 'shell'"),
    ({"shape": "box", "outline": [[0, 0], [1, 0], [0, 1]]}, "body.0.outline")])
def test_contradictions(table: dict[str, object], complaint: str) -> None:
    with pytest.raises(scene.SceneError, match=f"{complaint}.*; fix: "):
        bodies(table)
