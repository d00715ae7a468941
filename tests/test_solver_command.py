"""`python -m solver` as a user types it: plan, errors, a run, a refusal to overwrite, a failure."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from partition.build import build as build_fragments
from partition.fragments import write
from solver.files import read_snapshot, snapshot_frames
from solver.scene import load

pytestmark = pytest.mark.serial
SCENES = Path(__file__).parent.parent / "runs" / "scenes"
SMALL = """
[domain]
cells = [12, 10, 8]
[time]
end = 0.02
frame = 0.008
[initial]
noise = 0.1
"""
FIRE = SMALL + """
[fuel]
particles = 200
ignited = 20
mass = 1e-3
burn_rate = 0.05
"""


def solver(*arguments, cwd=None) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "solver", *map(str, arguments)], cwd=cwd,
                          capture_output=True, text=True, timeout=100, stdin=subprocess.DEVNULL)


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(FIRE)
    return path


def test_plan_says_what_runs_and_why_not(scene, tmp_path):
    finished = solver(scene, "--plan", "-o", tmp_path / "out")
    assert finished.returncode == 0
    rows = {line.split()[0]: line for line in finished.stdout.splitlines()[2:]}
    assert "runs" in rows["burn"] and "runs" in rows["project"]
    assert "skipped" in rows["bodies"] and "no [[body]]" in rows["bodies"]
    assert not (tmp_path / "out").exists()


def test_help_and_parameters_print_the_table():
    for option in ("--help", "--parameters"):
        finished = solver(option)
        assert finished.returncode == 0
        assert "burn_rate = 0.21 [M/s] > 0: mass burnt per time (z_f)" in finished.stdout


def test_a_reader_that_has_seen_enough_of_the_table_is_no_failure():
    """As in `python -m solver --parameters | head`."""
    reader, writer = os.pipe()
    os.close(reader)
    finished = subprocess.run([sys.executable, "-m", "solver", "--parameters"], stdout=writer,
                              stderr=subprocess.PIPE, text=True, timeout=100)
    os.close(writer)
    assert finished.stderr == "" and finished.returncode == -signal.SIGPIPE


def test_a_run_leaves_frames_log_status_and_the_scene(scene, tmp_path):
    out = tmp_path / "out"
    finished = solver(scene, "-o", out, "--set", "time.cfl=0.4")
    assert finished.returncode == 0, finished.stderr
    assert snapshot_frames(out) == [0, 1, 2, 3]
    assert [read_snapshot(out, n).time for n in range(4)] == [0, 0.008, 0.016, 0.02]
    assert load(out / "scene.toml").time.cfl == 0.4
    status = json.loads((out / "status.json").read_text())
    assert status["state"] == "done" and status["frame"] == 3
    steps = [json.loads(line) for line in (out / "run.log.jsonl").read_text().splitlines()]
    assert [step["step"] for step in steps] == list(range(1, status["step"] + 1))
    assert all(step["divergence"] < 1e-8 and step["iterations"] >= 1 and step["reason"]
               for step in steps)
    lines = [line for line in (out / "run.log").read_text().splitlines()
             if line.startswith("step")]
    assert len(lines) == len(steps)
    assert "ms per step" in finished.stdout and "set-up" in finished.stdout
    assert steps[-1]["gas"] == pytest.approx(2.61 * steps[-1]["burnt"], rel=1e-12)


def test_a_folder_with_a_run_is_kept(scene, tmp_path):
    out = tmp_path / "out"
    assert solver(scene, "-o", out).returncode == 0
    before = (out / "run.log").read_text()
    refused = solver(scene, "-o", out)
    assert refused.returncode == 2 and "--overwrite" in refused.stderr
    assert (out / "run.log").read_text() == before
    assert solver(scene, "-o", out, "--overwrite", "--set", "time.end=0.008").returncode == 0
    assert snapshot_frames(out) == [0, 1]


@pytest.mark.parametrize("text, overrides, words", [
    (SMALL.replace("cells", "cell"), [], ["domain.cell", "unknown key"]),
    (FIRE + '[domain.boundary]\n', ['domain.boundary="wall"'], ["open a face", "spread"]),
    (SMALL + '[[body]]\nname="a"\nshape="box"\ndensity=1.0\n', [], ["fragments.h5", "partition"]),
    (SMALL, ["time.end=0.001"], ["time.frame"]),
])
def test_bad_input_is_one_line_and_nothing_is_written(tmp_path, text, overrides, words):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    out = tmp_path / "out"
    finished = solver(path, "-o", out, *(part for o in overrides for part in ("--set", o)))
    assert finished.returncode == 2
    message = finished.stderr.strip()
    assert message.startswith("error: ") and "\n" not in message
    for word in words:
        assert word in message
    assert not out.exists()


def test_what_only_a_stage_can_refuse_is_refused_before_anything_is_written(tmp_path):
    path, pieces, out = tmp_path / "soft.toml", tmp_path / "pieces.h5", tmp_path / "out"
    path.write_text(SMALL + '[[body]]\nname = "a"\nshape = "box"\nsize = [0.2, 0.2, 0.2]\n'
                    'place = [3.0, 0.5, 0.5]\ndensity = 1.0\ndeform_until = { time = 0.01 }\n')
    write(pieces, build_fragments(load(path)), {})
    finished = solver(path, "-o", out, "--fragments", pieces)
    assert finished.returncode == 2 and "Traceback" not in finished.stderr
    assert finished.stderr.startswith("error: ") and "body" in finished.stderr
    assert not out.exists()


def test_petsc_options_choose_the_pressure_solver(scene, tmp_path):
    """Written last or in quotes; both end in the flow that the default makes."""
    steps = []
    for name, words in (("default", ()), ("last", ("--", "-pressure_pc_type", "gamg")),
                        ("quoted", ("--petsc", "-pressure_pc_type icc -pressure_ksp_view"))):
        finished = solver(scene, "-o", tmp_path / name, *words)
        assert finished.returncode == 0, finished.stderr
        log = [json.loads(line) for line in
               (tmp_path / name / "run.log.jsonl").read_text().splitlines()]
        steps.append([entry for entry in log if "iterations" in entry])
    assert "type: icc" in finished.stdout
    default, last, quoted = ([s["iterations"] for s in found] for found in steps)
    assert max(default) == 3 < min(last) < min(quoted)
    for found in steps[1:]:
        assert found[-1]["energy"] == pytest.approx(steps[0][-1]["energy"], rel=1e-8)


@pytest.mark.parametrize(("options", "word"), [
    ("-pressure_pc_typ gamg", "-pressure_pc_typ:"), ("-pc_type gamg", "-pc_type:"),
    ("-pressure_pc_type nonsense", "nonsense")])
def test_petsc_options_that_nothing_uses_are_refused(scene, tmp_path, options, word):
    finished = solver(scene, "-o", tmp_path / "out", "--", *options.split())
    assert finished.returncode == 2 and word in finished.stderr
    assert "fix:" in finished.stderr and finished.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_too_many_ranks_names_what_works(scene, tmp_path, mpirun):
    finished = mpirun(6, "-m", "solver", scene, "-o", tmp_path / "out", "--set",
                      "domain.cells=[8, 4, 4]")
    assert finished.returncode == 2
    assert "at most 4" in finished.stdout
    assert not (tmp_path / "out").exists()


def test_a_flow_that_blows_up_ends_with_stage_step_and_status(scene, tmp_path):
    out = tmp_path / "out"
    finished = solver(scene, "-o", out, "--set", "fuel.gas=1e30")
    assert finished.returncode == 1
    assert "step" in finished.stderr and "Traceback" not in finished.stderr
    status = json.loads((out / "status.json").read_text())
    assert status["state"] == "failed" and status["message"] in finished.stderr


def test_a_step_that_collapses_ends_with_one_message_and_the_state(tmp_path):
    scene = tmp_path / "small.toml"
    scene.write_text(SMALL + '[fluid]\nsource = "1e13*exp(-100*((x-.5)**2+(y-.5)**2))"\n')
    finished = solver(scene, "-o", tmp_path / "out")
    assert finished.returncode == 1
    assert "has collapsed" in finished.stderr and "fix:" in finished.stderr
    assert finished.stderr.count("\n") == 1 and "failed.h5" in finished.stderr
    assert (tmp_path / "out" / "failed.h5").is_file()
    assert json.loads((tmp_path / "out" / "status.json").read_text())["state"] == "failed"


def test_the_thesis_scene_holds_its_table():
    scene = load(SCENES / "window_thesis.toml")
    fuel, soot, fluid = scene.fuel, scene.soot, scene.fluid
    assert (fuel.particles, fuel.ignited, fuel.rate) == (1000, 10, 50 / 1e-3)
    assert (fuel.mass, fuel.burn_rate, fuel.gas, fuel.soot) == (0.36, 0.21, 2.61, 1.0)
    assert fuel.heat == pytest.approx(23000 / 32**3, rel=1e-4)
    assert (fuel.thermal_mass, fuel.heat_transfer, fuel.drag) == (20.54, 200000, 0)
    assert (soot.threshold, soot.burn_rate, soot.min_mass) == (0.02, 0.5, 1e-5)
    assert (fluid.cooling, fluid.conductivity, fluid.ambient_temperature) == (5, 0, 5)
    assert scene.detonation.position == (0.46573, 0.52375, 0.48)
    assert scene.body[0].force == 30 and scene.body[0].fracture.pieces == 16
    assert scene.domain.cells == (32, 32, 32) and scene.time.frame == 1e-3
