"""Bodies in a flow: carried with it and never past it, turned its way, free outside the box."""

import numpy as np
import pytest

from tests.fire_case import merged, run, running
from tests.test_particles_motion import fill

STREAM = {"domain": {"boundary": "periodic", "expansion": "spread"}, "initial": {"u": "1"},
          "fluid": {"gravity": (0.0, 0.0, 0.0)}}
STILL = {"domain": {"boundary": "wall"}, "fluid": {"gravity": (0.0, -9.8, 0.0)}}
BOX = {"name": "box", "shape": "box", "size": (0.1, 0.2, 0.3), "detail": 0, "density": 100.0}
# face-on to a flow along x
PANE = {"name": "pane", "shape": "pane", "size": (0.3, 0.3, 0.01), "rotate": (0.0, 90.0, 0.0),
        "areal_density": 10.0, "points": 20}


def body(base, **changes):
    return {"body": [merged(base, changes)]}


def state_of(simulation):
    bodies = simulation.state.bodies
    return bodies.position[0].copy(), bodies.velocity[0].copy(), bodies.spin[0].copy()


def throw(simulation, dt):
    simulation.stages["bodies"][1](simulation.state, dt)


@pytest.mark.parametrize("force, dt", [(30.0, 0.01), (3e3, 0.01), (3e8, 0.1)])
def test_pane_face_on_to_a_flow_reaches_its_speed_and_never_exceeds_it(force, dt):
    with running(**STREAM, **body(PANE, force=force)) as simulation:
        speeds = []
        for _ in range(400 if force < 100 else 50):
            throw(simulation, dt)
            speeds.append(state_of(simulation)[1][0])
        assert np.all(np.diff(speeds) >= -1e-12) and max(speeds) <= 1 + 1e-12
        assert speeds[-1] > 0.99
        # m = 2 × 0.3² × σ and the rim, k = F_c / m: v = 1 - (1 + k dt)^-n, the implicit step
        k = force / simulation.state.bodies.mass[0]
        exact = 1 - (1 + k * dt) ** -np.arange(1.0, len(speeds) + 1)
        assert speeds == pytest.approx(exact, rel=1e-9)
        assert np.abs(state_of(simulation)[2]).max() < 1e-9   # and does not turn


def test_relaxation_is_that_of_the_drag_law():
    """v = 1 - exp(-F_c t / m), first order in dt."""
    errors = []
    for steps in (20, 40, 80):
        with running(**STREAM, **body(PANE)) as simulation:
            time = simulation.state.bodies.mass[0] / 30.0
            for _ in range(steps):
                throw(simulation, time / steps)
            errors.append(abs(state_of(simulation)[1][0] - (1 - np.exp(-1))))
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([2, 2], rel=0.05)


def test_counter_clockwise_flow_spins_and_lifts_counter_clockwise():
    with running(**STILL, **body(BOX, size=(0.2, 0.2, 0.2))) as simulation:
        fill(simulation, lambda x, y, z: 0.5 - y, lambda x, y, z: x - 0.5, lambda x, y, z: 0 * x)
        simulation.state.bodies.gravity[:] = 0
        for _ in range(200):
            throw(simulation, 0.05)
        position, velocity, spin = state_of(simulation)
        assert spin == pytest.approx([0, 0, 1], abs=1e-3)   # that of the flow, and not more
        assert np.abs(position - 0.5).max() < 1e-9 and np.abs(velocity).max() < 1e-9


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_torque_has_the_sign_of_the_flow_about_every_axis(axis):
    rotation = np.zeros((3, 3))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    rotation[a, b], rotation[b, a] = -1, 1                  # u = e_axis × (x - centre)
    with running(**STILL, **body(BOX)) as simulation:
        def part(n):
            return lambda x, y, z: (rotation[n, 0] * (x - 0.5) + rotation[n, 1] * (y - 0.5)
                                    + rotation[n, 2] * (z - 0.5))
        fill(simulation, part(0), part(1), part(2))
        throw(simulation, 1e-3)
        assert np.argmax(np.abs(state_of(simulation)[2])) == axis
        assert state_of(simulation)[2][axis] > 0


def test_subdividing_a_mesh_changes_its_path_by_less_than_a_percent():
    ends = []
    for detail in (1, 2, 3):
        with running(domain={"boundary": "wall"}, **body(BOX, detail=detail)) as simulation:
            fill(simulation, lambda x, y, z: 0.5 - y, lambda x, y, z: x - 0.5 + z * z,
                 lambda x, y, z: 0.3 * x * y)
            simulation.state.bodies.gravity[:] = 0
            start = state_of(simulation)[0]
            for _ in range(100):
                throw(simulation, 0.02)
            ends.append(state_of(simulation)[0] - start)
    travelled = np.linalg.norm(ends[-1])
    assert travelled > 0.1
    assert np.linalg.norm(ends[0] - ends[1]) < 0.01 * travelled
    assert np.linalg.norm(ends[1] - ends[2]) < 0.0025 * travelled


@pytest.mark.parametrize("dt_max", [0.5, 0.01])
def test_free_fall_outside_the_box(dt_max):
    """No still air there: v = g t, y = g t²/2, exactly, in steps of any length."""
    with running(**STILL, **body(BOX, place=(5.0, 0.5, 0.5)), time={"dt_max": dt_max}) as sim:
        run(sim, 0.5)
        position, velocity, spin = state_of(sim)
        assert velocity == pytest.approx([0, -4.9, 0], rel=1e-12)
        assert position == pytest.approx([5, 0.5 - 9.8 * 0.5**2 / 2, 0.5], rel=1e-12)
        assert np.all(spin == 0)


def test_falling_body_reaches_the_speed_where_drag_balances_weight():
    """m g / F_c, in still air."""
    with running(**STILL, **body(BOX, force=3000.0)) as simulation:
        for _ in range(400):
            throw(simulation, 1e-4)
        bodies = simulation.state.bodies
        balance = -9.8 * bodies.mass[0] / 3000.0
        assert state_of(simulation)[1] == pytest.approx([0, balance, 0], rel=1e-3)


def test_body_that_crosses_a_periodic_face_is_carried_on():
    with running(**STREAM, **body(PANE, place=(0.95, 0.5, 0.5), force=3e6)) as simulation:
        for _ in range(40):
            throw(simulation, 0.05)
        position, velocity, _ = state_of(simulation)
        assert velocity[0] == pytest.approx(1, rel=1e-4)
        simulation.state.u.fill(0.0)
        for _ in range(40):
            throw(simulation, 0.05)
        assert abs(state_of(simulation)[1][0]) < 1e-4       # far beyond the box it still feels it


def test_pieces_of_a_spinning_body_start_on_its_motion():
    """v = V + ω × arm for each piece, about the centre of the whole."""
    with running(**STILL, **body(PANE, spin=(0.0, 3.0, 0.0), velocity=(1.0, 0.0, 0.0),
                                 fracture={"pieces": 4})) as simulation:
        bodies = simulation.state.bodies
        centre = bodies.mass @ bodies.position / bodies.mass.sum()
        expected = [1, 0, 0] + np.cross([0.0, 3, 0], bodies.position - centre)
        assert bodies.velocity == pytest.approx(expected, abs=1e-12)
        assert np.ptp(bodies.velocity, axis=0).max() > 0.3
        assert bodies.mass @ bodies.velocity == pytest.approx([bodies.mass.sum(), 0, 0], abs=1e-9)
