"""What a scene does not need is not imported, allocated or timed."""

import json
import subprocess
import sys
import tracemalloc

import pytest

from solver import estimate
from solver.kernel import GHOSTS
from tests.flow_case import make_scene, simulation

QUIET = """
import json, sys
from mpi4py import MPI
from solver import scene as scenes
from solver.step import Simulation
scene = scenes.build({"domain": {"cells": [8, 8, 8]}, "time": {"end": 1.0, "frame": 1.0},
                      "initial": {"noise": 0.1}})
simulation = Simulation(scene, MPI.COMM_WORLD)
simulation.advance(1.0)
simulation.destroy()
print(json.dumps(sorted(sys.modules)))
"""


@pytest.mark.serial
def test_air_alone_imports_no_fire_no_bodies_and_no_meshes():
    done = subprocess.run([sys.executable, "-c", QUIET], capture_output=True, text=True, check=True)
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert {"solver.momentum", "solver.project"} <= loaded
    unwanted = {"solver.swarm", "solver.burn", "solver.particles", "solver.emit", "solver.bodies",
                "solver.rigid", "solver.temperature", "solver.cool", "solver.vorticity",
                "meshio", "trimesh", "embreex", "matplotlib", "scipy.spatial"}
    assert loaded & unwanted == set()


def test_air_alone_holds_no_temperature_no_source_and_no_particles():
    with simulation(make_scene((8, 8, 8), "open", initial={"noise": 0.1})) as sim:
        state = sim.state
        assert (state.T, state.T_new, state.phi, state.heat, state.swarm, state.bodies) == (
            None,) * 6
        assert set(sim.stages) == {"momentum", "project"}


@pytest.mark.parametrize("sections, stage", [
    ({"initial": {"T": "5"}}, "temperature"),
    ({"initial": {"T": "5"}, "fluid": {"cooling": 1.0}}, "cool"),
    ({"fluid": {"buoyancy": 1.0}}, "buoyancy"),
    ({"fluid": {"vorticity_confinement": 1.0}}, "vorticity"),
    ({"fluid": {"source": "x"}}, "source"),
    ({"fluid": {"force": ["y", "0", "0"]}}, "force"),
    ({"fuel": {"particles": 5, "ignited": 5}}, "burn"),
])
def test_what_is_asked_for_runs(sections, stage):
    with simulation(make_scene((8, 8, 8), "open", **sections)) as sim:
        sim.advance(1.0)
        assert stage in sim.stages and sim.seconds[stage] > 0


@pytest.mark.serial
@pytest.mark.parametrize("fluid", [
    {}, {"diffusion": "explicit"}, {"diffusion": "implicit"}, {"vorticity_confinement": 0.1},
    {"diffusion": "implicit", "vorticity_confinement": 0.1}], ids=str)
@pytest.mark.parametrize("integrator", ["euler", "rk3"])
def test_the_plan_counts_the_arrays_that_a_run_has(fluid, integrator):
    """numpy's, of the size of the grid; two vectors of PETSc stand beside them."""
    n = 24
    scene = make_scene((n, n, n), "wall", initial={"T": "5+x", "u": "sin(y)"},
                       fluid={"reynolds": 10.0, **fluid}, time={"integrator": integrator})
    with simulation(scene) as sim:   # what is made once: modules, kernels
        sim.advance(1.0)
    tracemalloc.start()
    try:
        with simulation(scene) as sim:
            sim.advance(1.0)
            traced, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    number = traced / 8 / (n + 2 * GHOSTS)**3 + 2 * (n / (n + 2 * GHOSTS))**3
    assert estimate.arrays(scene) - 5 < number < estimate.arrays(scene)
