"""Soft bodies: the flow carries their vertices, then they break with the mass they had."""

import numpy as np
import pytest

from solver.deform import nearest_rigid_motion, untangle
from solver.scene import SceneError
from tests.fire_case import build, run, running
from tests.test_bodies_motion import BOX, throw
from tests.test_particles_motion import fill

SOFT = BOX | {"detail": 2, "size": (0.2, 0.2, 0.2), "fracture": {"pieces": 4}}
WALLS = {"domain": {"boundary": "wall"}, "fluid": {"gravity": (0.0, 0.0, 0.0)}}


def soft(**until):
    return {"body": [SOFT | {"deform_until": until}]}


def swell(simulation, rate=1.0):
    """u = rate (x - centre): exact by interpolation."""
    fill(simulation, lambda x, y, z: rate * (x - 0.5), lambda x, y, z: rate * (y - 0.5),
         lambda x, y, z: rate * (z - 0.5))


def test_swelling_box_grows_as_the_flow_says_and_then_breaks():
    with running(**WALLS, **soft(time=0.5)) as simulation:
        swell(simulation)
        state, bodies = simulation.state, simulation.state.bodies
        rest, mass = bodies.vertices.copy(), bodies.mass.copy()
        for step in range(50):
            assert bodies.deformation.soft and np.all(bodies.spin == 0)
            throw(simulation, 0.01)
            state.time += 0.01
        # the midpoint rule: a factor 1 + dt + dt²/2 per step
        expected = 0.5 + (rest - 0.5) * (1 + 0.01 + 0.5e-4)**50
        assert np.abs(bodies.vertices - expected).max() < 1e-12
        assert not bodies.deformation.soft
        assert bodies.mass == pytest.approx(mass, rel=1e-14)
        scale = (1 + 0.01 + 0.5e-4)**50
        with running(**WALLS, body=[SOFT | {"size": (0.2 * scale,) * 3}]) as other:
            like = other.state.bodies
            assert bodies.position == pytest.approx(like.position, abs=1e-12)
            assert bodies.inertia == pytest.approx(like.inertia * scale**-3, rel=1e-9, abs=1e-12)
        # each piece starts with the velocity of its centre
        assert bodies.velocity == pytest.approx(bodies.position - 0.5, rel=0.01, abs=1e-12)
        before = bodies.position.copy()
        shape = bodies.vertices.copy()
        throw(simulation, 0.01)
        assert np.array_equal(bodies.vertices, shape)
        assert np.abs(bodies.position - before).min(axis=0).max() > 0


def test_breaks_at_a_displacement():
    with running(**WALLS, **soft(displacement=0.05)) as simulation:
        swell(simulation)
        bodies = simulation.state.bodies
        corner = 0.1 * np.sqrt(3)
        steps = 0
        while bodies.deformation.soft:
            throw(simulation, 0.01)
            steps += 1
        assert steps == np.ceil(np.log(1 + 0.05 / corner) / 0.01)


def test_breaks_when_it_leaves_the_box():
    with running(**WALLS, **soft(time=100.0)) as simulation:
        swell(simulation, 5.0)
        bodies, steps = simulation.state.bodies, 0
        while bodies.deformation.soft and steps < 100:
            throw(simulation, 0.01)
            steps += 1
        assert steps < 60
        assert np.all(np.isfinite(bodies.velocity)) and np.all(np.isfinite(bodies.inertia))


def test_coincident_vertices_of_pieces_stay_together():
    """Nothing opens before the break, whatever the flow."""
    draw = np.random.default_rng(2)
    with running(**WALLS, **soft(time=100.0)) as simulation:
        bodies = simulation.state.bodies
        body = bodies.deformation.soft[0]
        assert len(body.points) < len(bodies.vertices)
        _, rest = np.unique(bodies.vertices, axis=0, return_inverse=True)
        for field in simulation.state.velocity:
            field[...] = 0.3 * draw.standard_normal(field.shape)
        for _ in range(20):
            throw(simulation, 0.02)
        assert np.abs(bodies.vertices - bodies.fragments.vertices).max() > 0.01
        _, now = np.unique(bodies.vertices, axis=0, return_inverse=True)
        pairs = np.unique(np.stack([rest.reshape(-1), now.reshape(-1)]), axis=1)
        assert pairs.shape[1] == rest.max() + 1


def test_a_rotating_flow_hands_over_its_rotation():
    with running(**WALLS, **soft(time=0.2)) as simulation:
        fill(simulation, lambda x, y, z: 0.5 - y, lambda x, y, z: x - 0.5, lambda x, y, z: 0 * x)
        for _ in range(20):
            throw(simulation, 0.01)
            simulation.state.time += 0.01
        bodies = simulation.state.bodies
        assert not bodies.deformation.soft
        assert bodies.spin == pytest.approx(np.tile([0, 0, 1.0], (4, 1)), abs=0.01)


def test_guard_moves_a_triangle_that_would_flip_as_a_whole():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    moved = np.zeros((4, 4))
    moved[2, :3] = [0, -3, 0]           # through the edge 0-1
    assert untangle(points, moved, faces) == 0
    after = points + moved[:, :3]
    for face in faces:
        normals = [np.cross(p[face[1]] - p[face[0]], p[face[2]] - p[face[0]])
                   for p in (points, after)]
        assert normals[0] @ normals[1] > 0
    harmless = np.zeros((4, 4))
    harmless[:, :3] = np.random.default_rng(1).normal(0, 0.05, (4, 3))
    kept = harmless.copy()
    assert untangle(points, harmless, faces) == 0 and np.array_equal(kept, harmless)


def test_violent_flow_never_leaves_an_inverted_triangle_or_a_piece_without_inertia():
    draw = np.random.default_rng(7)
    with running(**WALLS, **soft(time=100.0)) as simulation:
        bodies = simulation.state.bodies
        for field in simulation.state.velocity:
            field[...] = 5 * draw.standard_normal(field.shape)
        faces = bodies.fragments.faces
        steps = 0
        while bodies.deformation.soft and steps < 200:
            before = bodies.vertices[faces]
            throw(simulation, 0.01)
            after = bodies.vertices[faces]
            normals = [np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in (before, after)]
            assert np.all((normals[0] * normals[1]).sum(axis=1) > 0)
            steps += 1
        assert not bodies.deformation.soft
        for _ in range(20):
            throw(simulation, 0.01)
        assert np.all(np.isfinite(bodies.position)) and np.all(np.isfinite(bodies.spin))


def test_nearest_rigid_motion():
    draw = np.random.default_rng(3)
    arm, area = draw.normal(size=(50, 3)), draw.random(50)
    velocity = [1.0, 2, 3] + np.cross([0.3, -0.2, 0.5], arm)
    v, spin = nearest_rigid_motion(arm, area, velocity)
    assert v == pytest.approx([1, 2, 3]) and spin == pytest.approx([0.3, -0.2, 0.5])
    line = np.zeros((5, 3))
    line[:, 0] = np.arange(5)
    v, spin = nearest_rigid_motion(line, np.ones(5), np.cross([9.0, 0, 2], line))
    assert spin == pytest.approx([0, 0, 2]) and v == pytest.approx([0, 0, 0], abs=1e-12)


def test_temperature_of_a_piece_is_that_of_its_vertices():
    with running(**WALLS | {"initial": {"T": "10 + 20 * x"}},
                 body=[BOX | {"detail": 3}, BOX | {"name": "out", "place": (9.0, 0, 0)}]) as sim:
        inside, outside = sim.state.bodies.temperature(sim.state)
        assert inside == pytest.approx(20, rel=1e-9)
        assert outside == 5.0


def test_soft_body_in_a_run():
    with running(**WALLS, initial={"u": "0.2 * sin(2*pi*y)"}, **soft(time=0.15)) as simulation:
        run(simulation, 0.1)
        assert simulation.state.bodies.deformation.soft
        run(simulation, 0.3)
        assert not simulation.state.bodies.deformation.soft


def test_a_body_that_would_never_break_is_refused():
    with pytest.raises(SceneError, match="deform_until.*never break.*fix"):
        build(**soft())


def test_a_soft_body_outside_the_box_is_refused():
    with pytest.raises(SceneError, match="box.deform_until: .* outside the box.*fix"):
        with running(**WALLS, body=[SOFT | {"deform_until": {"time": 1.0},
                                            "place": (0.5, 0.95, 0.5)}]):
            pass
