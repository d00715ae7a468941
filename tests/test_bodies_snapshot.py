"""What a frame stores of bodies: the shape while it can change, and how warm each piece is."""

import numpy as np
import pytest

from solver.files import read_snapshot
from solver.snapshot import Snapshot
from tests.fire_case import run, running
from tests.test_bodies_deform import SOFT, WALLS, soft
from tests.test_bodies_motion import BOX

WARM = {"output": {"precision": "float64"}, "initial": {"T": "10 + 20 * x", "u": "sin(2*pi*y)"}}


def test_soft_body_stands_where_its_vertices_are_before_and_after_the_break(shared_path):
    with running(**WALLS, **WARM, **soft(time=0.05), time={"dt_max": 0.01}) as simulation:
        state = simulation.state
        snapshot = Snapshot(simulation.scene, state, shared_path)
        rest = state.bodies.vertices.copy()
        for frame, until in enumerate((0.0, 0.03, 0.1)):
            run(simulation, until)
            snapshot.write(state, frame)
        start, during, after = (read_snapshot(shared_path, n).bodies for n in range(3))
        assert np.array_equal(start["vertices"], rest)
        assert np.abs(during["vertices"] - rest).max() > 1e-3
        # X stands at position + R (X - rest_centre): while it is soft, at X
        assert np.array_equal(during["position"], during["rest_centre"])
        assert np.all(during["orientation"] == [1, 0, 0, 0])
        assert np.array_equal(after["vertices"], state.bodies.vertices)
        assert np.abs(after["position"] - after["rest_centre"]).max() > 1e-4
        assert during["temperature"].shape == (4,) and 15 < during["temperature"].min() < 30


@pytest.mark.parametrize("warm", [True, False])
def test_rigid_body_stores_no_vertices_and_no_temperature_without_one(shared_path, warm):
    scene = WALLS | ({"initial": {"T": "10 + 20 * x"}} if warm else {})
    other = BOX | {"name": "other", "place": (0.2, 0.2, 0.2)}
    with running(**scene, body=[SOFT, other]) as simulation:
        Snapshot(simulation.scene, simulation.state, shared_path).write(simulation.state, 0)
        stored = read_snapshot(shared_path, 0).bodies
        assert "vertices" not in stored and ("temperature" in stored) == warm
        if warm:
            assert stored["temperature"][-1] == pytest.approx(14, rel=1e-6)
