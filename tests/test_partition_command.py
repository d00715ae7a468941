"""`python -m partition`: one file out, a table, a picture; bad input is one line and no file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from partition import fragments
from partition.__main__ import main
from partition.build import build
from solver import scene
from solver.files import FileError
from solver.files_whole import write_tree

SCENE = """
[time]
end = 1.0
frame = 0.1
[[body]]
name = "pane"
shape = "pane"
areal_density = 20.0
fracture = { pieces = 7 }
[[body]]
name = "ball"
shape = "sphere"
density = 1.0
"""


def on_rank_0(path: Path, write: Callable[[Path], object]) -> Path:
    """Let one rank write a file, before any of them reads it."""
    if MPI.COMM_WORLD.rank == 0:
        write(path)
    MPI.COMM_WORLD.Barrier()
    return path


@pytest.fixture
def scene_path(shared_path: Path) -> Path:
    return on_rank_0(shared_path / "scene.toml",
                     lambda path: path.write_text(SCENE, encoding="utf-8"))


def test_round_trip(scene_path: Path, shared_path: Path) -> None:
    out = shared_path / "fragments.h5"
    assert main([str(scene_path), "-o", str(out)]) == 0
    back, made = fragments.read(out), build(scene.load(scene_path))
    assert back.names == made.names == ("pane", "ball")
    for name, kind in fragments.ARRAYS.items():
        array = getattr(back, name)
        assert array.dtype == kind and np.array_equal(array, getattr(made, name))


def test_table_for_a_viewer(scene_path: Path, shared_path: Path,
                            capsys: pytest.CaptureFixture[str]) -> None:
    out = shared_path / "fragments.h5"
    main([str(scene_path), "-o", str(out)])
    with h5py.File(out) as file:
        pieces = file["pieces"][()]
    assert pieces.dtype.names == ("body", "triangles", "area", "volume",
                                  "centre_x", "centre_y", "centre_z")
    assert list(pieces["body"]) == [b"pane"] * 7 + [b"ball"]
    assert pieces["volume"][:7].sum() == pytest.approx(0.01)
    printed = capsys.readouterr().out.splitlines()
    if MPI.COMM_WORLD.rank == 0:
        assert printed[0].startswith("ball: 642 vertices, 1280 triangles, 1 part, 0 borders")
        assert len(printed) == 1 + 1 + 8 + 1 + 1 and "8 pieces" in printed[-1]


def test_pieces_and_set_override_the_scene(scene_path: Path, shared_path: Path) -> None:
    out = shared_path / "fragments.h5"
    assert main([str(scene_path), "--pieces", "11", "--set", 'body.1.name="moon"',
                 "-o", str(out)]) == 0
    back = fragments.read(out)
    assert back.count == 12 and back.names == ("pane", "moon")


def test_picture(scene_path: Path, shared_path: Path) -> None:
    from PIL import Image

    picture = shared_path / "pieces.png"
    main([str(scene_path), "-o", str(shared_path / "fragments.h5"), "--picture", str(picture)])
    with Image.open(picture) as image:
        colours = np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3) // 16, axis=0)
    assert len(colours) > 30


def test_output_that_cannot_be_written(scene_path: Path,
                                       capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(scene_path), "-o", str(scene_path / "out.h5")]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert capsys.readouterr().err.count("cannot be written") == 1


@pytest.mark.parametrize("arguments, complaint", [
    (["missing.toml"], "no such scene"),
    (["missing.ply"], "no such mesh"),
    (["scene.toml", "--pieces", "100000"], "body.0 = 'pane': pieces = 100000: more than"),
    (["scene.toml", "--set", "body.0.fracture.pieces=0"], "body.0.fracture.pieces = 0"),
    (["missing.ply", "--set", "seed=2"], "is not a scene")])
def test_bad_input_is_one_line_and_no_file(arguments: list[str], complaint: str, scene_path: Path,
                                           shared_path: Path, monkeypatch: pytest.MonkeyPatch,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(shared_path)
    assert main([*arguments, "-o", "out.h5"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    if MPI.COMM_WORLD.rank == 0:
        assert captured.err.startswith("error: ") and complaint in captured.err
        assert captured.err.count("\n") == 1
    assert not Path("out.h5").exists()


def test_nothing_breaks(scene_path: Path, shared_path: Path,
                        capsys: pytest.CaptureFixture[str]) -> None:
    whole = SCENE.replace("fracture = { pieces = 7 }", "")
    on_rank_0(scene_path, lambda path: path.write_text(whole, encoding="utf-8"))
    assert main([str(scene_path), "--pieces", "3", "-o", str(shared_path / "out.h5")]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert "no body breaks" in capsys.readouterr().err


@pytest.mark.parametrize("name, damage, complaint", [
    ("faces", lambda faces: faces + 1, "faces has an index out of range"),
    ("faces", lambda faces: faces.astype(np.int64), "faces holds int64"),
    ("vertices", lambda vertices: vertices * np.nan, "not finite"),
    ("face_neighbour", lambda pieces: pieces - 1, "face_neighbour has an index"),
    ("vertex_start", lambda start: start[:-1], "vertex_start"),
    ("body", None, "body")])
def test_damaged_file(name: str, damage: Callable[[Any], Any] | None, complaint: str,
                      scene_path: Path, tmp_path: Path) -> None:
    tree = fragments.to_tree(build(scene.load(scene_path)))
    values = tree.pop(name)
    if damage is not None:
        tree[name] = damage(values)
    bad = tmp_path / "bad.h5"
    write_tree(bad, fragments.FORMAT, tree)
    with pytest.raises(FileError, match=rf"bad.h5: damaged \(.*{complaint}.*\); fix: make it"):
        fragments.read(bad)


@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "vtu"])
def test_export(kind: str, scene_path: Path, shared_path: Path) -> None:
    """One file per piece, which reads back as that piece."""
    import meshio

    out = shared_path / "pieces"
    assert main([str(scene_path), "-o", str(shared_path / "fragments.h5"), "--export", str(out),
                 "--format", kind]) == 0
    pieces = build(scene.load(scene_path))
    assert len(list(out.iterdir())) == pieces.count == 8
    assert (out / f"ball_0007.{kind}").is_file()
    back = meshio.read(out / f"pane_0003.{kind}")
    vertices, faces = pieces.piece(3)
    assert back.points[back.cells_dict["triangle"]] == pytest.approx(vertices[faces], abs=1e-6)


def test_methods_on_a_mesh(shared_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A head of several pieces on a whole body, and the table of the cut that parted them."""
    from tests.bad_meshes import obj
    from tests.partition_shapes import dumb_bell

    bell = dumb_bell(0.15)
    path = on_rank_0(shared_path / "bell.obj", lambda path: path.write_text(
        obj(bell.vertices, bell.faces), encoding="utf-8"))
    out = shared_path / "bell.h5"
    assert main([str(path), "--pieces", "5", "--method", "spectral+bfs", "-o", str(out)]) == 0
    found = fragments.read(out)
    area, _, centre = found.measures()
    assert found.count == 5 and centre[0, 0] < -0.5 and (centre[1:, 0] > 0).all()
    assert area[0] > area[1:].sum() > 0
    if MPI.COMM_WORLD.rank == 0:
        printed = capsys.readouterr().out
        assert "lambda2" in printed and "genus 0" in printed
    assert main([str(path), "--pieces", "1", "--method", "spectral+bfs", "-o", str(out)]) == 2
    assert main([str(path), "--pieces", "3", "--interior", "solid", "-o", str(out)]) == 0
    assert fragments.read(out).closed.all()
