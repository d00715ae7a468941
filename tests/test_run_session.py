"""Sessions: a run that is stopped, asked, killed or out of time goes on to the same last frame."""

import json
import os
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from runs.stress.blast import FIRE
from solver.files import SNAPSHOT, checkpoint_paths, snapshot_frames, snapshot_path
from solver.files_checksum import check
from solver.session import (BAD_INPUT, DONE, GO_ON, SAVE, STOP, STOPPED, Session,
                            seconds_of)

pytestmark = pytest.mark.serial

FRAMES = 6


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "small.toml"
    path.write_text(FIRE)
    return path


@pytest.fixture(scope="module")
def whole(scene):
    """The run that was never stopped."""
    out = scene.parent / "whole"
    assert solver(scene, out).returncode == DONE
    return out


def command(scene, out, *options):
    return [sys.executable, "-m", "solver", str(scene), "-o", str(out), *map(str, options)]


def solver(scene, out, *options):
    return subprocess.run(command(scene, out, *options), capture_output=True, text=True,
                          timeout=100, stdin=subprocess.DEVNULL)


def started(scene, out, *options, frame=1):
    """The solver under way, `frame` stored."""
    process = subprocess.Popen(command(scene, out, *options), stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True)
    wait_for(lambda: snapshot_path(out, frame).exists() or process.poll() is not None)
    return process


def wait_for(condition):
    for _ in range(6000):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("waited for a minute")


def status(out):
    return json.loads((out / "status.json").read_text())


def datasets(path):
    """Every dataset by every name it has: a file holds some of them under two."""
    with h5py.File(path) as file:
        return {name: item[()] for name, item in members(file)}


def members(group):
    for name, item in group.items():
        if isinstance(item, h5py.Group):
            yield from ((f"{name}/{inner}", found) for inner, found in members(item))
        else:
            yield name, item


def assert_same_end(out, whole):
    assert status(out)["state"] == "done" and snapshot_frames(out) == list(range(FRAMES + 1))
    for frame in range(FRAMES + 1):
        mine, theirs = (datasets(snapshot_path(folder, frame)) for folder in (out, whole))
        assert mine.keys() == theirs.keys()
        for name, values in mine.items():
            np.testing.assert_array_equal(values, theirs[name], err_msg=f"{frame} {name}")
    steps = [json.loads(line)["step"] for line in (out / "run.log.jsonl").read_text().splitlines()]
    assert steps == list(range(1, len(steps) + 1))


def restart(scene, out, *options):
    finished = solver(scene, out, "--restart", *options)
    assert finished.returncode == DONE, finished.stderr
    return finished


def test_a_signal_that_stops(scene, whole, tmp_path):
    process = started(scene, tmp_path)
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == STOPPED and "go on with --restart" in output
    assert status(tmp_path)["state"] == "stopped" and status(tmp_path)["reason"] == "signal"
    restart(scene, tmp_path)
    assert_same_end(tmp_path, whole)


@pytest.mark.parametrize("number, action", [
    (signal.SIGUSR1, STOP), (signal.SIGTERM, STOP), (signal.SIGXCPU, STOP), (signal.SIGINT, STOP),
    (signal.SIGUSR2, SAVE)])
def test_signals_and_what_they_ask(tmp_path, number, action):
    session, before = Session(0.0), signal.getsignal(number)
    session.listen()
    try:
        assert session.ask(tmp_path, 0.0, MPI.COMM_SELF) == (GO_ON, "")
        os.kill(os.getpid(), number)
        assert session.ask(tmp_path, 0.0, MPI.COMM_SELF) == (action, "signal")
        assert session.ask(tmp_path, 0.0, MPI.COMM_SELF)[0] == (STOP if action == STOP else GO_ON)
    finally:
        session.unlisten()
    assert signal.getsignal(number) == before


def test_a_signal_that_only_saves(scene, tmp_path):
    process = started(scene, tmp_path, "--set", "output.checkpoint_every=0.0")
    process.send_signal(signal.SIGUSR2)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == DONE and output.count("checkpoint chk_") == 2   # and at the end


@pytest.mark.parametrize("options, reason, code", [
    (("--walltime", "1h", "--walltime-margin", "3600s"), "wall time", STOPPED),
    (("--until", 0.025), "until", DONE)])
def test_limits_of_a_session(scene, whole, tmp_path, options, reason, code):
    finished = solver(scene, tmp_path, *options)
    assert finished.returncode == code, finished.stderr
    assert status(tmp_path)["reason"] == reason and len(checkpoint_paths(tmp_path)) >= 1
    restart(scene, tmp_path)
    assert_same_end(tmp_path, whole)


def test_stop_file(scene, tmp_path):
    process = started(scene, tmp_path)
    (tmp_path / "stop").touch()
    process.communicate(timeout=60)
    assert process.returncode == STOPPED and status(tmp_path)["reason"] == "stop file"
    assert not (tmp_path / "stop").exists()   # the next session is not stopped by it


def test_killed_runs_go_on(scene, whole, tmp_path):
    for delay in (0.0, 2.5):
        process = subprocess.Popen(command(scene, tmp_path, "--restart"),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if tmp_path.joinpath("status.json").exists():
            time.sleep(delay)
        else:
            wait_for(lambda: tmp_path.joinpath("status.json").exists())
        process.kill()
        process.wait()
        for frame in snapshot_frames(tmp_path):
            assert check(snapshot_path(tmp_path, frame), SNAPSHOT) == ""
    restart(scene, tmp_path)
    assert_same_end(tmp_path, whole)
    assert not list(tmp_path.glob("*/*.tmp"))


def test_other_ranks_go_on_to_solver_tolerance(scene, whole, tmp_path, mpirun):
    assert solver(scene, tmp_path, "--until", 0.05).returncode == DONE
    finished = mpirun(2, "-m", "solver", scene, "-o", tmp_path, "--restart", "--set",
                      "output.checkpoint_every=0.0")
    assert finished.returncode == DONE, finished.stdout
    mine, theirs = (datasets(snapshot_path(folder, FRAMES)) for folder in (tmp_path, whole))
    for name in "uvwT":
        np.testing.assert_allclose(mine[f"fields/{name}"], theirs[f"fields/{name}"], atol=1e-7)
    for name in ("position", "mass"):
        ours, others = (run[f"particles/fuel/{name}"][np.argsort(run["particles/fuel/id"])]
                        for run in (mine, theirs))
        np.testing.assert_allclose(ours, others, atol=1e-7)


def test_a_signal_to_one_rank_stops_all_and_it_goes_on(scene, tmp_path, mpirun):
    out, coarse = tmp_path / "out", ("--set", "time.dt_max=1e-3")
    environment = {name: value for name, value in os.environ.items()
                   if not name.startswith(("OMPI_", "PMIX_"))}
    environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    process = subprocess.Popen(["mpirun", "--oversubscribe", "-n", "2",
                                *command(scene, out, *coarse)], env=environment, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    wait_for(lambda: snapshot_path(out, 1).exists() or process.poll() is not None)
    children = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True)
    os.kill(int(children.stdout.split()[-1]), signal.SIGUSR1)
    process.communicate(timeout=60)
    assert process.returncode == STOPPED
    finished = mpirun(2, "-m", "solver", scene, "-o", out, "--restart", *coarse)
    assert finished.returncode == DONE and snapshot_frames(out) == list(range(FRAMES + 1))


def test_a_finished_run_can_be_made_longer(scene, whole, tmp_path):
    assert solver(scene, tmp_path, "--set", "time.end=0.04").returncode == DONE
    again = restart(scene, tmp_path, "--set", "time.end=0.04")     # nothing is left to do
    assert "continues at step" in again.stdout and snapshot_frames(tmp_path) == [0, 1, 2, 3, 4]
    assert "time.end: 0.04 → 0.06" in restart(scene, tmp_path).stdout
    assert_same_end(tmp_path, whole)


def test_a_checkpoint_of_another_grid_is_refused(scene, tmp_path):
    assert solver(scene, tmp_path, "--until", 0.01).returncode == DONE
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    refused = solver(scene, tmp_path, "--restart", "--set", "domain.cells=[8, 8, 8]")
    assert refused.returncode == BAD_INPUT and "domain.cells = [16, 14, 12]" in refused.stderr
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


@pytest.mark.parametrize("text, seconds", [("3h50m", 13800), ("90m", 5400), ("45s", 45),
                                           ("3:50:00", 13800), ("3:50", 13800), ("5400", 5400),
                                           ("1d", 86400)])
def test_durations(text, seconds):
    assert seconds_of(text) == seconds


@pytest.mark.parametrize("text", ["", "soon", "3h-5m", "-3", "1:2:3:4"])
def test_no_durations(text):
    with pytest.raises(ValueError, match="fix: write it as in"):
        seconds_of(text)
