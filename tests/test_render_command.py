"""`python -m render OUT`: frames and a film from files alone, made again only when they must be."""

import numpy as np
import pytest
from mpi4py import MPI

from render import image, sequence
from render.__main__ import main
from solver import files
from tests import render_run

COMM = MPI.COMM_WORLD
SCENE = """
[time]
end = 0.2
frame = 0.01
[domain]
cells = [32, 32, 32]
[fuel]
[soot]
[[body]]
name = "pane"
shape = "pane"
size = [0.6, 0.5, 0.01]
points = 60
place = [0.5, 0.5, 0.6]
areal_density = 20.0
fracture = { pieces = 16 }
[render]
width = 31
height = 33
"""


@pytest.fixture
def run(shared_path):
    if COMM.rank == 0:
        render_run.make(shared_path / "out", render_run.WINDOW, SCENE)
    COMM.Barrier()
    return shared_path / "out"


def pictures(folder):
    return [image.load_png(path) for path in sorted(folder.glob("*.png"))]


def test_frames_and_film(run, capsys):
    import av
    assert main([str(run), "--video", str(run / "film.mp4")]) == 0
    COMM.Barrier()
    frames = pictures(run / "frames")
    assert [frame.shape for frame in frames] == [(33, 31, 3)] * 3
    assert len({frame.tobytes() for frame in frames}) == 3
    if COMM.rank == 0:
        report = capsys.readouterr().out
        assert report.startswith("render: 3 frames (0 kept), ") and report.count("\n") == 1
        assert "s per frame" in report and "rays per second" in report
    with av.open(str(run / "film.mp4")) as film:
        stream = film.streams.video[0]
        shown = [frame.to_ndarray(format="rgb24") for frame in film.decode(stream)]
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        assert stream.average_rate == 30
    assert [frame.shape for frame in shown] == [(34, 32, 3)] * 3
    error = shown[2][:33, :31].astype(float) - frames[2]
    assert abs(error).mean() < 10


def test_only_outdated_frames_are_made_again(run, capsys):
    def made(*more):
        assert main([str(run), *more]) == 0
        COMM.Barrier()
        return capsys.readouterr().out.split(": ")[1][:22] if COMM.rank == 0 else None

    def says(text):
        return text if COMM.rank == 0 else None

    assert made("--frames", "0:2") == says("2 frames (0 kept), 0.0"[:22]) or COMM.rank == 0
    assert made() == says("1 frames (2 kept), 0.0"[:22]) or COMM.rank == 0
    first = pictures(run / "frames")
    assert made() == says("all 3 frames are up to ")[:22] if COMM.rank == 0 else made() is None
    if COMM.rank == 0:
        image.save_png(sequence.frame_path(run / "frames", 1), first[0], "something else")
    COMM.Barrier()
    made()
    assert all(map(np.array_equal, first, pictures(run / "frames")))
    made("--set", "render.exposure=2.0")
    assert not any(map(np.array_equal, first, pictures(run / "frames")))


def test_one_two_and_four_ranks_make_the_same_pictures(run, mpirun):
    assert main([str(run), "-o", str(run / "1")]) == 0
    for ranks in (2, 4):
        done = mpirun(ranks, "-m", "render", run, "-o", run / str(ranks))
        assert done.returncode == 0, done.stdout
    alone = pictures(run / "1")
    for ranks in (2, 4):
        assert all(map(np.array_equal, alone, pictures(run / str(ranks))))


@pytest.mark.serial
def test_a_rank_that_fails_ends_all(run, mpirun):
    """The second frame, the second rank's, is broken."""
    path = files.snapshot_path(run, 1)
    path.write_bytes(path.read_bytes()[:3000])
    done = mpirun(2, "-m", "render", run, timeout=60)
    assert done.returncode == 2
    assert f"error: {path}: damaged, its checksum is not the one in " in done.stdout


@pytest.mark.parametrize(("arguments", "words"), [
    (["--frames", "a"], "--frames a: not a range; fix: as in 10, 0:60 or 0:60:2"),
    (["--frames", "7"], "--frames 7: none of these is stored; fix: between 0 and 2"),
    (["--set", "render.widht=3"], "render.widht = 3: unknown key; fix: remove it (did you mean"),
    (["--scene", "nowhere.toml"], "nowhere.toml: no such scene file"),
    (["--plots", "--preview"], "--plots: draws diagnostics instead of pictures"),
])
def test_bad_input_is_one_line(run, capsys, arguments, words):
    assert main([str(run), *arguments]) == 2
    if COMM.rank == 0:
        error = capsys.readouterr().err
        assert error.startswith("error: ") and words in error and error.count("\n") == 1
    assert not (run / "frames").exists()


def test_a_folder_that_is_no_run(shared_path, capsys):
    assert main([str(shared_path)]) == 2
    if COMM.rank == 0:
        assert "scene.toml: no such scene file" in capsys.readouterr().err
