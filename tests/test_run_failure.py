"""When something fails: one clear message, the state saved where it can be, and no rank waits."""

import json
import resource
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

from solver import estimate, files, files_whole, files_write
from solver.checkpoint import FIELDS
from solver.files import SNAPSHOT, open_file, snapshot_frames, snapshot_path
from solver.files_checksum import check
from solver.run import unsound
from solver.session import BAD_INPUT, DISK, FAILED
from tests.fire_case import build, running

pytestmark = pytest.mark.serial

SCENE = """
[domain]
cells = [8, 8, 16]
[time]
end = 0.05
frame = 0.01
[initial]
noise = 0.3
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def solver(*arguments):
    return subprocess.run([sys.executable, "-m", "solver", *map(str, arguments)], timeout=100,
                          capture_output=True, text=True, stdin=subprocess.DEVNULL)


def status(out):
    return json.loads((out / "status.json").read_text())


def test_one_rank_fails_and_all_end_with_its_message(scene, tmp_path, mpirun):
    out, start = tmp_path / "out", time.monotonic()
    # rank 1 owns the upper half of z, where the root of a negative number is not a number
    finished = mpirun(2, "-m", "solver", scene, "-o", out, "--set",
                      'fluid.force=["sqrt(0.5-z)", "0", "0"]', timeout=60)
    assert finished.returncode == FAILED
    for word in ("error: rank 1 of 2: stage force, step 0", "sqrt(0.5-z)"):
        assert word in finished.stdout
    assert "Traceback" not in finished.stdout
    assert status(out)["state"] == "failed" and "rank 1" in status(out)["message"]
    assert time.monotonic() - start < 60 and snapshot_frames(out) == [0]


def test_a_flow_that_overflows_is_saved_and_not_continued_from(scene, tmp_path):
    out = tmp_path / "out"
    finished = solver(scene, "-o", out, "--set", 'fluid.force=["1e308*x", "1e308", "0"]',
                      "--set", "time.dt_max=0.01")
    assert finished.returncode == FAILED and finished.stderr.count("\n") == 1
    for word in ("error: stage project, step 0, t = 0", "converged reason", "failed.h5"):
        assert word in finished.stderr
    with open_file(out / "failed.h5", files.CHECKPOINT) as file:
        assert {name for name in FIELDS if f"fields/{name}" in file} >= {"u", "v", "w", "p"}
    assert solver(scene, "-o", out).returncode == BAD_INPUT      # and it is not overwritten
    again = solver(scene, "-o", out, "--restart", "--set", 'fluid.force=["0", "0", "0"]')
    assert again.returncode == 0 and status(out)["state"] == "done"


def test_a_value_that_is_not_finite_is_named_by_place():
    with running() as simulation:
        assert unsound(simulation.state) == ""
        simulation.state.w[5, 3, 4] = np.nan     # two of them ghosts
        assert unsound(simulation.state) == " (w[3, 1, 2] = nan on rank 0)"


def test_a_full_disk_is_one_error_and_leaves_what_was_there(tmp_path, monkeypatch):
    """A limit on the size of files stands for the disk: the system refuses in the same way."""
    monkeypatch.setattr(files_whole, "SPARE", 1 << 62)   # as where there is little room
    values = np.random.default_rng(1).random((16, 16, 16))
    writer = files_write.SnapshotWriter(tmp_path, None, "float64")
    blocks = {"fields/T": files_write.Block(values, (0, 0, 0), values.shape)}
    good = writer.write(0, blocks, {"time": 0.0, "step": 0})
    before, limits = good.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        for frame in (0, 1):
            with pytest.raises(files.WriteError, match="cannot be written .*fix: make room"):
                writer.write(frame, blocks, {"time": 0.0, "step": 0})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert good.read_bytes() == before and check(good, SNAPSHOT) == ""
    assert sorted(path.name for path in good.parent.iterdir()) == ["SHA256SUMS", good.name]


def test_no_room_is_noticed_before_all_ranks_write(tmp_path, monkeypatch):
    monkeypatch.setattr(files_write.shutil, "disk_usage", lambda _: SimpleNamespace(free=0))
    writer = files_write.SnapshotWriter(tmp_path)
    with pytest.raises(files.WriteError, match="0.0 MB are free"):
        writer.write(0, {"a": files_write.Block(np.zeros(9), (0,), (9,))}, {"time": 0.0})


def test_a_file_that_cannot_be_written_has_its_own_exit_code(scene, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "checkpoints").touch()   # where a folder has to be
    finished = solver(scene, "-o", out, "--restart")
    assert finished.returncode == DISK and finished.stderr.count("\n") == 1
    assert "checkpoints" in finished.stderr and status(out)["state"] == "failed"
    assert all(check(snapshot_path(out, frame), SNAPSHOT) == "" for frame in snapshot_frames(out))
    assert snapshot_frames(out) == [0, 1, 2, 3, 4, 5]


def test_more_memory_than_there_is_is_refused_before_anything_is_written(scene, tmp_path):
    out = tmp_path / "out"
    finished = solver(scene, "-o", out, "--set", "domain.cells=[4096, 4096, 4096]")
    assert finished.returncode == BAD_INPUT and not out.exists()
    assert "of memory" in finished.stderr and finished.stderr.count("\n") == 1


def test_the_estimate_is_said_first_and_grows_with_what_a_scene_has():
    small, large = build(), build(domain={"cells": [64, 64, 64]})
    fire = build(domain={"cells": [64, 64, 64]}, fuel={"particles": 100_000, "ignited": 1})
    assert estimate.memory(small, 1) < estimate.memory(large, 1) < estimate.memory(fire, 1)
    assert estimate.memory(large, 4) > estimate.memory(large, 1)
    assert estimate.disk(small)[0] < estimate.disk(large)[0] < estimate.disk(fire)[0]
    assert estimate.size(1.234e9) == "1.23 GB" and estimate.size(999) == "999 B"
