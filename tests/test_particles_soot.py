"""Soot: one particle per fuel particle, or one per c_soot; it decays and knows its parent."""

import numpy as np
import pytest

from tests.fire_case import QUIET, add, gathered, run, running

CLOSED = {"boundary": "wall", "expansion": "spread"}


def sooty(**soot):
    return {"domain": CLOSED, "fuel": QUIET | {"gas": 0.0, "heat": 0.0, "mass": 0.36},
            "soot": {"burn_rate": 0.0} | soot}


def burning(simulation, count=6):
    draw = np.random.default_rng(4)
    add(simulation, 0.2 + 0.6 * draw.random((count, 3)), mass=0.36, ignited=1)


@pytest.mark.parametrize("dt", [0.002, 0.05])
def test_one_soot_particle_per_fuel_particle(dt):
    """c_soot = 0.02 of soot is there after 0.0952 s; more burning makes no second one."""
    with running(**sooty(), time={"dt_max": dt}) as simulation:
        burning(simulation)
        run(simulation, 0.094)
        assert (simulation.report.fuel, simulation.report.soot) == (6, 0)
        run(simulation, 0.4)
        assert (simulation.report.fuel, simulation.report.soot) == (6, 6)
        points = gathered(simulation)
        fuel, soot = points[points["kind"] == 0], points[points["kind"] == 1]
        assert np.array_equal(soot["id"], fuel["id"] + 1)
        assert np.all(soot["mass"] == 0.36)
        offset = np.abs(soot["position"] - fuel["position"])
        assert 0.02 < offset.max() <= 0.5 / 8 and len(np.unique(offset)) == offset.size


@pytest.mark.parametrize("dt", [0.01, 0.25])
def test_repeated_soot_carries_all_soot_in_parcels(dt):
    with running(**sooty(repeat=True), time={"dt_max": dt}) as simulation:
        burning(simulation)
        run(simulation, 1.0)
        points = gathered(simulation)
        fuel, soot = points[points["kind"] == 0], points[points["kind"] == 1]
        assert len(soot) == 6 * int(0.21 / 0.02)
        assert np.all(soot["mass"] == 0.02)
        assert soot["mass"].sum() + fuel["soot"].sum() == pytest.approx(6 * 0.21, rel=1e-12)
        assert len(np.unique(points["id"])) == len(points)
        assert np.all(fuel["soot_made"] == 10)


def test_soot_decays_and_vanishes():
    """Mass 0.36 at z_s = 0.5 lives 0.72 s, and makes neither gas nor heat."""
    with running(**sooty(burn_rate=0.5)) as simulation:
        add(simulation, [0.5] * 3, kind=1, mass=0.36)
        run(simulation, 0.5)
        assert gathered(simulation)["mass"][0] == pytest.approx(0.11, rel=1e-12)
        run(simulation, 0.719)
        assert simulation.report.soot == 1
        run(simulation, 0.721)
        assert simulation.report.soot == 0
        assert simulation.report.gas == simulation.report.heat == 0.0


def test_no_soot_section_no_soot():
    with running(domain=CLOSED, fuel=QUIET | {"gas": 0.0, "heat": 0.0}) as simulation:
        burning(simulation)
        run(simulation, 0.5)
        assert simulation.report.soot == 0
