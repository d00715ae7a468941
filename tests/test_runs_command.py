"""`python -m runs` says in one line what is wrong, runs real programs, and passes their code on."""

import os
import signal
import subprocess
import sys
import time

import pytest

from runs import chain, tiny
from solver import scene as scenes

pytestmark = pytest.mark.serial


@pytest.fixture
def runs(tmp_path):
    """Run `python -m runs` in an empty folder; (exit code, stderr)."""
    def run(*arguments, **environment):
        result = subprocess.run([sys.executable, "-m", "runs", *arguments], cwd=tmp_path, text=True,
                                capture_output=True, env=os.environ | environment, check=False)
        return result.returncode, result.stderr
    return run


def test_refusals_are_one_line_and_write_nothing(runs, tmp_path):
    for arguments, shown in [
        (["windwo"], "no such scene"),
        (["missing.toml"], "missing.toml: no such scene file"),
        (["missing"], "fix:"),
    ]:
        code, error = runs(*arguments)
        assert code == 2
        assert shown in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_bad_value_is_refused(runs, tmp_path):
    (tmp_path / "bad.toml").write_text("[time]\nend = -1.0\nframe = 0.1\n", encoding="utf-8")
    code, error = runs("bad.toml")
    assert code == 2
    assert "bad.toml: time.end = -1.0" in error
    assert not (tmp_path / "out").exists()


def test_wrong_ranks_are_refused(runs):
    assert runs("any.toml", "--ranks", "0")[0] == 2


def test_mpirun_around_it_is_refused(runs):
    code, error = runs("any.toml", OMPI_COMM_WORLD_SIZE="2")
    assert code == 2
    assert "--ranks" in error


def test_exit_code_of_a_program_is_passed_on():
    with pytest.raises(chain.StageFailed) as failure:
        chain._execute([sys.executable, "-c", "raise SystemExit(5)"], "solver")
    assert failure.value.code == 5


def test_missing_program_is_named():
    with pytest.raises(chain.StageFailed, match="no-such-mpirun.*setup.sh"):
        chain._execute(["no-such-mpirun"], "solver")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
def test_signal_reaches_the_program(tmp_path, number):
    """A batch system's warning to stop must arrive where the checkpoint is written."""
    program = ("import pathlib, signal, time\n"
               "def stop(*_): raise SystemExit(85)\n"
               f"signal.signal({int(number)}, stop)\n"
               f"pathlib.Path({str(tmp_path / 'up')!r}).touch()\n"
               "time.sleep(60)\n")
    outer = subprocess.Popen([sys.executable, "-c", f"""
import sys
from runs import chain
try:
    chain._execute([sys.executable, "-c", {program!r}], "solver")
except chain.StageFailed as error:
    sys.exit(error.code)
"""])
    while not (tmp_path / "up").exists():
        assert outer.poll() is None
        time.sleep(0.01)
    outer.send_signal(number)
    assert outer.wait(timeout=60) == 85


def test_tiny_scene_is_smaller_and_still_a_scene(tmp_path):
    path = tmp_path / "large.toml"
    path.write_text("""
[domain]
cells = [96, 48, 3]
[time]
end = 1.0
frame = 0.1
[fuel]
particles = 20000
ignited = 1000
[[body]]
name = "pane"
shape = "pane"
density = 1.0
fracture = { pieces = 40 }
[render]
width = 320
height = 160
""", encoding="utf-8")
    small = scenes.load(path, list(tiny.overrides(scenes.load(path))))
    assert small.domain.cells == (16, 8, 3)
    assert small.time.end == pytest.approx(0.3)
    assert (small.fuel.particles, small.fuel.ignited) == (500, 25)
    assert small.body[0].fracture.pieces == 6
    assert (small.render.width, small.render.height) == (64, 32)
    assert scenes.load(path, list(tiny.overrides(small))) == small
