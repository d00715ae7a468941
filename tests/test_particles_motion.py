"""Tracers follow the flow to second order; particles with inertia obey the drag law for any dt."""

import numpy as np
import pytest

from solver.particles import move
from solver.state import coordinates
from solver.swarm import PARTICLE
from tests.fire_case import COMM, QUIET, add, gathered, running

STILL = {"domain": {"boundary": "periodic", "expansion": "spread"}}
WHERE = [0.5, 0.5, 0.5]


def fill(simulation, u, v, w):
    """Set the velocity, ghosts included, to functions of x, y, z."""
    state = simulation.state
    for axis, (field, function) in enumerate(zip(state.velocity, (u, v, w), strict=True)):
        at = coordinates(state.grid, axis)
        field[...] = function(at["x"], at["y"], at["z"]) + 0 * sum(at.values())


def particle_steps(simulation, steps, dt):
    for _ in range(steps):
        simulation.stages["particles"][1](simulation.state, dt)


def test_tracer_in_uniform_flow_moves_with_it():
    with running(**STILL, initial={"u": "1", "v": "0.5"}, fuel=QUIET) as simulation:
        add(simulation, [0.1, 0.2, 0.3])
        for _ in simulation.run_to(0.6):
            pass
        point = gathered(simulation)[0]
        assert point["position"] == pytest.approx([0.7, 0.5, 0.3], abs=1e-12)
        assert point["velocity"] == pytest.approx([1, 0.5, 0], abs=1e-12)


def test_tracer_crosses_a_periodic_face():
    with running(**STILL, initial={"u": "-1"}, fuel=QUIET) as simulation:
        add(simulation, [0.1, 0.2, 0.3])
        for _ in simulation.run_to(1.0):
            pass
        assert gathered(simulation)["position"][0] == pytest.approx([0.1, 0.2, 0.3], abs=1e-12)


def test_tracer_in_solid_rotation_is_second_order():
    """The rotating field is linear, so interpolation is exact and the error is that of time."""
    errors = []
    for steps in (20, 40, 80):
        with running(fuel=QUIET) as simulation:
            fill(simulation, lambda x, y, z: 0.5 - y, lambda x, y, z: x - 0.5,
                 lambda x, y, z: 0 * x)
            add(simulation, [0.8, 0.5, 0.5])
            particle_steps(simulation, steps, 1.0 / steps)
            exact = [0.5 + 0.3 * np.cos(1.0), 0.5 + 0.3 * np.sin(1.0), 0.5]
            errors.append(np.abs(gathered(simulation)["position"][0] - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 1.9


@pytest.mark.parametrize("steps", [1, 7, 300])
def test_drag_law_is_exact_for_any_step(steps):
    """k = 2, slip 1, still air: v = 1/7 and path ln(7)/2 = 0.972955 after t = 3."""
    with running(domain={"size": (4.0, 1.0, 1.0)},
                 fuel=QUIET | {"drag": 2.0, "radius": 1.0}) as simulation:
        add(simulation, [0.5, 0.5, 0.5], velocity=[1, 0, 0])
        particle_steps(simulation, steps, 3.0 / steps)
        point = gathered(simulation)[0]
        assert point["velocity"] == pytest.approx([1 / 7, 0, 0], abs=1e-12)
        assert point["position"][0] == pytest.approx(0.5 + 0.972955, abs=1e-6)


@pytest.mark.parametrize("stiffness", [1.0, 1e3, 1e6])
def test_drag_never_overshoots_the_flow(stiffness):
    with running(**STILL, initial={"u": "1"},
                 fuel=QUIET | {"drag": stiffness, "radius": 1.0}) as simulation:
        add(simulation, [WHERE, WHERE], velocity=[[0, 0, 0], [-3, 2, 0]])
        before = gathered(simulation)["velocity"]
        for _ in range(5):
            particle_steps(simulation, 1, 1.0)
            now = gathered(simulation)["velocity"]
            slip, slip_before = now - [1, 0, 0], before - [1, 0, 0]
            assert np.all(np.linalg.norm(slip, axis=1) < np.linalg.norm(slip_before, axis=1))
            assert np.all((slip * slip_before).sum(axis=1) >= 0)
            before = now
    assert np.linalg.norm(slip) < 2 / stiffness


def test_no_drag_law_divides_by_a_vanished_mass():
    records = np.zeros(2, PARTICLE)
    records["position"], records["velocity"] = WHERE, [1, 0, 0]
    records["mass"] = 0.0, 1e-300
    field = np.zeros((12, 12, 12))
    move(records, field, field, field, field, np.full(3, 8.0), np.zeros(3), 0.1, 1.0, 1.0, 1e9)
    assert np.all(np.isfinite(records["position"])) and np.all(np.isfinite(records["velocity"]))
    assert np.abs(records["velocity"][1]).max() < 1e-290


def test_a_particle_that_is_nowhere_ends_the_run_on_all_ranks():
    with running(fuel=QUIET) as simulation:
        swarm = simulation.state.swarm
        records = np.zeros(3 if COMM.rank == 0 else 0, PARTICLE)
        records["position"][1:2] = np.nan
        swarm.append(records)
        with pytest.raises(FloatingPointError, match="1 particles are nowhere"):
            swarm.settle()
