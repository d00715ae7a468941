"""The folder of a run: one run at a time, nothing replaced unless asked, nothing half written."""

import errno
import os
import subprocess
import sys

import pytest

from solver import run as run_module
from solver.files import FileError
from solver.lock import hold
from tests.fire_case import build

pytestmark = pytest.mark.serial


def test_two_runs_do_not_share_a_folder(tmp_path):
    first = hold(tmp_path)
    with pytest.raises(FileError, match="another run is writing here; fix: wait"):
        hold(tmp_path, patience=0.2)
    first.close()
    hold(tmp_path, patience=0.0).close()


def test_a_killed_run_leaves_no_lock(tmp_path):
    program = (f"from pathlib import Path; from solver.lock import hold; import os\n"
               f"lock = hold(Path({str(tmp_path)!r})); os.kill(os.getpid(), 9)")
    assert subprocess.run([sys.executable, "-c", program]).returncode == -9
    hold(tmp_path, patience=0.0).close()


@pytest.mark.parametrize("name", ["status.json", "snapshots/snap_000000.h5",
                                  "checkpoints/chk_00000001.h5"])
def test_what_looks_like_a_run_is_not_replaced_unless_asked(tmp_path, name):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("precious")
    with pytest.raises(FileError, match="holds a run already"):
        run_module.prepare_folder(tmp_path, build(), None, overwrite=False)
    assert path.read_text() == "precious" and not (tmp_path / "scene.toml").exists()
    run_module.prepare_folder(tmp_path, build(), None, overwrite=True)
    assert not path.exists()


def test_the_scene_of_a_run_survives_a_disk_that_is_full(tmp_path, monkeypatch):
    (tmp_path / "scene.toml").write_text("as it was")

    def full(_, path):
        path.write_text("ha")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(run_module, "save", full)
    with pytest.raises(OSError, match="No space"):
        run_module.prepare_folder(tmp_path, build(), None, overwrite=False, restart=True)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
    assert (tmp_path / "scene.toml").read_text() == "as it was"


SCENE = """
title = "../../escape"
[domain]
cells = [4, 4, 4]
[time]
end = 0.01
frame = 0.01
[initial]
T = "x"
[[body]]
name = "../../escape"
shape = "pane"
size = [0.4, 0.4, 0.02]
points = 6
areal_density = 1.0
"""


def test_names_in_a_scene_are_no_paths(tmp_path):
    """Nothing is written outside OUT, whatever bodies and films are called."""
    deep = tmp_path / "a" / "b"
    scene, out, harm = deep / "scene.toml", deep / "out", deep / "harm"
    out.mkdir(parents=True)
    scene.write_text(SCENE)
    for words in (("partition", scene, "-o", out / "fragments.h5"), ("solver", scene, "-o", out),
                  ("solver.results", "convert", out, "--to", "csv", "-o", out / "csv"),
                  ("solver.results", "convert", out, "--to", "vtkhdf", "-o", out / "vtk")):
        done = subprocess.run([sys.executable, "-m", "runs.stress.watched", harm, out, *words],
                              capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert harm.read_text() == ""
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert sorted(path.name for path in deep.iterdir()) == ["harm", "out", "scene.toml"]
    assert len(list(out.rglob("*.csv"))) > 1
