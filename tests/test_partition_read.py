"""Bad meshes end in one clear error or in a stated repair, in bounded time and memory."""

import resource
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as some
from mpi4py import MPI
from numpy.typing import NDArray

from partition.build import read_mesh
from partition.graph import NO_TWIN, sides
from partition.mesh import Mesh, MeshError
from partition.obj import read_obj
from partition.ply import read_triangles
from partition.read import read_surface
from partition.repair import repaired
from partition.shapes import sphere
from tests.bad_meshes import CUBE, CUBE_FACES, ERRORS, REPAIRS, ply, two

SECONDS, BYTES = 60, 3 * 2**30
READ_ALL = """
import sys
from pathlib import Path
from partition.build import read_mesh
from partition.mesh import MeshError
for name in sys.argv[1:]:
    try:
        read_mesh(Path(name))
    except MeshError:
        pass
"""


def on_disk(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / (name or "nothing")
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def assert_sound(mesh: Mesh) -> None:
    """Everything that `partition.mesh` promises."""
    ends = sides(mesh.faces)
    inner = np.flatnonzero(mesh.twin != NO_TWIN)
    assert np.array_equal(mesh.twin[mesh.twin[inner]], inner)
    assert np.array_equal(ends[inner], ends[mesh.twin[inner]][:, ::-1])
    assert len(np.unique(ends, axis=0)) == len(ends)
    assert set(mesh.faces.ravel()) == set(range(len(mesh.vertices)))
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0).all()
    assert mesh.genus >= 0 and mesh.borders >= 0
    assert not mesh.closed or mesh.volume >= 0


@pytest.mark.parametrize("case", ERRORS)
def test_errors(case: str, tmp_path: Path) -> None:
    name, content, complaint = ERRORS[case]
    path = on_disk(tmp_path, name, content)
    with pytest.raises(MeshError) as error:
        read_mesh(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ") and complaint in message and "fix: " in message
    assert "\n" not in message


@pytest.mark.parametrize("case", REPAIRS)
def test_repairs(case: str, tmp_path: Path) -> None:
    name, content, report, parts, closed = REPAIRS[case]
    mesh = read_mesh(on_disk(tmp_path, name, content))
    assert_sound(mesh)
    assert mesh.closed == closed and mesh.components.max() + 1 == parts
    assert any(report in note for note in mesh.repairs) if report else mesh.repairs == ()


def test_bounded_time_and_memory(tmp_path: Path) -> None:
    """All files of the corpus, by one process that may take no more than 3 GB."""
    if MPI.COMM_WORLD.size > 1:
        pytest.skip("starts a process itself")
    paths = []
    files = [(case, row[0], row[1]) for case, row in ERRORS.items()]
    files += [(case, row[0], row[1]) for case, row in REPAIRS.items()]
    for case, name, content in files:
        folder = tmp_path / case.replace(" ", "_")
        folder.mkdir()
        paths.append(str(on_disk(folder, name, content)))
    subprocess.run([sys.executable, "-c", READ_ALL, *paths], check=True, timeout=SECONDS,
                   cwd=Path(__file__).parent.parent,
                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES)))


@pytest.mark.parametrize("order, sign", [("little", "<"), ("big", ">")])
def test_binary_triangles(tmp_path: Path, order: str, sign: str) -> None:
    """Among other properties, and whatever their types; other files are left to meshio."""
    places, corners = sphere(1.0, 1)
    vertices = np.zeros(len(places), [("x", sign + "f4"), ("red", "u1"), ("y", sign + "f8"),
                                      ("z", sign + "f4")])
    faces = np.zeros(len(corners), [("count", "u1"), ("corners", sign + "u2", 3),
                                    ("group", sign + "i4")])
    for axis, values in zip("xyz", places.T, strict=True):
        vertices[axis] = values
    faces["count"], faces["corners"], faces["group"] = 3, corners, 7
    head = (f"ply\nformat binary_{order}_endian 1.0\ncomment no face here\nobj_info made\n"
            f"element vertex {len(places)}\nproperty float x\nproperty uchar red\nproperty double "
            f"y\nproperty float32 z\nelement face {len(corners)}\nproperty list uchar uint16 "
            "vertex_index\nproperty int group\nend_header\n").encode()
    path = on_disk(tmp_path, "a.ply", head + vertices.tobytes() + faces.tobytes() + b"behind")
    found = read_triangles(path)
    assert found is not None
    assert np.array_equal(found[0], np.column_stack([vertices[axis] for axis in "xyz"]))
    assert np.array_equal(found[1], corners)
    assert [one.dtype.str[1:] for one in found] == ["f8", "i8"]
    faces["count"][3] = 4
    other = on_disk(tmp_path, "b.ply", head + vertices.tobytes() + faces.tobytes())
    short = on_disk(tmp_path, "c.ply", path.read_bytes()[:-8])
    text = on_disk(tmp_path, "d.ply", SMALL["ply"])
    assert all(read_triangles(one) is None for one in (other, short, text))
    assert len(read_surface(text)[1]) == 20


def test_areas_of_polygons(tmp_path: Path) -> None:
    """A notch is neither covered twice nor filled."""
    notch = read_mesh(on_disk(tmp_path, "a.obj", REPAIRS["polygon with a notch"][1]))
    assert notch.area == pytest.approx(16 - 6)
    quad = read_mesh(on_disk(tmp_path, "b.obj", REPAIRS["quad with a notch"][1]))
    assert quad.area == pytest.approx(8 - 2)
    cube = read_mesh(on_disk(tmp_path, "c.obj", CUBE + CUBE_FACES))
    assert cube.area == pytest.approx(6) and cube.volume == pytest.approx(1)


def test_topology() -> None:
    """Sphere, torus, ring and two cubes: borders and genus to theory."""
    ball = repaired(*sphere(1.0, 2), "ball")
    assert (ball.borders, ball.genus) == (0, 0)
    cap = repaired(ball.vertices, ball.faces[ball.vertices[ball.faces].min(axis=1)[:, 2] > -0.4],
                   "cap")
    assert (cap.borders, cap.genus) == (1, 0)
    torus = repaired(*grid_torus(12, 8), "torus")
    assert (torus.borders, torus.genus) == (0, 1)
    band = repaired(torus.vertices, torus.faces[:60], "band")
    assert band.borders == 2 and band.genus == 0


def grid_torus(n: int, m: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    u, v = (np.arange(k) * 2 * np.pi / k for k in (n, m))
    ring = 2 + np.cos(v)
    rim = list(zip(ring, np.sin(v), strict=True))
    points = [(r * np.cos(a), r * np.sin(a), z) for a in u for r, z in rim]
    faces = []
    for i in range(n):
        for j in range(m):
            a, b = i * m + j, (i + 1) % n * m + j
            c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
            faces += [(a, b, c), (a, c, d)]
    return np.array(points), np.array(faces)


def test_cavity_stays_a_cavity() -> None:
    """A file that is wound alike is not corrected part by part."""
    vertices, faces = sphere(1.0, 2)
    hollow = repaired(np.concatenate([vertices, 0.5 * vertices]),
                      np.concatenate([faces, faces[:, ::-1] + len(vertices)]), "hollow")
    assert hollow.repairs == ()
    full, hole = repaired(vertices, faces, "full").volume, hollow.volume
    assert hole == pytest.approx(full * (1 - 0.125))


def test_report_names_size_topology_and_repairs(tmp_path: Path) -> None:
    mesh = read_mesh(on_disk(tmp_path, "a.obj", two((1, 1, 0))))
    assert mesh.report().splitlines() == [
        "16 vertices, 24 triangles, 2 parts, 0 borders, genus 0, area 12, volume 2",
        "repaired: 2 vertices welded to others at the same place",
        "repaired: 1 edges with more than two triangles taken apart",
        "repaired: 2 vertices split in which the surface touched itself"]


@settings(max_examples=150)
@given(vertices=some.arrays(np.float64, st.tuples(st.integers(1, 12), st.just(3)),
                            elements=st.floats(-2, 2) | st.integers(-1, 1).map(float)),
       faces=some.arrays(np.int64, st.tuples(st.integers(0, 20), st.just(3)),
                         elements=st.integers(0, 12)))
def test_any_triangles_are_repaired_or_refused(vertices: NDArray[np.float64],
                                               faces: NDArray[np.int64]) -> None:
    try:
        mesh = repaired(vertices, faces, "any")
    except MeshError:
        return
    assert_sound(mesh)


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scratch")


WORDS = ["v", "f", "1", "-1", "2/3", "4//5", "0.5", "1e400", "nan", "\n", "\\\n", "#", "vt", "g",
         "//", "x", "3", "4"]


@settings(max_examples=150)
@given(words=st.lists(st.sampled_from(WORDS), max_size=60))
def test_any_text_is_read_or_refused(scratch: Path, words: list[str]) -> None:
    path = scratch / "any.obj"
    path.write_text(" ".join(words), encoding="utf-8")
    try:
        vertices, faces = read_obj(path)
    except (ValueError, OverflowError):
        return
    assert vertices.shape[1:] == faces.shape[1:] == (3,)


@settings(max_examples=120)
@given(kind=st.sampled_from(["ply", "bply", "stl", "off"]), cut_at=st.floats(0, 1),
       place=st.floats(0, 1), junk=st.binary(max_size=8))
def test_any_damage_to_a_file_is_read_or_refused(scratch: Path, kind: str, cut_at: float,
                                                 place: float, junk: bytes) -> None:
    """A good file with some bytes overwritten, and cut short."""
    good = SMALL[kind]
    at = int(place * len(good))
    bad = (good[:at] + junk + good[at + len(junk):])[:int(cut_at * len(good)) + 1]
    path = scratch / f"damaged.{kind[-3:]}"
    path.write_bytes(bad)
    try:
        assert_sound(read_mesh(path))
    except MeshError as error:
        assert "fix: " in str(error) and "\n" not in str(error)


def _small() -> dict[str, bytes]:
    vertices, faces = sphere(1.0, 0)
    text = "".join(f"{x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in vertices)
    text_faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
    binary = vertices.astype("<f4").tobytes() + b"".join(
        struct.pack("<B3i", 3, *face) for face in faces.tolist())
    solid = b"x" * 80 + struct.pack("<I", 20) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *vertices[face].ravel(), 0) for face in faces)
    return {"ply": ply(12, 20, (text + text_faces).encode()),
            "bply": ply(12, 20, binary, "binary_little_endian"), "stl": solid,
            "off": f"OFF\n12 20 0\n{text}{text_faces}".encode()}


SMALL = _small()


@pytest.mark.parametrize("kind", ["ply", "bply", "stl", "off"])
def test_undamaged_files(scratch: Path, kind: str) -> None:
    mesh = read_mesh(on_disk(scratch, f"good.{kind[-3:]}", SMALL[kind]))
    assert mesh.closed and len(mesh.faces) == 20 and len(mesh.vertices) == 12
