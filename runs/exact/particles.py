"""Particles with a known answer: drag, heat, burning, and a tracer in a vortex.

Each case runs the solver's own stages; `checks` compares all of them with the closed forms that
the docstrings of `solver.particles` and `solver.burn` state.
"""

import math
from dataclasses import dataclass

import numpy as np

from solver import scene as scenes
from solver.state import coordinates
from solver.step import Simulation
from solver.swarm import PARTICLE

RATE, MASS, GAS, HEAT = 0.21, 0.36, 2.61, 0.7019


@dataclass(frozen=True)
class Check:
    """A case: how far the result is from the exact one, and how far it may be."""

    name: str
    error: float
    tolerance: float


def checks() -> list[Check]:
    """Every closed-form case of particles, at a step that explicit rules could not take."""
    errors = [tracer_error(steps) for steps in (50, 100)]
    return [
        Check("drag, slip after t = 3, k = 2, in 1 step", drag_error(1), 1e-12),
        Check("drag, dt × rate = 10⁶", drag_error(1, 1e7 / 3), 1e-12),
        Check("heat, κ t = 19.5, in 1 step", heat_error(1, 97.37), 1e-10),
        Check("heat, κ dt = 10⁶", heat_error(1, 5e6), 1e-12),
        Check("gas of a life against b_g m", burning_error(0.05), 1e-12),
        Check("gas of a life in steps of 10⁶ lives", burning_error(1e6 * MASS / RATE), 1e-12),
        Check("tracer in a vortex, 2 - order", max(0.0, 2 - math.log2(errors[0] / errors[1])), 0.1)]


def box(**fuel: float) -> Simulation:
    """Still air in a closed unit box, with no particle yet."""
    return Simulation(scenes.build({
        "domain": {"cells": [8, 8, 8], "boundary": "wall", "expansion": "spread"},
        "time": {"end": 10.0, "frame": 10.0},
        "fuel": {"particles": 0, "ignited": 0, "min_mass": 0.0, "gas": GAS, "heat": HEAT} | fuel}))


def put(simulation: Simulation, position: tuple[float, float, float], **columns: object) -> None:
    """One fuel particle."""
    records = np.zeros(1, PARTICLE)
    records["position"], records["mass"], records["temperature"] = position, 1.0, 5.0
    for name, value in columns.items():
        records[name] = value
    simulation.state.swarm.append(records)


def drag_error(steps: int, k: float = 2.0) -> float:
    """|v - exact| of a particle thrown at speed 1 into still air, after t = 3."""
    simulation = box(drag=k, radius=1.0, heat_transfer=0.0)
    put(simulation, (0.1, 0.5, 0.5), velocity=(0.1, 0.0, 0.0))
    for _ in range(steps):
        simulation.stages["particles"][1](simulation.state, 3.0 / steps)
    found = float(simulation.state.swarm.points["velocity"][0, 0])
    simulation.destroy()
    return abs(found - 0.1 / (1 + k * 0.1 * 3.0))


def heat_error(steps: int, rate: float) -> float:
    """|Y - exact| of a particle that starts 45 above the air, after t = 0.2."""
    simulation = box(heat_transfer=rate, radius=1.0, thermal_mass=1.0, ignition_temperature=1e9)
    put(simulation, (0.5, 0.5, 0.5), temperature=50.0)
    for _ in range(steps):
        simulation.stages["particles"][1](simulation.state, 0.2 / steps)
    found = float(simulation.state.swarm.points["temperature"][0])
    simulation.destroy()
    return abs(found - 5 - 45 * math.exp(-0.2 * rate))


def burning_error(dt: float) -> float:
    """Relative error of ∫∫φ dV dt over the life of a particle against b_g m."""
    simulation = box(mass=MASS, burn_rate=RATE)
    put(simulation, (0.4, 0.5, 0.6), mass=MASS, ignited=1)
    state, burn = simulation.state, simulation.stages["burn"][1]
    while len(state.swarm.points):
        burn.prepare(state)
        burn(state, dt)
        state.swarm.settle()
    gas = state.totals["gas"]
    simulation.destroy()
    return abs(gas / (GAS * MASS) - 1)


def tracer_error(steps: int) -> float:
    """Distance from the exact place after a turn and a half of solid rotation about the centre.

    The field is linear, so that interpolation is exact and the error is that of the time step."""
    simulation = box(heat_transfer=0.0)
    state = simulation.state
    for axis, (field, sign, along) in enumerate(((state.u, -1, "y"), (state.v, 1, "x"))):
        field[...] = sign * (coordinates(state.grid, axis)[along] - 0.5)
    put(simulation, (0.8, 0.5, 0.5))
    time = 3 * math.pi
    for _ in range(steps):
        simulation.stages["particles"][1](state, time / steps)
    found = state.swarm.points["position"][0].copy()
    simulation.destroy()
    exact = (0.5 + 0.3 * math.cos(time), 0.5 + 0.3 * math.sin(time), 0.5)
    return float(np.linalg.norm(found - exact))
