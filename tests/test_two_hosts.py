"""A run over two hosts: the same files as on one, restart there, and an end when a host is lost.

The hosts are network namespaces of this machine (runs/jobs/two_hosts.sh).
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from runs.stress import compare, launch
from runs.stress.blast import FIRE
from solver.files import snapshot_frames

SCRIPT = Path(__file__).parent.parent / "runs" / "jobs" / "two_hosts.sh"


def _makes_namespaces():
    if os.geteuid() != 0 or shutil.which("ip") is None:
        return False
    made = subprocess.run(["ip", "netns", "add", "brisance-probe"], capture_output=True)
    subprocess.run(["ip", "netns", "del", "brisance-probe"], capture_output=True)
    return made.returncode == 0


pytestmark = [pytest.mark.serial, pytest.mark.skipif(
    not _makes_namespaces(), reason="network namespaces need root and ip")]


def command(scene, out, *options):
    return [sys.executable, "-m", "solver", str(scene), "-o", str(out), *options]


def on_two_hosts(*arguments):
    return subprocess.run(["bash", str(SCRIPT), *arguments], timeout=120, text=True,
                          env=launch.environment(), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)


def test_there_are_two_hosts():
    names = on_two_hosts("hostname").stdout.split()
    assert len(names) == 2 and names[0] != names[1]


def test_a_run_and_its_restart_are_those_of_one_host(tmp_path, mpirun):
    scene = tmp_path / "scene.toml"
    scene.write_text(FIRE.replace("2e-4", "1e-3"))
    assert mpirun(2, *command(scene, tmp_path / "one")[1:]).returncode == 0
    started = on_two_hosts(*command(scene, tmp_path / "two", "--until", "0.03"))
    assert started.returncode == 0, started.stdout
    ended = on_two_hosts(*command(scene, tmp_path / "two", "--restart"))
    assert ended.returncode == 0 and "continues at step" in ended.stdout, ended.stdout
    assert compare.difference(tmp_path / "two", tmp_path / "one") == ""


def test_when_the_ranks_of_one_host_are_killed_all_end(tmp_path):
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(FIRE.replace("end = 0.06", "end = 60.0"))
    process = subprocess.Popen(["bash", str(SCRIPT), *command(scene, out)],
                               env=launch.environment(), stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    try:
        assert launch.wait_for(lambda: len(snapshot_frames(out)) > 1, 60)
        ranks = _ranks_of(out)
        assert len(ranks) == 2
        os.kill(ranks[-1], signal.SIGKILL)
        start = time.monotonic()
        assert process.wait(20) != 0 and time.monotonic() - start < 10
        assert launch.wait_for(lambda: not any(map(launch.alive, ranks)), 10)
        assert compare.broken_files(out) == []
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(20)


def _ranks_of(out):
    """The solver's processes that write to `out`."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().split(b"\0")
        except OSError:
            continue
        if words[:3] == [sys.executable.encode(), b"-m", b"solver"] and str(out).encode() in words:
            found.append(int(entry.parent.name))
    return sorted(found)
