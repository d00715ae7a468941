"""The thesis' own formulas, each selectable, and what each of them does."""

import numpy as np
import pytest

from solver.scene import SceneError
from tests.fire_case import build, running
from tests.test_bodies_motion import BOX, PANE, STILL, STREAM, body, state_of, throw
from tests.test_particles_motion import fill

STIRRED = (lambda x, y, z: 0.5 - y, lambda x, y, z: x - 0.5, lambda x, y, z: 0 * x)


def pushed(steps=1, dt=0.01, **changes):
    """The body after some steps in a uniform flow along x."""
    with running(**STREAM, **body(PANE, **changes)) as simulation:
        for _ in range(steps):
            throw(simulation, dt)
        return state_of(simulation)


def test_absolute_drag_pushes_for_ever():
    """v = F_c u t / m: it outruns the flow."""
    with running(**STREAM, **body(PANE, laws={"drag": "absolute"})) as simulation:
        for _ in range(100):
            throw(simulation, 0.01)
        speed = state_of(simulation)[1][0]
        assert speed == pytest.approx(30.0 / simulation.state.bodies.mass[0], rel=1e-9)
    assert speed > 10


def test_vertex_shares_grow_with_the_number_of_vertices():
    coarse = pushed(laws={"weights": "vertex", "drag": "absolute"})[1][0]
    by_area = pushed(laws={"drag": "absolute"})[1][0]
    with running(**STREAM, **body(PANE)) as simulation:
        vertices = len(simulation.state.bodies.weight)
    assert coarse == pytest.approx(vertices * by_area, rel=1e-12)


def test_parallel_part_hardly_moves_a_pane_face_on():
    """Of a force across the pane, the part along the lever arms in the pane is almost nothing."""
    share = (pushed(laws={"push": "parallel", "drag": "absolute"})[1][0]
             / pushed(laws={"drag": "absolute"})[1][0])
    assert 0 < share < 0.02
    relative = pushed(steps=300, dt=10.0, laws={"push": "parallel"})
    assert relative[1][0] == pytest.approx(1, rel=1e-2)      # well posed, and only slow


def test_parallel_part_of_a_cubes_push_is_a_third():
    """At the corners of a cube Σ r̂ r̂ᵀ is a third of the identity, per vertex."""
    cube = body(BOX, size=(0.2, 0.2, 0.2), laws={"push": "parallel", "drag": "absolute"})
    with running(**STREAM, **cube) as simulation:
        simulation.state.bodies.weight[:] = 1 / len(simulation.state.bodies.weight)
        corners = len(simulation.state.bodies.weight) == 8
        throw(simulation, 0.01)
        share = state_of(simulation)[1][0] * simulation.state.bodies.mass[0] / (30 * 0.01)
    assert corners and share == pytest.approx(1 / 3, rel=1e-9)


def test_parallel_push_still_turns_with_the_flow_and_stays_stable():
    with running(**STILL, **body(BOX, laws={"push": "parallel"}, force=3e5)) as simulation:
        fill(simulation, *STIRRED)
        simulation.state.bodies.gravity[:] = 0
        for _ in range(50):
            throw(simulation, 0.1)
        assert state_of(simulation)[2] == pytest.approx([0, 0, 1], abs=1e-3)


def test_smallest_edge_inertia():
    with running(**STILL, **body(PANE, laws={"inertia": "smallest_edge"})) as simulation:
        bodies = simulation.state.bodies
        assert bodies.inertia[0] == pytest.approx(2 / 3 * bodies.mass[0] * 0.01**2 * np.eye(3))


def test_smallest_edge_of_something_flat_is_refused(tmp_path):
    path = tmp_path / "sheet.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n", encoding="utf-8")
    sheet = {"name": "sheet", "shape": "mesh", "mesh": str(path), "areal_density": 1.0,
             "scale": 0.2}
    with pytest.raises(SceneError, match=r"laws\.inertia = smallest_edge: .*flat.*fix"):
        with running(body=[sheet | {"laws": {"inertia": "smallest_edge"}}]):
            pass
    with pytest.raises(SceneError, match=r"density = 3\.0: its surface is open.*areal_density"):
        with running(body=[{k: v for k, v in sheet.items() if k != "areal_density"}
                           | {"density": 3.0}]):
            pass


def test_open_pieces_share_the_mass_of_the_closed_body():
    """A box cut into open shells weighs what the solid box weighs, each piece by its area."""
    whole = BOX | {"detail": 2}
    with running(**STILL, body=[whole | {"fracture": {"pieces": 5}}]) as simulation:
        bodies = simulation.state.bodies
        assert not simulation.state.fragments.closed.any()
        assert bodies.mass.sum() == pytest.approx(100 * 0.1 * 0.2 * 0.3, rel=1e-12)
        areas = simulation.state.fragments.measures()[0]
        assert bodies.mass / areas == pytest.approx(bodies.mass.sum() / areas.sum(), rel=1e-12)


def test_default_laws_are_ours():
    laws = build(**body(BOX)).body[0].laws
    assert (laws.drag, laws.weights, laws.push, laws.inertia) == ("relative", "area", "total",
                                                                  "exact")
