"""Fuel appears at a rate by the clock, from the seed alone."""

import numpy as np
import pytest

from tests.fire_case import gathered, run, running

STEADY = {"particles": 30, "ignited": 0, "rate": 1000.0}


@pytest.mark.parametrize("dt", [0.01, 0.005, 0.0013])
def test_number_follows_the_time_and_not_the_steps(dt):
    with running(fuel=STEADY, time={"dt_max": dt}) as simulation:
        for until in (0.02, 0.1):
            run(simulation, until)
            assert len(gathered(simulation)) == 30 + round(1000 * until)
        assert len(np.unique(gathered(simulation)["id"])) == 130


def test_emission_ends_in_time():
    with running(fuel=STEADY | {"emit_end": 0.015}) as simulation:
        run(simulation, 0.1)
        assert len(gathered(simulation)) == 45


def test_emission_ends_at_the_cap():
    with running(fuel=STEADY | {"cap": 50}) as simulation:
        run(simulation, 0.1)
        assert len(gathered(simulation)) == 50


def test_every_particle_is_the_same_in_smaller_steps():
    found = []
    for dt in (0.01, 0.001):
        with running(fuel=STEADY, time={"dt_max": dt}) as simulation:
            run(simulation, 0.1)
            found.append(gathered(simulation))
    assert np.array_equal(found[0]["id"], found[1]["id"])
    assert found[0]["position"] == pytest.approx(found[1]["position"], abs=1e-12)


@pytest.mark.parametrize("fill", ["sphere", "ball"])
def test_place_of_the_first_particles(fill):
    centre = np.array([0.5, 0.5, 0.5])
    with running(fuel={"particles": 4000, "ignited": 10}, seed=3,
                 detonation={"position": tuple(centre), "radius": 0.2, "fill": fill}) as simulation:
        points = gathered(simulation)
        offset = points["position"] - centre
        radius = np.linalg.norm(offset, axis=1)
        if fill == "sphere":
            assert radius == pytest.approx(0.2, rel=1e-12)
        else:   # uniform in volume: (r / r_d)³ is uniform
            assert radius.max() <= 0.2 + 1e-12
            assert np.quantile(radius / 0.2, 0.5)**3 == pytest.approx(0.5, abs=0.03)
        assert np.abs((offset / radius[:, None]).mean(axis=0)).max() < 0.03
        assert np.abs(((offset / radius[:, None])**2).mean(axis=0) - 1 / 3).max() < 0.02
        assert points["ignited"].sum() == 10


def test_the_part_of_a_ball_beyond_the_box_is_left_out_or_comes_round():
    found = {}
    for boundary in ("wall", "periodic"):
        with running(domain={"boundary": boundary, "expansion": "spread"},
                     detonation={"position": (0.0, 0.5, 0.5), "radius": 0.2},
                     fuel={"particles": 1000, "ignited": 0}) as simulation:
            found[boundary] = gathered(simulation)
    assert len(found["periodic"]) == 1000
    assert np.all((found["periodic"]["position"] >= 0) & (found["periodic"]["position"] <= 1))
    assert 400 < len(found["wall"]) < 600
    inner = np.isin(found["periodic"]["id"], found["wall"]["id"])
    assert found["periodic"]["position"][inner] == pytest.approx(found["wall"]["position"])
