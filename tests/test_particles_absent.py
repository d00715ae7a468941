"""What a scene has not, it neither imports, allocates nor times."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial

ROOT = Path(__file__).resolve().parent.parent
FIRE = ("solver.swarm", "solver.emit", "solver.burn", "solver.particles")
BODIES = ("solver.bodies", "solver.vertices", "solver.rigid", "solver.inertia")
OPTIONAL = ("solver.soot", "solver.exchange", "solver.deform")
PROGRAM = """
import sys
from solver import scene
from solver.step import Simulation
from partition.build import build
made = scene.build({{"time": {{"end": 1e-3, "frame": 1e-3}},
                    "domain": {{"cells": [4, 4, 4]}}{more}}})
sim = Simulation(made, fragments=build(made) if made.body else None)
sim.advance(1e-3)
print(" ".join(m for m in sys.modules if m.startswith("solver.")))
print(" ".join(sim.seconds))
print(" ".join(n for n in ("T", "phi", "heat", "swarm", "bodies")
               if getattr(sim.state, n) is not None))
sim.destroy()
"""
BOX = '"body": [{"name": "a", "shape": "box", "density": 1.0, "size": (0.1, 0.1, 0.1)%s}]'


def run(more):
    """Modules of the solver, timed stages and allocated parts of a scene with these sections."""
    code = PROGRAM.format(more=", " + more if more else "")
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True,
                            timeout=120)
    assert result.returncode == 0, result.stderr
    return [set(line.split()) for line in result.stdout.splitlines()[-3:]]


def test_plain_flow():
    modules, timed, there = run("")
    assert modules.isdisjoint(FIRE + BODIES + OPTIONAL)
    assert timed.isdisjoint({"emit", "burn", "particles", "bodies"})
    assert there == set()


def test_fire_without_soot_bodies_or_a_load_on_the_air():
    modules, timed, there = run('"fuel": {"particles": 10}')
    assert modules.issuperset(FIRE) and modules.isdisjoint(BODIES + OPTIONAL)
    assert "bodies" not in timed and there == {"T", "phi", "heat", "swarm"}


def test_bodies_without_fire():
    modules, timed, there = run(BOX % "")
    assert modules.issuperset(BODIES) and modules.isdisjoint(FIRE + OPTIONAL)
    assert timed.isdisjoint({"emit", "burn", "particles"}) and there == {"bodies"}


def test_options_are_loaded_where_they_are_asked_for():
    modules, _, _ = run('"soot": {}, "fuel": {"exchange": "two_way"}, '
                        + BOX % ', "deform_until": {"time": 0.1}')
    assert modules.issuperset(OPTIONAL)
