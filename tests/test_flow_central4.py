"""The default scheme of the velocity equals its formula."""

import numpy as np
import pytest

from tests.flow_case import make_scene, set_random, simulation
from tests.test_flow_terms import SHIFTS, inner_places

RE = 20.0


def at(field, place):
    """A value; beyond the outermost ghost below, that ghost."""
    return field[tuple(max(n, 0) for n in place)]


def slow_rate(velocity, component, place, spacing, viscosity):
    """-(u·∇)q + ν∇²q, axis by axis, no shortcut of any kind."""
    q, rate, own = velocity[component], 0.0, SHIFTS[component]

    def step(axis, number):
        return at(q, np.add(place, np.multiply(number, SHIFTS[axis])))

    for axis, h in enumerate(spacing):
        here, values = step(axis, 0), {n: step(axis, n) for n in range(-2, 3)}
        if axis == component:
            def midway(n, values=values):   # n = ±1: between here and that neighbour
                return (9 * (values[0] + values[n]) - (values[-n] + values[2 * n])) / 16

            near = {n: 4 / 3 * midway(n) for n in (-1, 1)}
            wide = {n: (10 * values[n] - here - values[2 * n]) / 8 for n in (-1, 1)}
        else:
            def side(half, axis=axis):   # velocity through the side at half × h / 2
                face = np.add(place, np.multiply((half - 1) // 2, SHIFTS[axis]))
                f = [at(velocity[axis], np.add(face, np.multiply(n, own))) for n in (-1, 0, 1, 2)]
                return (9 * (f[1] + f[2]) - (f[0] + f[3])) / 16

            near = {n: side(n) + (side(-n) + 2 * side(n) + side(3 * n)) / 12 for n in (-1, 1)}
            wide = {n: (side(n) + side(3 * n)) / 2 for n in (-1, 1)}
        rate -= sum(n * (near[n] * (values[n] - here) / (2 * h)
                         - wide[n] * (values[2 * n] - here) / (12 * h)) for n in (-1, 1))
        rate += viscosity * (values[1] - 2 * here + values[-1]) / h**2
    return rate


@pytest.mark.parametrize("scale", [0.01, 1.0])
@pytest.mark.parametrize("reynolds", [RE, np.inf])
def test_momentum_equals_its_formula(scale, reynolds):
    """Slow and fast flow, against loops; anisotropic cells."""
    scene = make_scene((6, 5, 7), size=(1.0, 0.6, 1.5), time={"integrator": "rk3"},
                       fluid={"advection": "central4", "reynolds": reynolds,
                              "diffusion": "explicit"})
    with simulation(scene) as sim:
        set_random(sim)
        state = sim.state
        for field in state.velocity:
            field *= scale
        state.remember()
        dt, old, new = 0.01, 0.25, 0.75
        sim.stages["momentum"][1](state, old, new, dt)
        for component, (q, made) in enumerate(zip(state.velocity, state.velocity_new,
                                                  strict=True)):
            for place in inner_places(q.shape):
                rate = slow_rate(state.velocity, component, place, state.grid.spacing,
                                 1 / reynolds)
                wanted = old * q[place] + new * (q[place] + dt * rate)
                assert made[place] == pytest.approx(wanted, rel=1e-11, abs=1e-13)
