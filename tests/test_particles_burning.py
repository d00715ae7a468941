"""Burning: gas, heat and soot are proportional to the mass burnt, whatever dt and grid are."""

import numpy as np
import pytest

from tests.fire_case import COMM, QUIET, add, gathered, run, running

MASS, RATE, HEAT, GAS = 0.36, 0.21, 0.7019, 2.61


def fire(cells=8, dt_max=np.inf, **fuel):
    """Gas that is spread over a closed box, so that nothing leaves it."""
    return {"domain": {"boundary": "wall", "expansion": "spread", "cells": [cells] * 3},
            "time": {"dt_max": dt_max},
            "fuel": QUIET | {"min_mass": 0.0, "heat_transfer": 0.0} | fuel}


def burning(count, seed=2):
    draw = np.random.default_rng(seed)
    return {"position": 0.3 + 0.4 * draw.random((count, 3)), "mass": MASS, "ignited": 1}


@pytest.mark.parametrize("dt_max", [0.05, 0.3, 5.0])
def test_over_a_life_the_budgets_do_not_depend_on_dt(dt_max):
    """0.9396 box volumes of gas, b_h m of heat and b_s m of soot per particle; it burns 1.714 s."""
    with running(**fire(dt_max=dt_max, gas=GAS, heat=HEAT, soot=0.5)) as simulation:
        add(simulation, **burning(5))
        run(simulation, 1.7)
        points = gathered(simulation)
        assert points["soot"] == pytest.approx(0.5 * 1.7 * RATE, rel=1e-12)
        assert points["mass"] == pytest.approx(MASS - 1.7 * RATE, rel=1e-12)
        run(simulation, 1.8)
        report = simulation.report
        assert report.fuel == 0
        assert report.burnt == pytest.approx(5 * MASS, rel=1e-13)
        assert report.gas == pytest.approx(5 * 0.9396, rel=1e-13)
        assert report.heat == pytest.approx(5 * HEAT * MASS, rel=1e-13)


@pytest.mark.parametrize("cells, deposit", [(16, "trilinear"), (32, "trilinear"), (16, "nearest")])
def test_gas_and_heat_are_those_of_the_mass_burnt_on_any_grid(cells, deposit):
    with running(**fire(cells, gas=GAS, heat=HEAT, deposit=deposit)) as simulation:
        add(simulation, **burning(40))
        run(simulation, 0.01)
        report = simulation.report
        assert report.burnt == pytest.approx(40 * RATE * 0.01, rel=1e-12)
        assert report.gas == pytest.approx(GAS * report.burnt, rel=1e-13)
        assert report.heat == pytest.approx(HEAT * report.burnt, rel=1e-13)


@pytest.mark.parametrize("cells", [16, 32])
def test_heat_that_the_air_holds_is_the_same_on_any_grid(cells):
    """∫(T - T_a) dV after one step, from the field itself: no grid's cell volume is in it."""
    with running(**fire(cells, dt_max=1e-3, gas=0.0, heat=HEAT)) as simulation:
        add(simulation, **burning(40))
        run(simulation, 1e-3)
        state = simulation.state
        held = COMM.allreduce(float((state.T[2:-2, 2:-2, 2:-2] - 5).sum())) * state.grid.volume
        assert held == pytest.approx(HEAT * 40 * RATE * 1e-3, rel=1e-9)


def test_two_particles_in_a_cell_add_up():
    with running(**fire(gas=GAS, heat=HEAT)) as simulation:
        add(simulation, [[0.5625] * 3] * 2, ignited=1)      # the centre of a cell
        simulation.stages["burn"][1].prepare(simulation.state)
        volume = simulation.state.grid.volume
        phi = COMM.allreduce(float(simulation.state.phi.max()), op=max)
        heat = COMM.allreduce(float(simulation.state.heat.max()), op=max)
        assert phi == pytest.approx(2 * GAS * RATE / volume, rel=1e-13)
        assert heat == pytest.approx(2 * HEAT * RATE / volume, rel=1e-13)


@pytest.mark.parametrize("stiffness", [1e2, 1e6])
def test_a_step_far_longer_than_a_life_burns_no_more_than_there_is(stiffness):
    with running(**fire(gas=GAS, heat=HEAT, burn_rate=stiffness * MASS)) as simulation:
        add(simulation, **burning(5))
        state, burn = simulation.state, simulation.stages["burn"][1]
        burn.prepare(state)
        burn(state, 1.0)
        state.swarm.settle()
        assert len(gathered(simulation)) == 0
        burnt, gas, heat = (COMM.allreduce(state.totals[name]) for name in ("burnt", "gas", "heat"))
        assert burnt == pytest.approx(5 * MASS, rel=1e-14)
        assert gas == pytest.approx(GAS * burnt, rel=1e-13)
        assert heat == pytest.approx(HEAT * burnt, rel=1e-13)


def test_every_type_is_removed_by_its_own_threshold():
    with running(fuel=QUIET | {"min_mass": 0.1, "gas": 0.0}, soot={"min_mass": 0.01,
                                                                   "burn_rate": 1.0}) as simulation:
        add(simulation, [[0.5] * 3] * 5, kind=[0, 0, 0, 1, 1], ignited=[1, 1, 0, 0, 0],
            mass=[0.1 + 1e-3 * RATE / 2, 0.1 + 2e-3 * RATE, 0.05, 0.0105, 0.0115])
        simulation.stages["burn"][1].prepare(simulation.state)
        simulation.stages["burn"][1](simulation.state, 1e-3)
        simulation.state.swarm.settle()
        # an unlit light one is no ash: it has not burnt
        assert list(gathered(simulation)["id"] >> 16) == [2, 3, 5]


def test_what_leaves_the_box_is_removed_and_its_surface_belongs_to_it():
    with running(fuel=QUIET) as simulation:
        add(simulation, [[0, 0, 0], [1, 1, 1], [1.0000001, 0.5, 0.5], [0.5, -1e-9, 0.5]])
        assert list(gathered(simulation)["id"] >> 16) == [1, 2]


def test_fire_spreads():
    """In the advective form the fire heats the air and lights more; in the conservative form its
    gas would enter cold and none would ever follow the first ten."""
    with running(domain={"cells": [16] * 3}, fuel={"particles": 1000, "ignited": 10, "heat": 3.5},
                 fluid={"cooling": 5.0}) as simulation:
        share = [simulation.report.burning / simulation.report.fuel]
        for until in (0.02, 0.04, 0.06):
            run(simulation, until)
            share.append(simulation.report.burning / simulation.report.fuel)
        assert share[0] == 0.01 and share[-1] > 0.05 and sorted(share) == share


def test_fewer_heavier_particles_give_the_same_gas():
    """n × q, m / q, z / q: the same total rate; the temperature converges with q."""
    fields = []
    for q in (1, 8, 64):
        number = 20 * q
        with running(domain={"cells": [8] * 3}, detonation={"fill": "ball", "radius": 0.3},
                     fuel={"particles": number, "ignited": number, "mass": MASS / q,
                           "burn_rate": RATE / q}) as simulation:
            run(simulation, 0.01)
            assert simulation.report.burnt == pytest.approx(20 * RATE * 0.01, rel=1e-12)
            whole = COMM.allgather(simulation.state.T[2:-2, 2:-2, 2:-2])
            fields.append(np.concatenate([part.ravel() for part in whole]))
    few, some, many = fields
    assert np.linalg.norm(some - many) < 0.6 * np.linalg.norm(few - many)
