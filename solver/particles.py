"""Particles follow the flow, exchange heat with the air and catch fire.

Motion. Without drag coefficient a particle is a tracer, moved by the midpoint rule:
    x_new = x + dt u(x + ½ dt u(x))                                       second order in dt
With α_d > 0 it has inertia; the law dv/dt = k |u - v| (u - v), k = α_d r²/m, is solved exactly for
the air's velocity at x held fixed. With Δ = v - u and D = 1 + k |Δ| dt:
    v_new = u + Δ / D,   x_new = x + u dt + Δ ln(D) / (k |Δ|)             any dt
Heat. dY/dt = κ (T - Y), κ = α_h r²/c_m, exactly:  Y_new = T + (Y - T) exp(-κ dt); the air's loss is
neglected, or returned to it (`exchange`). A fuel particle with Y > T_i burns from the next step on.
"""

import math
from typing import Any

import numpy as np

from solver.interpolate import air_at, in_cells, velocity_at
from solver.kernel import FIELD, REAL, inlined, kernel
from solver.scene import Scene
from solver.state import State
from solver.swarm import FUEL, RECORDS


class Particles:
    """Moves, heats and lights the particles, then settles them on their ranks."""

    def __init__(self, scene: Scene, state: State):
        fuel = scene.fuel
        assert fuel is not None
        self.fuel, self.soot, self.seed = fuel, scene.soot, scene.seed
        self.per_cell = np.array([1 / h for h in state.grid.spacing])
        self.start = np.array(state.grid.start, dtype=float)
        self.drag = fuel.drag * fuel.radius**2
        exchanges = fuel.thermal_mass >= fuel.min_thermal_mass
        self.heating = fuel.heat_transfer * fuel.radius**2 / fuel.thermal_mass if exchanges else 0.0
        self.exchange: Any = None
        self.bear_soot: Any = None
        if fuel.exchange == "two_way" and self.heating > 0:
            from solver.exchange import Exchange
            self.exchange = Exchange(fuel, state.grid, self.heating)
        if scene.soot is not None:
            from solver.soot import bear_soot
            self.bear_soot = bear_soot

    def __call__(self, state: State, dt: float) -> None:
        """Advance all particles by dt in the current flow."""
        remaining = math.exp(-self.heating * dt)
        if self.exchange is not None:
            self.exchange(state, dt)
            remaining = 1.0
        move(state.swarm.points, *state.velocity, state.T, self.per_cell, self.start, dt,
             self.drag, remaining, self.fuel.ignition_temperature)
        if self.bear_soot is not None:
            self.bear_soot(state.swarm, self.fuel, self.soot, self.seed)
        state.swarm.settle()


@inlined
def drag_factors(speed, k, dt):
    """1 / D and ln(D) / (k |Δ|) for a slip |Δ| = speed; their limits for no drag."""
    rate = k * speed
    if rate * dt < 1e-12:
        return 1.0, dt
    return 1 / (1 + rate * dt), math.log1p(rate * dt) / rate


@kernel(RECORDS, *[FIELD] * 4, REAL[::1], REAL[::1], *[REAL] * 4)
def move(points, u, v, w, T, per_cell, start, dt, drag, remaining, ignition):
    """One step of every particle; `remaining` = exp(-κ dt)."""
    hx, hy, hz = (0.5 * dt * per_cell[0], 0.5 * dt * per_cell[1], 0.5 * dt * per_cell[2])
    for n in range(len(points)):
        point = points[n]
        position, velocity = point.position, point.velocity
        X = in_cells(position, per_cell, start, 0)
        Y = in_cells(position, per_cell, start, 1)
        Z = in_cells(position, per_cell, start, 2)
        a, b, c, air = air_at(u, v, w, T, X, Y, Z)
        warmth = air + (point.temperature - air) * remaining
        point.temperature = warmth
        if point.kind == FUEL and warmth > ignition:
            point.ignited = 1
        if drag == 0.0:
            a, b, c = velocity_at(u, v, w, X + hx * a, Y + hy * b, Z + hz * c)
            velocity[0], velocity[1], velocity[2] = a, b, c
            position[0] += dt * a
            position[1] += dt * b
            position[2] += dt * c
        elif point.mass > 0.0:
            air_velocity = (a, b, c)
            slip = (velocity[0] - a, velocity[1] - b, velocity[2] - c)
            speed = math.sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2)
            slowed, path = drag_factors(speed, drag / point.mass, dt)
            for axis in range(3):
                position[axis] += air_velocity[axis] * dt + slip[axis] * path
                velocity[axis] = air_velocity[axis] + slip[axis] * slowed
