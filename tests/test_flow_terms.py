"""Each term of the flow does what its formula says: kernels against slow loops, and the cases
that the thesis' printed scheme fails."""

import numpy as np
import pytest

from solver.boundary import fill_velocity
from solver.cool import LITTLE, cool, cool_a_little
from solver.kernel import GHOSTS
from solver.scene import SceneError
from tests.flow_case import faces, gathered, make_scene, set_random, simulation, velocity

G = GHOSTS
STEPS = {"u": (0, 0, 1), "v": (0, 1, 0), "w": (1, 0, 0)}
SHIFTS = ((0, 0, 1), (0, 1, 0), (1, 0, 0))


def slow_advection(q, flux, blend, spacing, viscosity, at):
    """-(u·∇)q + ν∇²q at one place, from `flux(axis, side)`: velocity through its six sides."""
    rate = 0.0
    for axis, h in enumerate(spacing):
        for side in (-1, 1):
            neighbour = q[tuple(np.add(at, np.multiply(side, SHIFTS[axis])))]
            outwards = side * flux(axis, side)
            rate += (blend * abs(outwards) - outwards) * (neighbour - q[at]) / (2 * h)
            rate += viscosity * (neighbour - q[at]) / h**2
    return rate


def inner_places(shape):
    return [(k, j, i) for k in range(G, shape[0] - G) for j in range(G, shape[1] - G)
            for i in range(G, shape[2] - G)]


@pytest.mark.parametrize("blend", [0.0, 0.3, 1.0])
def test_momentum_equals_its_formula(blend):
    scene = make_scene((6, 5, 7), size=(1.0, 0.6, 1.5), fluid={
        "reynolds": 20.0, "donor_blend": blend, "advection": "donor"},
        time={"integrator": "rk2"})
    with simulation(scene) as sim:
        set_random(sim)
        state = sim.state
        state.remember()
        dt, old, new = 0.01, 0.25, 0.75
        momentum = sim.stages["momentum"][1]
        momentum(state, old, new, dt)
        for name, q, made in zip("uvw", state.velocity, state.velocity_new, strict=True):
            step = STEPS[name]
            for at in inner_places(q.shape):
                def flux(axis, side, at=at, step=step):
                    face = np.add(at, np.multiply(-1 if side < 0 else 0, SHIFTS[axis]))
                    field = state.velocity[axis]
                    return 0.5 * (field[tuple(face)] + field[tuple(np.add(face, step))])
                rate = slow_advection(q, flux, blend, state.grid.spacing, 1 / 20, at)
                wanted = old * q[at] + new * (q[at] + dt * rate)
                assert made[at] == pytest.approx(wanted, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("blend", [0.0, 1.0])
def test_temperature_equals_its_formula(blend):
    scene = make_scene((6, 5, 7), size=(1.0, 0.6, 1.5), initial={"T": "5"}, fluid={
        "conductivity": 0.05, "donor_blend": blend, "temperature_advection": "donor",
        "heat_source": "x+2*y-z"})
    with simulation(scene) as sim:
        set_random(sim)
        state = sim.state
        before = state.T.copy()
        heat = state.heat = state.grid.field(0.7)
        sim.stages["temperature"][1](state, 0.0, 1.0, 0.01)
        for at in inner_places(before.shape):
            def flux(axis, side, at=at):
                face = np.add(at, np.multiply(-1 if side < 0 else 0, SHIFTS[axis]))
                return state.velocity[axis][tuple(face)]
            rate = slow_advection(before, flux, blend, state.grid.spacing, 0.05, at) + heat[at]
            assert state.T[at] == pytest.approx(before[at] + 0.01 * rate, rel=1e-11, abs=1e-12)


ADVECTIONS = ["donor", "central", "central4", "tvd"]
HOT_SPOT = "where((abs(x-0.5)<0.2)&(abs(y-0.5)<0.2)&(abs(z-0.5)<0.2), 10.0, 0.0)"


@pytest.mark.parametrize("advection", ADVECTIONS)
def test_uniform_temperature_stays_where_gas_appears(advection):
    scene = make_scene((8, 8, 8), "open", initial={"T": "5"}, fluid={
        "source": HOT_SPOT, "temperature_advection": advection})
    with simulation(scene) as sim:
        for _ in range(10):
            sim.advance(sim.state.time + 0.5)
        assert sim.report.rate > 1
        assert np.abs(gathered(sim.state.grid, sim.state.T) - 5).max() < 1e-13


@pytest.mark.parametrize("advection", ADVECTIONS)
def test_gas_appears_with_the_velocity_of_the_flow(advection):
    """A uniform component of the velocity stays uniform whatever ∇·u the others make (the printed
    conservative form would slow it down by φ u)."""
    scene = make_scene((6, 6, 6), initial={"u": "2", "v": "sin(2*pi*y)", "w": "cos(2*pi*z)"},
                       fluid={"advection": advection, "source": "0*x"})
    with simulation(scene) as sim:
        state = sim.state
        set_random(sim)
        state.u.fill(2.0)
        sim.stages["momentum"][1](state, 0.0, 1.0, 0.01)
        inner = state.u_new[G:-G, G:-G, G:-G]
        assert np.abs(inner - 2).max() < 1e-14


@pytest.mark.parametrize("advection", ADVECTIONS)
def test_cross_term_uses_the_spacing_of_its_own_axis(advection):
    """u = y, v = 1 on cells of 0.1 × 0.05: ∂u/∂t = -v ∂u/∂y = -1 (the printed divisor gives ½)."""
    scene = make_scene((10, 20, 10), fluid={"advection": advection})
    with simulation(scene) as sim:
        state = sim.state
        assert state.grid.spacing[:2] == pytest.approx((0.1, 0.05))
        rows = np.arange(-G, state.grid.count[1] + G) + state.grid.start[1] + 0.5
        state.u[...] = 0.05 * rows[None, :, None]
        state.v.fill(1.0)
        state.w.fill(0.0)
        before = state.u.copy()
        sim.stages["momentum"][1](state, 0.0, 1.0, 0.01)
        rate = (state.u_new - before)[G:-G, G:-G, G:-G] / 0.01
        # minus u ∂u/∂x = 0: u does not depend on x
        assert rate == pytest.approx(-np.ones_like(rate), abs=1e-12)


@pytest.mark.parametrize("strength", [LITTLE, 0.01, 1e-9, 1e-18])
def test_cooling_by_little_is_cooling(strength):
    T = 5.0 + 90 * np.random.default_rng(2).uniform(-1, 1, (6, 7, 24))
    exact, found = T.copy(), T.copy()
    cool(exact, 5.0, 90.0, strength)
    cool_a_little(found, 5.0, 90.0, strength)
    assert np.abs(found - exact).max() <= 1e-15 * 95
    assert (np.abs(exact - T).max() > 0) == (strength > 1e-16)


@pytest.mark.parametrize("hot, cold", [(100, 88.48122), (500, 126.26893), (3000, 126.86647)])
@pytest.mark.parametrize("pieces", [1, 7, 40])
def test_cooling_is_exact_for_any_number_of_steps(hot, cold, pieces):
    scene = make_scene((4, 4, 4), initial={"T": str(hot)}, fluid={
        "ambient_temperature": 5.0, "max_temperature": 100.0, "cooling": 5.0},
        time={"end": 3.0, "frame": 3.0, "dt_max": 3.0 / pieces})
    with simulation(scene) as sim:
        for _ in sim.run_to(3.0):
            pass
        assert sim.state.step == pieces
        assert gathered(sim.state.grid, sim.state.T) == pytest.approx(cold, abs=1e-5)


def test_air_colder_than_ambient_warms_up():
    scene = make_scene((4, 4, 4), initial={"T": "0"}, fluid={"cooling": 5.0},
                       time={"end": 50.0, "frame": 50.0, "dt_max": 1.0})
    with simulation(scene) as sim:
        previous = 0.0
        for _ in sim.run_to(50.0):
            now = float(gathered(sim.state.grid, sim.state.T).min())
            assert previous < now < 5
            previous = now


def test_still_air_does_not_fall():
    scene = make_scene((6, 7, 5), "open", initial={"T": "5"}, fluid={
        "gravity": [0.0, -9.8, 0.0], "buoyancy": 0.1})
    with simulation(scene) as sim:
        for _ in range(5):
            sim.advance(sim.state.time + 1.0)
        assert all(np.all(q == 0) for q in velocity(sim.state))


def test_hot_air_rises():
    scene = make_scene((6, 8, 5), "wall", initial={"T": "5+10*exp(-40*((x-.5)**2+(y-.4)**2))"},
                       fluid={"buoyancy": 0.1})
    with simulation(scene) as sim:
        sim.advance(0.01)
        v = velocity(sim.state)[1]
        assert v[2, 4, 2] > 0.01 and v[2, 4, 0] < 0


def test_hydrostatic_balance_leaves_the_air_at_rest():
    """Temperature layers in a closed box: the pressure carries them exactly."""
    scene = make_scene((6, 8, 5), "wall", initial={"T": "5+10*y*y"}, fluid={"buoyancy": 0.1})
    with simulation(scene) as sim:
        for _ in range(5):
            sim.advance(sim.state.time + 1.0)
        assert max(float(np.abs(q).max()) for q in velocity(sim.state)) < 1e-9


@pytest.mark.parametrize("integrator", ["euler", "rk3"])
def test_first_step_respects_the_source(integrator):
    """Air at rest and fire in it: the first step is short enough for the flow that it causes."""
    scene = make_scene((16, 16, 16), "open", fuel={"particles": 200, "ignited": 200},
                       time={"integrator": integrator},
                       fluid={"advection": "tvd", "temperature_advection": "tvd"})
    with simulation(scene) as sim:
        report = sim.advance(1.0)
        assert report.rate > 1
        assert sim.state.dt * report.rate <= 1.0
        assert sim.state.dt * report.rate > 1e-3   # and not absurdly short


@pytest.mark.parametrize("integrator, advection", [
    ("euler", "donor"), ("rk2", "tvd"), ("rk3", "tvd"), ("rk3", "donor"), ("rk3", "central")])
def test_a_thousand_steps_do_not_grow(integrator, advection):
    scene = make_scene((8, 8, 8), initial={"u": "1", "v": "1", "w": "1", "T": "0*x"},
                       fluid={"advection": advection, "temperature_advection": advection},
                       time={"integrator": integrator, "end": 1e3, "frame": 1e3})
    with simulation(scene) as sim:
        set_random(sim)
        for q in sim.state.velocity:
            q.fill(1.0)
        T = gathered(sim.state.grid, sim.state.T)
        low, high, energy = T.min(), T.max(), sim.monitor(sim.state).energy
        sim.report = sim.monitor(sim.state)
        for _ in range(1000):
            sim.advance(sim.state.time + 1e3)
        T = gathered(sim.state.grid, sim.state.T)
        assert low - 1e-12 <= T.min() and T.max() <= high + 1e-12
        assert sim.report.energy <= energy * (1 + 1e-12)


def test_sharp_temperature_stays_within_its_bounds_in_any_flow():
    """By the default scheme, in a strongly expanding and turning flow."""
    scene = make_scene((12, 12, 12), faces(*["open"] * 4, "wall", "wall"), initial={
        "T": "where((x-0.4)**2+(y-0.5)**2<0.05, 90.0, 5.0)",
        "u": "3*sin(2*pi*y)", "v": "-2*sin(2*pi*x)"}, fluid={"source": HOT_SPOT})
    with simulation(scene) as sim:
        for _ in range(60):
            sim.advance(sim.state.time + 1.0)
            T = gathered(sim.state.grid, sim.state.T)
            assert 5 - 1e-9 <= T.min() and T.max() <= 90 + 1e-9


@pytest.mark.parametrize("sections, key", [
    ({"time": {"cfl": 2.0}}, "time.cfl"),
    ({"time": {"integrator": "rk2", "cfl": 1.2}, "fluid": {"advection": "tvd"}}, "time.cfl"),
    ({"time": {"integrator": "euler"}, "fluid": {"advection": "central"}}, "fluid.advection"),
])
def test_unstable_combinations_are_refused_with_a_fix(sections, key):
    with pytest.raises(SceneError, match=f"{key} = .*fix: "):
        with simulation(make_scene((6, 6, 6), **sections)):
            pass


def test_heating_and_cooling_together_are_of_second_order():
    """dT/dt = H - c_r θ⁴ to the balance, against a fine solution."""
    def end(steps):
        scene = make_scene((4, 4, 4), initial={"T": "5"}, time={
            "end": 1.0, "frame": 1.0, "dt_max": 1.0 / steps}, fluid={
            "heat_source": "200", "cooling": 300.0, "ambient_temperature": 5.0,
            "max_temperature": 100.0})
        with simulation(scene) as sim:
            for _ in sim.run_to(1.0):
                pass
            return float(gathered(sim.state.grid, sim.state.T).max())

    fine = end(640)
    errors = [abs(end(steps) - fine) for steps in (10, 20, 40)]
    assert errors[0] / errors[1] > 3.6 and errors[1] / errors[2] > 3.6


@pytest.mark.parametrize("boundary, cells", [
    ("open", (8, 8, 8)), ("periodic", (8, 8, 8)), ("slip", (8, 8, 8)), ("slip", (9, 12, 1)),
    ("periodic", (9, 12, 1)), ("wall", (8, 8, 8)), ("lid", (9, 12, 1))])
def test_inviscid_energy_of_the_default_never_grows(boundary, cells):
    """Random velocity that no grid resolves, back-flow through every open face, no viscosity (so
    that a wall, at rest or not, is a face that air slips along)."""
    if boundary == "lid":
        boundary = faces("wall", "wall", {"wall": [1.0, 0.0, 0.0]}, "slip", "wall", "slip")
    with simulation(make_scene(cells, boundary, size=(1.0, 0.8, 1.3),
                               initial={"noise": 1.0})) as sim:
        energies = [sim.report.energy]
        energies += [sim.advance(sim.state.time + 1.0).energy for _ in range(200)]
    assert energies[-1] < energies[0]
    growth = 1.01 if boundary == "open" else 1 + 1e-12
    assert all(after <= growth * before for before, after in zip(energies, energies[1:],
                                                                 strict=False))


@pytest.mark.parametrize("advection", ["central", "central4"])
@pytest.mark.parametrize("boundary", ["periodic", "slip"])
def test_central_differences_make_and_destroy_no_energy(advection, boundary):
    """Σ u·R(u) = 0 to round-off for any velocity with ∇·u = 0, on cells that are no cubes."""
    scene = make_scene((8, 6, 7), boundary, size=(1.0, 0.6, 1.5), initial={"noise": 1.0},
                       fluid={"advection": advection})
    with simulation(scene) as sim:
        state = sim.state
        sim.stages["momentum"][1](state, 0.0, 1.0, 1.0)
        gain = size = 0.0
        for q, made in zip(state.velocity, state.velocity_new, strict=True):
            power = (q * (made - q))[G:-G, G:-G, G:-G]
            gain += float(power.sum())
            size += float(np.abs(power).sum())
        gain, size = (state.grid.comm.allreduce(x) for x in (gain, size))
    assert abs(gain) < 1e-9 * size


@pytest.mark.serial   # a line of cells is not shared out
def test_central4_is_of_fourth_order_in_a_uniform_flow():
    def error(cells):
        scene = make_scene((cells, 1, 1), initial={"u": "1", "v": "sin(2*pi*x)"},
                           time={"end": 0.25, "frame": 0.25, "dt_max": 1e-3})
        with simulation(scene) as sim:
            for _ in sim.run_to(0.25):
                pass
            x = (np.arange(cells) + 0.5) / cells
            return np.abs(velocity(sim.state)[1][0, 0] - np.sin(2 * np.pi * (x - 0.25))).max()

    assert np.log2(error(16) / error(32)) > 3.9


def test_ghosts_do_not_depend_on_what_the_arrays_held_before():
    """Open faces all round: every ghost follows from the values inside."""
    filled = []
    for leftover in (0.0, 1e3):
        with simulation(make_scene((6, 5, 7), "open")) as sim:
            set_random(sim)
            fields = sim.state.velocity
            for axis, field in enumerate(fields):
                inside = [slice(G, -G)] * 3
                inside[2 - axis] = slice(G - 1, -G)
                kept = field[tuple(inside)].copy()
                field.fill(leftover)
                field[tuple(inside)] = kept
            fill_velocity(sim.state.grid, fields)
            filled.append([field.copy() for field in fields])
    for a, b in zip(*filled, strict=True):
        np.testing.assert_array_equal(a, b)
