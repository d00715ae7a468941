"""Obstacles: bounces, sliding and rest, against the mechanics of a textbook."""

import numpy as np
import pytest

from solver.scene import SceneError
from tests.fire_case import COMM, merged, run, running
from tests.test_bodies_motion import BOX, PANE, STILL, state_of, throw

CUBE = BOX | {"size": (0.2, 0.2, 0.2), "place": (5.0, 0.5, 0.5)}   # outside the box: no air
GRAVITY = 9.8


def ground(**changes):
    return {"obstacle": [{"place": (0.0, 0.0, 0.0), "normal": (0.0, 2.0, 0.0)} | changes]}


def fly(simulation, dt, steps):
    for _ in range(steps):
        throw(simulation, dt)


def heights(simulation, dt, steps):
    """Of the centre, after each step."""
    found = []
    for _ in range(steps):
        throw(simulation, dt)
        found.append(state_of(simulation)[0][1])
    return np.array(found)


def energy(bodies):
    """½ m v² + ½ ω·Iω + m g y of all pieces."""
    total = 0.0
    for n in range(len(bodies.mass)):
        w, *v = bodies.orientation[n]
        v = np.array(v)
        K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        R = np.eye(3) + 2 * w * K + 2 * K @ K
        spin = R.T @ bodies.spin[n]
        total += (0.5 * bodies.mass[n] * bodies.velocity[n] @ bodies.velocity[n]
                  + 0.5 * spin @ bodies.inertia[n] @ spin
                  - bodies.mass[n] * bodies.gravity @ bodies.position[n])
    return total


def least_gap(bodies):
    """Of all vertices from all planes."""
    w, x, y, z = bodies.orientation[bodies.fragments.piece_of_vertex].T
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    points = np.einsum("abn,nb->na", R, bodies.lever)
    points += bodies.position[bodies.fragments.piece_of_vertex]
    return bodies.ground.gaps(points).min()


@pytest.mark.parametrize("restitution, dt", [(1.0, 1e-3), (0.7, 1e-3), (0.5, 7e-3), (0.0, 1e-3)])
def test_bounce_reaches_the_square_of_the_restitution(restitution, dt):
    """A drop from h = 0.4 comes back to e² h, at the time it takes."""
    drop = 0.4
    with running(**STILL, **ground(restitution=restitution), body=[CUBE]) as simulation:
        fall = np.sqrt(2 * drop / GRAVITY)
        apex = heights(simulation, dt, int(fall * (1 + 1.5 * restitution) / dt) + 10)
        top = apex[int(fall / dt) + 1:].max()
        assert top == pytest.approx(0.1 + restitution ** 2 * drop, abs=GRAVITY * dt ** 2 / 8 + 1e-9)
        assert apex.min() > 0.1 - 1e-12
        assert np.abs(state_of(simulation)[2]).max() < 1e-9


@pytest.mark.parametrize("friction, dt", [(0.5, 1e-3), (0.5, 1e-2), (0.2, 1e-3)])
def test_block_slides_to_a_stop_after_v2_over_2_mu_g(friction, dt):
    flat = CUBE | {"size": (0.4, 0.05, 0.4), "place": (5.0, 0.025, 0.5)}
    velocity = np.array([1.2, 0.0, -0.9])
    with running(**STILL, **ground(friction=friction),
                 body=[flat | {"velocity": tuple(velocity)}]) as simulation:
        fly(simulation, dt, int(2 * 1.5 / (friction * GRAVITY) / dt))
        position, stopped, spin = state_of(simulation)
        way = velocity * 1.5 / (2 * friction * GRAVITY)
        assert position == pytest.approx([5 + way[0], 0.025, 0.5 + way[2]],
                                         abs=friction * GRAVITY * dt ** 2)
        assert np.all(stopped == 0) and np.all(spin == 0)


@pytest.mark.parametrize("angle, slides", [(20.0, False), (30.0, True)])
def test_block_on_a_slope_stays_below_the_angle_of_friction_and_slides_above(angle, slides):
    """μ = tan 25°: rest, or the acceleration g (sin a - μ cos a)."""
    a, mu = np.radians(angle), np.tan(np.radians(25))
    normal = (-np.sin(a), np.cos(a), 0.0)
    place = (0.5 - 0.025 * np.sin(a), 0.5 + 0.025 * np.cos(a), 0.5)
    flat = CUBE | {"size": (0.4, 0.05, 0.4), "place": place, "rotate": (0.0, 0.0, angle),
                   "force": 0.0}
    with running(**STILL, **ground(place=(0.5, 0.5, 0.5), normal=normal, friction=mu),
                 body=[flat]) as simulation:
        fly(simulation, 1e-3, 200)
        moved = state_of(simulation)[0] - place
        down = 0.5 * GRAVITY * (np.sin(a) - mu * np.cos(a)) * 0.2 ** 2 if slides else 0.0
        expected = -down * np.array([np.cos(a), np.sin(a), 0])
        assert moved == pytest.approx(expected, abs=2e-3 * abs(down) + 1e-9)


@pytest.mark.parametrize("base", [CUBE, PANE | {"rotate": (90.0, 0.0, 0.0)}])
def test_what_lies_on_the_ground_stays_there_exactly(base):
    height = 0.1 if base is CUBE else 0.005
    with running(**STILL, **ground(), body=[base | {"place": (5.0, height, 0.5)}]) as simulation:
        before = state_of(simulation)[0]
        fly(simulation, 2e-3, 500)
        position, velocity, spin = state_of(simulation)
        assert np.array_equal(position, before)
        assert not velocity.any() and not spin.any()
        assert np.array_equal(simulation.state.bodies.orientation[0], [1, 0, 0, 0])


@pytest.mark.parametrize("dt", [1e-3, 5e-3])
@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_tumbling_pieces_lose_energy_only_and_come_to_rest(restitution, dt):
    pane = PANE | {"rotate": (30.0, 10.0, 50.0), "place": (5.0, 0.5, 0.5),
                   "velocity": (1.0, 0.0, 2.0), "spin": (5.0, -3.0, 8.0), "fracture": {"pieces": 5}}
    with running(**STILL, **ground(restitution=restitution), body=[pane]) as simulation:
        bodies = simulation.state.bodies
        now = start = energy(bodies)
        for _ in range(int(3.0 / dt)):
            throw(simulation, dt)
            before, now = now, energy(bodies)
            assert now <= before + 1e-6 * start
            assert least_gap(bodies) > -1e-9
        assert not bodies.velocity.any() and not bodies.spin.any()
        assert np.all(bodies.position[:, 1] < 0.15)
        assert now < 0.3 * start


def test_piece_between_ground_and_wall_rests_in_the_corner():
    corner = {"obstacle": [{"normal": (0.0, 1.0, 0.0)},
                           {"place": (6.0, 0.0, 0.0), "normal": (-1.0, 0.0, 0.0), "friction": 0.1}]}
    with running(**STILL, **corner, body=[CUBE | {"velocity": (4.0, 0.0, 0.3)}]) as simulation:
        fly(simulation, 2e-3, 1500)
        position, velocity, spin = state_of(simulation)
        assert position[0] <= 5.9 + 1e-9 and position[1] == pytest.approx(0.1, abs=1e-6)
        assert not velocity.any() and not spin.any()


def test_hard_blow_that_turns_a_piece_never_adds_energy():
    """Without friction a bar that lands on its end keeps the energy that e = 1 leaves it."""
    bar = CUBE | {"size": (0.4, 0.05, 0.05), "rotate": (0.0, 0.0, 40.0)}
    for friction in (0.0, 0.3, 2.0):
        with running(**STILL, **ground(restitution=1.0, friction=friction),
                     body=[bar | {"velocity": (2.0, -1.0, 0.0)}]) as simulation:
            found = []
            for _ in range(400):
                throw(simulation, 2e-3)
                found.append(energy(simulation.state.bodies))
            rise = np.diff(found).max() / found[0]
            assert rise < 1e-6
            if friction == 0:
                assert found[-1] == pytest.approx(found[0], rel=1e-3)


def test_all_ranks_agree_and_the_air_does_not_feel_the_ground():
    shear = merged(STILL, {"initial": {"u": "sin(2*pi*y)"}})
    pane = PANE | {"place": (0.5, 0.2, 0.5), "force": 1.0, "fracture": {"pieces": 4}}
    with running(**shear, **ground(), body=[pane]) as simulation, running(**shear) as empty:
        run(simulation, 0.5)
        run(empty, 0.5)
        bodies = simulation.state.bodies
        assert all(np.array_equal(bodies.position, other)
                   for other in COMM.allgather(bodies.position))
        assert -1e-9 < least_gap(bodies) < 1e-3
        assert np.array_equal(simulation.state.u, empty.state.u)


def test_soft_body_is_kept_out_of_the_ground_before_and_after_it_breaks():
    """Air that blows down carries its vertices onto the ground and no farther."""
    down = merged(STILL, {"initial": {"v": "-1"}, "domain": {"boundary": "periodic"}})
    box = BOX | {"deform_until": {"time": 0.3}, "fracture": {"pieces": 3}, "detail": 2}
    with running(**down, **ground(place=(0.0, 0.35, 0.0)), body=[box]) as simulation:
        bodies = simulation.state.bodies
        for until in (0.02, 0.1, 0.4, 0.8):
            run(simulation, until)
            assert least_gap(bodies) > -1e-9
            assert until != 0.1 or np.sum(bodies.vertices[:, 1] < 0.35 + 1e-9) > 5


@pytest.mark.parametrize("changes, words", [
    ({"obstacle": [{"normal": (0.0, 0.0, 0.0)}]}, ["obstacle.0.normal", "direction"]),
    ({"obstacle": [{"place": (0.0, 0.45, 0.0)}]}, ["body.box.place", "behind obstacle.0"]),
    ({"obstacle": [{}], "body": []}, ["obstacle.0", "[[body]]"]),
    ({"obstacle": [{"friction": -1.0}]}, ["friction", "≥ 0"]),
    ({"obstacle": [{"restitution": 2.0}]}, ["restitution", "≤ 1"])])
def test_obstacles_that_cannot_be_are_refused(changes, words):
    with pytest.raises(SceneError) as caught, running(**merged(
            STILL, {"body": [BOX | {"place": (0.5, 0.5, 0.5)}]}) | changes):
        pass
    assert all(word in str(caught.value) for word in words)
