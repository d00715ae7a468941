"""A run that goes on from a checkpoint is the run that never stopped: bit for bit on as many ranks,
to the tolerance of the pressure solve on others."""

import numpy as np
import pytest
from mpi4py import MPI

from solver.checkpoint import CLOCK, FIELDS, Checkpoints, differences, newest
from solver.files import FileError, checkpoint_paths
from tests.fire_case import build, merged, running

COMM = MPI.COMM_WORLD

# Fire that emits and makes soot, a pane that is soft at first, open faces, several substeps.
BLAST = {
    "domain": {"cells": [12, 10, 8]}, "time": {"end": 0.08, "frame": 0.02, "integrator": "rk2"},
    "fluid": {"cooling": 500.0, "vorticity_confinement": 0.1, "buoyancy": 0.02},
    "initial": {"noise": 0.5},
    "detonation": {"position": (0.5, 0.5, 0.5), "fill": "ball"},
    "fuel": {"particles": 300, "ignited": 100, "mass": 1e-3, "burn_rate": 0.04, "gas": 0.5,
             "heat": 3.0, "rate": 500.0, "heat_transfer": 5e4},
    "soot": {"threshold": 4e-4, "burn_rate": 1e-2, "min_mass": 1e-8},
    "body": [{"name": "pane", "shape": "pane", "size": (0.4, 0.4, 0.02), "place": (0.5, 0.5, 0.7),
              "areal_density": 2.0, "points": 30, "force": 30.0,
              "fracture": {"method": "bfs", "pieces": 3}, "deform_until": {"time": 0.03}}]}


def advance(simulation, end, until_step=None):
    """Frame by frame, as a run does; stops after a step of that number."""
    settings, state = simulation.scene.time, simulation.state
    while state.time < end:
        for _ in simulation.run_to(min((state.frame + 1) * settings.frame, end)):
            if state.step == until_step:
                return
        state.frame += 1


def everything(simulation):
    """All that a checkpoint has to bring back, as arrays; particles by id, of all ranks."""
    state = simulation.state
    parts = {name: getattr(state, name)[2:-2, 2:-2, 2:-2].copy() for name in FIELDS}
    parts |= {name: np.array(getattr(state, name)) for name in CLOCK}
    points = np.concatenate(COMM.allgather(state.swarm.points.copy()))
    points = points[np.argsort(points["id"])]
    parts |= {f"particle {name}": points[name] for name in points.dtype.names}
    parts |= {f"body {name}": getattr(state.bodies, name).copy()
              for name in ("position", "orientation", "velocity", "spin", "inertia", "vertices")}
    parts |= {name: np.array(getattr(simulation.report, name)) for name in ("gas", "heat", "burnt")}
    return parts


@pytest.mark.parametrize("changes, step", [
    ({}, 3), ({}, 9), ({"time": {"integrator": "euler"}, "fluid": {"advection": "donor"}}, 5),
    ({"domain": {"boundary": {"x_min": "periodic", "x_max": "periodic", "z_min": "wall"}}}, 7),
    *(({"domain": {"boundary": "wall", "expansion": "spread"}, "time": {"integrator": "rk3"},
        "fluid": {"reynolds": 0.5, "diffusion": "implicit"}}, step) for step in (1, 2, 6))])
def test_it_continues_bit_for_bit(shared_path, changes, step):
    scene = merged(BLAST, changes)
    with running(**scene) as simulation:
        advance(simulation, 0.08, step)
        assert simulation.state.step == step   # between frames
        Checkpoints(simulation, shared_path, 2).write()
        advance(simulation, 0.08)
        never_stopped = everything(simulation)
        assert len(never_stopped["particle id"]) > 300 and never_stopped["burnt"] > 0
        assert simulation.state.step > step + 3
    with running(**scene) as simulation:
        Checkpoints(simulation, shared_path, 2).restore(newest(shared_path, print))
        assert simulation.state.step == step
        advance(simulation, 0.08)
        for name, value in everything(simulation).items():
            np.testing.assert_array_equal(value, never_stopped[name], err_msg=name)


@pytest.mark.parametrize("changes", [
    {"fluid": {"diffusion": "explicit"}}, {"time": {"integrator": "rk2"},
                                           "fluid": {"diffusion": "auto"}},
    {"time": {"integrator": "euler"}, "fluid": {"advection": "donor"}}])
def test_it_goes_on_with_viscosity_treated_otherwise(shared_path, changes):
    """The pressures of the implicit substeps before are not those of the substeps to come."""
    scene = merged(BLAST, {"domain": {"boundary": "wall", "expansion": "spread"},
                           "time": {"integrator": "rk3"},
                           "fluid": {"reynolds": 5.0, "diffusion": "implicit"}})
    with running(**scene) as simulation:
        advance(simulation, 0.08, 3)
        assert simulation.state.implicit_steps == 3
        path = Checkpoints(simulation, shared_path, 2).write()
    with running(**merged(scene, changes)) as simulation:
        Checkpoints(simulation, shared_path, 2).restore(path)
        assert simulation.state.step == 3 and simulation.state.implicit_steps == 0
        simulation.advance(0.08)
        assert np.isfinite(simulation.report.energy)


def test_a_restored_state_is_the_one_saved_ghosts_included(shared_path):
    with running(**BLAST) as simulation:
        advance(simulation, 0.08, 4)
        path = Checkpoints(simulation, shared_path, 2).write()
        saved = {name: getattr(simulation.state, name).copy() for name in "uvwT"}
        report = simulation.report
    with running(**BLAST) as simulation:
        Checkpoints(simulation, shared_path, 2).restore(path)
        for name, value in saved.items():
            np.testing.assert_array_equal(getattr(simulation.state, name), value)
        assert simulation.report == report


def test_only_the_newest_are_kept(shared_path):
    with running() as simulation:
        checkpoints = Checkpoints(simulation, shared_path, 2)
        for _ in range(4):
            simulation.state.step += 1
            checkpoints.write()
    assert [path.name for path in checkpoint_paths(shared_path)] == ["chk_00000003.h5",
                                                                     "chk_00000004.h5"]


@pytest.mark.serial
@pytest.mark.parametrize("damage", ["byte", "cut", "empty", "unfinished"])
def test_a_damaged_checkpoint_is_said_and_the_one_before_is_taken(tmp_path, damage):
    with running() as simulation:
        checkpoints = Checkpoints(simulation, tmp_path, 3)
        for _ in range(2):
            simulation.state.step += 1
            checkpoints.write()
    good, bad = checkpoint_paths(tmp_path)
    content = bytearray(bad.read_bytes())
    if damage == "byte":
        content[len(content) // 2] ^= 1
    length = {"cut": len(content) // 2, "empty": 0}.get(damage, len(content))
    bad.write_bytes(content[:length])
    if damage == "unfinished":
        import h5py
        with h5py.File(bad, "r+") as file:
            del file.attrs["complete"]
    said: list[str] = []
    assert newest(tmp_path, said.append) == good
    assert len(said) == 1 and str(bad) in said[0]
    assert bad.with_name(bad.name + ".damaged").exists()   # nothing is thrown away


@pytest.mark.serial
def test_a_scene_that_does_not_fit_is_refused_and_other_changes_are_told(tmp_path):
    with running(**BLAST) as simulation:
        path = Checkpoints(simulation, tmp_path, 2).write()
    assert differences(path, build(**BLAST)) == []
    longer = build(**merged(BLAST, {"time": {"end": 0.2}, "fluid": {"cooling": 1.0}}))
    assert differences(path, longer) == ["fluid.cooling: 500.0 → 1.0", "time.end: 0.08 → 0.2"]
    with pytest.raises(FileError, match=r"domain.cells = \[12, 10, 8\].*\[8, 8, 8\]"):
        differences(path, build(**merged(BLAST, {"domain": {"cells": [8, 8, 8]}})))
    with pytest.raises(FileError, match="soot"):
        differences(path, build(**merged(BLAST, {"soot": None})))
