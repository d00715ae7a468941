"""Heat exchange between particles and air, and ignition."""

import numpy as np
import pytest

from tests.fire_case import COMM, QUIET, add, build, gathered, running

KAPPA = 2e5 * 0.1**2 / 20.54       # 97.37, the thesis' window


def exchange_steps(simulation, steps, dt):
    """Only the particles act; the heat that they take from the air is applied to it."""
    state = simulation.state
    for _ in range(steps):
        state.heat.fill(0.0)
        simulation.stages["particles"][1](state, dt)
        state.T[2:-2, 2:-2, 2:-2] += dt * state.heat[2:-2, 2:-2, 2:-2]
        simulation._fill_ghosts()


@pytest.mark.parametrize("steps", [1, 3, 500])
def test_particle_relaxes_exactly_and_both_ways(steps):
    """From 50 in air at 5, κ = 97.37, t = 0.2: 5.000000157; and from below likewise."""
    with running(fuel=QUIET | {"ignition_temperature": 1e9}) as simulation:
        add(simulation, [[0.4] * 3, [0.6] * 3], temperature=[50.0, -40.0])
        exchange_steps(simulation, steps, 0.2 / steps)
        above, below = gathered(simulation)["temperature"]
        assert above - 5 == pytest.approx(45 * np.exp(-0.2 * KAPPA), rel=1e-6)
        assert above == pytest.approx(5.000000157, abs=2e-9)
        assert below - 5 == pytest.approx(-(above - 5), rel=1e-6)


@pytest.mark.parametrize("rate", [1.0, 1e3, 1e6])
def test_any_rate_is_stable(rate):
    with running(fuel=QUIET | {"heat_transfer": rate, "radius": 1.0, "thermal_mass": 1.0,
                               "ignition_temperature": 1e9}) as simulation:
        add(simulation, [0.5] * 3, temperature=50.0)
        exchange_steps(simulation, 1, 1.0)
        warmth = gathered(simulation)["temperature"][0]
        assert 5 <= warmth <= 5 + 45 * np.exp(-min(rate, 700.0)) + 1e-13


def test_no_exchange_below_the_least_thermal_mass():
    with running(fuel=QUIET | {"thermal_mass": 1e-5, "min_thermal_mass": 1e-4,
                               "ignition_temperature": 1e9}) as simulation:
        add(simulation, [0.5] * 3, temperature=50.0)
        exchange_steps(simulation, 3, 0.1)
        assert gathered(simulation)["temperature"][0] == 50.0


def test_fuel_above_the_ignition_temperature_burns_and_soot_never():
    with running(fuel=QUIET | {"heat_transfer": 0.0}) as simulation:
        add(simulation, [[0.5] * 3] * 4, temperature=[9.9, 10.0, 10.1, 50.0], kind=[0, 0, 0, 1])
        exchange_steps(simulation, 1, 1e-3)
        assert list(gathered(simulation)["ignited"]) == [0, 0, 1, 0]


# --- two-way -------------------------------------------------------------------------------------

CLOSED = {"boundary": "wall", "expansion": "spread", "cells": [4, 4, 4]}
CENTRE = [0.625] * 3               # of a cell: trilinear weights 1 and 0


def two_way(**changes):
    return QUIET | {"exchange": "two_way", "ignition_temperature": 1e9, "radius": 1.0,
                    "thermal_mass": 0.1, "heat_transfer": 0.3} | changes


@pytest.mark.parametrize("steps", [1, 10])
def test_one_particle_and_its_cell_relax_exactly(steps):
    """κ = 3, Λ = c_m / (C V) = 6.4: the difference decays at κ (1 + Λ)."""
    with running(domain=CLOSED, fuel=two_way()) as simulation:
        add(simulation, CENTRE, temperature=50.0)
        exchange_steps(simulation, steps, 0.1 / steps)
        load, rate = 0.1 * 64, 3.0
        mean = (load * 50 + 5) / (load + 1)
        left = 45 * np.exp(-rate * (1 + load) * 0.1)
        assert gathered(simulation)["temperature"][0] == pytest.approx(mean + left / (1 + load))
        hottest = COMM.allreduce(float(simulation.state.T[2:-2, 2:-2, 2:-2].max()), op=max)
        assert hottest == pytest.approx(mean - left * load / (1 + load))


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
@pytest.mark.parametrize("load", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("dt", [1e-3, 1e6])
def test_heat_is_conserved_and_never_overshoots(boundary, load, dt):
    """Random particles: c_m ΣY + C ∫T dV stays, and Σ c_m Y² + C ∫T² dV never grows."""
    draw = np.random.default_rng(5)
    capacity = load / 200
    with running(domain=CLOSED | {"boundary": boundary},
                 fuel=two_way(thermal_mass=capacity)) as simulation:
        add(simulation, draw.random((200, 3)), temperature=draw.uniform(-50, 100, 200))

        def moments():
            Y = gathered(simulation)["temperature"]
            T = simulation.state.T[2:-2, 2:-2, 2:-2]
            return [capacity * (Y**n).sum() + COMM.allreduce(float((T**n).sum())) / 64
                    for n in (1, 2)]

        heat, squares = moments()
        for _ in range(5):
            exchange_steps(simulation, 1, dt)
            now, squares_now = moments()
            assert now == pytest.approx(heat, rel=1e-11)
            assert squares_now <= squares * (1 + 1e-12)
            squares = squares_now


def test_light_load_is_the_one_way_law():
    temperatures = []
    for changes in ({"exchange": "one_way"}, {"air_heat_capacity": 1e9}):
        with running(domain=CLOSED, fuel=two_way(**changes)) as simulation:
            add(simulation, [0.3, 0.4, 0.5], temperature=50.0)
            exchange_steps(simulation, 5, 0.1)
            temperatures.append(gathered(simulation)["temperature"][0])
    assert temperatures[0] == pytest.approx(temperatures[1], rel=1e-7)


def test_one_way_scene_has_no_field_for_the_load():
    assert build(fuel={}).fuel.exchange == "one_way"
    with running(fuel=QUIET) as simulation:
        assert simulation.stages["particles"][1].exchange is None
