"""What comes out beside the frames: EXR layers, GIF, contact sheet, preview, diagnostics."""

import json

import numpy as np
import pytest
from mpi4py import MPI
from PIL.GifImagePlugin import GifImageFile

from render import image, plots
from render.__main__ import main
from solver.files import Field
from tests import render_run
from tests.test_render_command import SCENE

COMM = MPI.COMM_WORLD


@pytest.fixture
def run(shared_path):
    if COMM.rank == 0:
        render_run.make(shared_path / "out", render_run.WINDOW, SCENE)
        records = [{"step": i, "time": i * 0.01, "dt": 0.01, "reason": "frame", "iterations": 1,
                    "divergence": 0.0, "energy": i * 1.0} for i in range(1, 9)]
        (shared_path / "out/run.log.jsonl").write_text("".join(
            json.dumps(record) + "\n" for record in records))
    COMM.Barrier()
    return shared_path / "out"


def test_exr_holds_linear_light_and_layers(run):
    import OpenEXR
    assert main([str(run), "--frames", "2", "--set", "render.exr=true", "--set",
                 "render.backdrop.kind=\"uniform\""]) == 0
    COMM.Barrier()
    with OpenEXR.File(str(run / "frames/frame_000002.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    light = np.stack([channels[c] for c in "RGB"], axis=-1)
    shown = image.developed(light.astype(np.float64), 1.0, "film")
    assert abs(shown.astype(int) - image.load_png(run / "frames/frame_000002.png")).max() <= 1
    piece, depth = channels["piece.id"], channels["Z"]
    assert set(np.unique(piece)) <= set(range(17)) and len(np.unique(piece)) > 4
    assert np.array_equal(piece == 0, np.isinf(depth))   # there is nothing but pieces
    assert 1 < depth[piece > 0].min() < depth[piece > 0].max() < 3
    normal = np.stack([channels[f"normal.{c}"] for c in "XYZ"], axis=-1)
    assert np.linalg.norm(normal, axis=-1) == pytest.approx((piece > 0) * 1.0, abs=1e-5)
    assert channels["temperature.T"].min() == 5 and 30 < channels["temperature.T"].max() < 65


def test_gif_and_contact_sheet(run):
    film, sheet = run / "film.gif", run / "sheet.png"
    assert main([str(run), "--video", str(film), "--contact", str(sheet)]) == 0
    COMM.Barrier()
    with GifImageFile(str(film)) as gif:
        assert (gif.size, gif.n_frames, gif.info["duration"]) == ((31, 33), 3, 30)
    whole = image.load_png(sheet)
    assert whole.shape == (33, 3 * 31, 3)
    assert np.array_equal(whole[:, 31:62], image.load_png(run / "frames/frame_000001.png"))


def test_preview_is_small_and_apart(run):
    assert main([str(run), "--preview", "--set", "render.width=640", "--set",
                 "render.height=320", "--frames", "1"]) == 0
    COMM.Barrier()
    assert image.load_png(run / "preview/frame_000001.png").shape == (80, 160, 3)
    assert not (run / "frames").exists()


def test_plots(run, capsys):
    assert main([str(run), "--plots"]) == 0
    COMM.Barrier()
    names = sorted(path.name for path in (run / "plots").glob("*.png"))
    assert names == ["bodies.png", "history.png", *(f"slices_{i:06d}.png" for i in range(3))]
    for path in (run / "plots").glob("*.png"):
        assert image.load_png(path).std() > 5
    if COMM.rank == 0:
        assert capsys.readouterr().out.startswith("render: 5 plots of ")


def test_divergence_and_speed_of_face_values():
    """u = 2x, v = -3y, w = z: exact at the centres, divergence 0."""
    n, h = (4, 3, 5), np.array((0.5, 0.25, 1.0))
    x, y, z = (np.arange(m + 1) * d for m, d in zip(n, h, strict=True))
    u = np.broadcast_to(2 * x, (n[2], n[1], n[0] + 1))
    v = np.broadcast_to(-3 * y[:, None], (n[2], n[1] + 1, n[0]))
    w = np.broadcast_to(z[:, None, None], (n[2] + 1, n[1], n[0]))
    a, b, c, divergence = plots.velocity(
        {name: Field(values, np.zeros(3), h) for name, values in zip("uvw", (u, v, w),
                                                                     strict=True)})
    assert a[0, 0] == pytest.approx(2 * (x[:-1] + x[1:]) / 2)
    assert b[0, :, 0] == pytest.approx(-3 * (y[:-1] + y[1:]) / 2)
    assert c[:, 0, 0] == pytest.approx((z[:-1] + z[1:]) / 2)
    assert divergence == pytest.approx(np.zeros(n[::-1]), abs=1e-12)


def test_broken_journal_is_one_line(run, capsys):
    if COMM.rank == 0:
        (run / "run.log.jsonl").write_text("{oops\n")
    COMM.Barrier()
    if COMM.size == 1:
        assert main([str(run), "--plots"]) == 2
        assert "run.log.jsonl: not one JSON record per line" in capsys.readouterr().err
