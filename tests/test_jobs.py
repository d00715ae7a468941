"""The job scripts: a signal before the limit ends in a checkpoint, code 85 and a new submission."""

import os
import signal
import subprocess
from pathlib import Path

import pytest

from runs.stress import launch
from runs.stress.blast import FIRE
from solver.files import checkpoint_paths, snapshot_frames

pytestmark = pytest.mark.serial

ROOT = Path(__file__).parent.parent
JOBS = ROOT / "runs" / "jobs"


@pytest.fixture
def queue(tmp_path):
    """A folder of commands that stand in for the batch system's and write down what they get."""
    commands = tmp_path / "bin"
    commands.mkdir()
    for name in ("scontrol", "qsub"):
        (commands / name).write_text(f'#!/bin/sh\necho {name} "$@" >>{tmp_path}/asked\n')
        (commands / name).chmod(0o755)
    return {"PATH": f"{commands}:{os.environ['PATH']}"}, tmp_path / "asked"


@pytest.mark.parametrize("path", sorted(JOBS.glob("*.sh")), ids=lambda path: path.name)
def test_they_are_shell(path):
    assert subprocess.run(["bash", "-n", path]).returncode == 0


def start(script, *arguments, **environment):
    """The script as the batch system starts it: in the checkout, where a .venv may be missing."""
    text = (JOBS / script).read_text().replace("source .venv/bin/activate", ":")
    return subprocess.Popen(["bash", "-c", text, script, *map(str, arguments)], cwd=ROOT,
                            env=launch.environment() | environment, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)


def signalled(process, out):
    assert launch.wait_for(lambda: len(snapshot_frames(out)) > 1 or process.poll() is not None, 90)
    process.send_signal(signal.SIGUSR1)
    return process.communicate(timeout=90)[0]


def test_a_slurm_job_is_requeued_and_goes_on(tmp_path, queue):
    commands, asked = queue
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(FIRE)
    slurm = commands | {"SLURM_JOB_ID": "7", "SLURM_NTASKS": "1"}
    process = start("slurm.sh", scene, out, **slurm)
    said = signalled(process, out)
    assert process.returncode == 85, said
    assert asked.read_text() == "scontrol requeue 7\n" and checkpoint_paths(out)
    again = start("slurm.sh", scene, out, **slurm)
    said = again.communicate(timeout=120)[0]
    assert again.returncode == 0 and "continues at step" in said
    assert asked.read_text().count("\n") == 1       # done: not requeued


def test_a_member_of_a_slurm_array_likewise(tmp_path, queue):
    commands, asked = queue
    (tmp_path / "scene.toml").write_text(FIRE)
    table = tmp_path / "table.toml"
    table.write_text('scene = "scene.toml"\n[grid]\nseed = [1, 2]')
    out = tmp_path / "out"
    slurm = commands | {"SLURM_JOB_ID": "8", "SLURM_ARRAY_TASK_ID": "1", "SLURM_NTASKS": "1"}
    process = start("slurm_array.sh", table, out, **slurm)
    said = signalled(process, out / "1")
    assert process.returncode == 85, said
    assert asked.read_text() == "scontrol requeue 8\n" and not (out / "0").exists()
    assert launch.wait_for(lambda: (out / "1" / "status.json").exists(), 1)


def test_a_pbs_job_is_submitted_again(tmp_path, queue):
    commands, asked = queue
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(FIRE)
    pbs = commands | {"PBS_JOBID": "9", "PBS_O_WORKDIR": str(ROOT), "scene": str(scene),
                      "out": str(out), "OMPI_MCA_rmaps_base_oversubscribe": "1"}
    process = start("pbs.sh", **pbs)
    assert launch.wait_for(lambda: len(snapshot_frames(out)) > 1 or process.poll() is not None, 90)
    (out / "stop").touch()
    said = process.communicate(timeout=90)[0]
    assert process.returncode == 85, said
    assert asked.read_text() == f"qsub -v scene={scene},out={out} runs/jobs/pbs.sh\n"
