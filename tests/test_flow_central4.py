"""The default scheme of the velocity equals its formula; beside faces, its viscosity `shear`'s."""

import numpy as np
import pytest

from solver.kernel import GHOSTS
from tests.flow_case import faces, gathered, make_scene, set_random, simulation
from tests.test_flow_terms import SHIFTS, inner_places

RE = 20.0


def at(field, place):
    """A value; beyond the outermost ghost below, that ghost."""
    return field[tuple(max(n, 0) for n in place)]


def slow_rate(velocity, component, place, spacing, viscosity):
    """-(u·∇)q + ν∇²q of fourth order with the means of products, axis by axis, no shortcut of any
    kind."""
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
            stretch = 0.0
        else:
            def side(half, axis=axis):   # velocity through the side at half × h / 2
                face = np.add(place, np.multiply((half - 1) // 2, SHIFTS[axis]))
                f = [at(velocity[axis], np.add(face, np.multiply(n, own))) for n in (-1, 0, 1, 2)]
                return (9 * (f[1] + f[2]) - (f[0] + f[3])) / 16

            near = {n: side(n) + (side(-n) + 2 * side(n) + side(3 * n)) / 12 for n in (-1, 1)}
            wide = {n: (side(n) + side(3 * n)) / 2 for n in (-1, 1)}
            stretch = np.clip(h * (side(1) - side(-1)) / 12, -viscosity, viscosity)
        rate -= sum(n * (near[n] * (values[n] - here) / (2 * h)
                         - wide[n] * (values[2 * n] - here) / (12 * h)) for n in (-1, 1))
        second = values[1] - 2 * here + values[-1]
        fourth = values[2] - 4 * values[1] + 6 * here - 4 * values[-1] + values[-2]
        rate += ((viscosity - stretch) * second - viscosity * fourth / 12) / h**2
    return rate


@pytest.mark.parametrize("scale", [0.01, 1.0])
@pytest.mark.parametrize("reynolds", [RE, np.inf])
def test_momentum_equals_its_formula(scale, reynolds):
    """Slow and fast flow, against loops; anisotropic cells."""
    scene = make_scene((6, 5, 7), "periodic", size=(1.0, 0.6, 1.5), time={"integrator": "rk3"},
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


def viscous_rate(boundary, profile, velocity, axis):
    """ν∇² of a profile across the box of one velocity, by one explicit step, beside both faces of
    the axis and in the middle; and where these values stand."""
    scene = make_scene((12, 12, 12), boundary, fluid={"reynolds": 2.0, "diffusion": "explicit"})
    with simulation(scene) as sim:
        state = sim.state
        here = np.arange(-GHOSTS, state.grid.count[axis] + GHOSTS) + state.grid.start[axis]
        place = (here + (1.0 if velocity == axis else 0.5)) / 12
        field = state.velocity[velocity]
        field[...] = profile(place).reshape([-1 if a == 2 - axis else 1 for a in range(3)])
        sim._fill_ghosts()
        before = gathered(state.grid, field)
        sim.stages["momentum"][1](state, 0.0, 1.0, 1.0)
        rate = gathered(state.grid, state.velocity_new[velocity]) - before
        line = np.moveaxis(rate, 2 - axis, 0)[:, 4, 4]
    return line, (np.arange(12) + (1.0 if velocity == axis else 0.5)) / 12


def closed(axis, *kinds):
    """A box with these two faces, periodic along the other axes."""
    kinds_of = ["periodic"] * 6
    kinds_of[2 * axis:2 * axis + 2] = kinds
    return faces(*kinds_of)


@pytest.mark.parametrize(("axis", "velocity"), [(0, 1), (1, 2), (2, 0), (1, 0)])
def test_shear_at_walls_is_that_of_a_cubic(axis, velocity):
    """The upper wall moves with the profile; exact to round-off, also one cell further in."""
    speed = [0.0, 0.0, 0.0]
    speed[velocity] = 2.0
    line, y = viscous_rate(closed(axis, "wall", {"wall": speed}),
                           lambda y: y * (1 + y * (3 - 2 * y)), velocity, axis)
    assert np.abs(line - (6 - 12 * y) / 2).max() < 1e-11


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_shear_at_open_faces_is_none_and_inside_of_second_order(axis):
    """ν∇² of y² cells from the face: ν/h² (q₁ - q₀) at the first, exact from there on."""
    velocity = (axis + 1) % 3
    line, y = viscous_rate(closed(axis, "open", "open"), lambda y: y * y, velocity, axis)
    assert np.abs(line[1:-1] - 1).max() < 1e-11
    assert line[0] == pytest.approx((y[1]**2 - y[0]**2) * 144 / 2, rel=1e-11)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_velocity_normal_to_a_wall_is_diffused_with_second_differences_beside_it(axis):
    """sin is odd at both walls like the ghosts: both differences make a multiple of it. What it
    carries of itself is the same for -sin."""
    there, back = (viscous_rate(closed(axis, "wall", "wall"), lambda x, s=sign: s * np.sin(
        2 * np.pi * x), axis, axis) for sign in (1, -1))
    line, x = (there[0] - back[0]) / 2, there[1]
    once = (2 - 2 * np.cos(2 * np.pi / 12)) * np.ones(12)
    once[1:-2] += once[1:-2]**2 / 12
    assert np.abs(line + once * 144 / 2 * np.sin(2 * np.pi * x))[:-1].max() < 1e-10


@pytest.mark.parametrize("cells", [1, 2, 3, 4])
@pytest.mark.parametrize("diffusion", ["explicit", "implicit"])
def test_a_channel_of_few_cells_comes_to_rest(cells, diffusion):
    """The formula at the wall reads no more cells than there are."""
    scene = make_scene((4, cells, 8), closed(1, "wall", "wall"), initial={"noise": 1.0},
                       fluid={"reynolds": 1.0, "diffusion": diffusion},
                       time={"end": 9.0, "frame": 9.0})
    with simulation(scene) as sim:
        energies = [sim.report.energy]
        energies += [sim.advance(sim.state.time + 1.0).energy for _ in range(20)]
    assert all(b < a or a < 1e-30 for a, b in zip(energies, energies[1:], strict=False))


def test_viscous_flow_in_a_flat_open_box_comes_to_rest():
    """Also on the faces themselves, beside the edges of the box."""
    scene = make_scene((9, 8, 7), "open", size=(1.0, 1.0, 0.04), initial={"noise": 1.0},
                       fluid={"reynolds": 0.1}, time={"integrator": "rk2"})
    with simulation(scene) as sim:
        energies = [sim.report.energy]
        energies += [sim.advance(sim.state.time + 1.0).energy for _ in range(100)]
    assert all(b < a for a, b in zip(energies, energies[1:], strict=False))
