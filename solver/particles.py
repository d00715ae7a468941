"""Particles follow the flow, exchange heat with the air and catch fire.

Motion. Without drag coefficient a particle is a tracer, moved by the midpoint rule:
    x_new = x + dt u(x + ½ dt u(x))                                       second order in dt
With α_d > 0 it has inertia; the law dv/dt = k |u - v| (u - v), k = α_d r²/m, is solved exactly for
the air's velocity at x held fixed. With Δ = v - u and D = 1 + k |Δ| dt:
    v_new = u + Δ / D,   x_new = x + u dt + Δ ln(D) / (k |Δ|)             any dt
Heat. dY/dt = κ (T - Y), κ = α_h r²/c_m, exactly:  Y_new = T + (Y - T) exp(-κ dt). (One-way: the
air's loss is neglected.) A fuel particle with Y > T_i burns from the next step on.
"""

import math

from solver.burn import in_cells
from solver.interpolate import scalar_at, velocity_at
from solver.kernel import FIELD, REAL, inlined, kernel
from solver.scene import Scene
from solver.state import State
from solver.swarm import FUEL, RECORDS


class Particles:
    """Moves, heats and lights the particles, then settles them on their ranks."""

    def __init__(self, scene: Scene, state: State):
        fuel = scene.fuel
        assert fuel is not None
        grid = state.grid
        self.geometry = (*grid.spacing, *(float(s) for s in grid.start))
        self.drag = fuel.drag * fuel.radius**2
        exchanges = fuel.thermal_mass >= fuel.min_thermal_mass
        self.heating = fuel.heat_transfer * fuel.radius**2 / fuel.thermal_mass if exchanges else 0.0
        self.ignition = fuel.ignition_temperature

    def __call__(self, state: State, dt: float) -> None:
        """Advance all particles by dt in the current flow."""
        move(state.swarm.points, *state.velocity, state.T, *self.geometry, dt, self.drag,
             math.exp(-self.heating * dt), self.ignition)
        state.swarm.settle()


@inlined
def drag_factors(speed, k, dt):
    """1 / D and ln(D) / (k |Δ|) for a slip |Δ| = speed; their limits for no drag."""
    rate = k * speed
    if rate * dt < 1e-12:
        return 1.0, dt
    return 1 / (1 + rate * dt), math.log1p(rate * dt) / rate


@kernel(RECORDS, *[FIELD] * 4, *[REAL] * 10)
def move(points, u, v, w, T, hx, hy, hz, x0, y0, z0,
         dt, drag, remaining, ignition):
    """One step of every particle; `remaining` = exp(-κ dt)."""
    for n in range(len(points)):
        point = points[n]
        X, Y, Z = in_cells(point, hx, hy, hz, x0, y0, z0)
        air = scalar_at(T, X, Y, Z)
        point.temperature = air + (point.temperature - air) * remaining
        if point.kind == FUEL and point.temperature > ignition:
            point.ignited = 1
        a, b, c = velocity_at(u, v, w, X, Y, Z)
        position, velocity = point.position, point.velocity
        if drag == 0.0:
            a, b, c = velocity_at(u, v, w, X + 0.5 * dt * a / hx, Y + 0.5 * dt * b / hy,
                                  Z + 0.5 * dt * c / hz)
            velocity[0], velocity[1], velocity[2] = a, b, c
            position[0] += dt * a
            position[1] += dt * b
            position[2] += dt * c
        elif point.mass > 0.0:
            slip = (velocity[0] - a, velocity[1] - b, velocity[2] - c)
            speed = math.sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2)
            slowed, path = drag_factors(speed, drag / point.mass, dt)
            air_velocity = (a, b, c)
            for axis in range(3):
                position[axis] += air_velocity[axis] * dt + slip[axis] * path
                velocity[axis] = air_velocity[axis] + slip[axis] * slowed
