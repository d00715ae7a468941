"""Implicit diffusion is exact in space, of second order in time, and never bounds dt."""

import numpy as np
import pytest

from solver.boundary import fill_scalar, fill_velocity
from solver.grid import AXES, INNER
from solver.helmholtz import CELLS, Helmholtz
from solver.scene import SceneError
from tests.flow_case import faces, gathered, make_scene, set_random, simulation, velocity

LID = {"wall": [1.0, 0.0, 0.0]}
BOXES = [faces(*["wall"] * 6), faces(*["slip"] * 6), faces(*["periodic"] * 6),
         faces("wall", "slip", "slip", "wall", "periodic", "periodic"),
         faces("periodic", "periodic", "wall", "wall", "slip", "wall")]


def differences(q, c, far):
    """Σ c (δ² - far δ⁴) q inside."""
    total = np.zeros_like(q)
    for axis, (factor, share) in enumerate(zip(c, far, strict=True)):
        def neighbours(n, axis=axis):
            return np.roll(q, n, AXES[axis]) + np.roll(q, -n, AXES[axis])
        total = total + factor * (neighbours(1) - 2 * q - share * (
            neighbours(2) - 4 * neighbours(1) + 6 * q))
    return total[INNER]


@pytest.mark.parametrize("boundary", BOXES)
@pytest.mark.parametrize("far", [(0.0, 0.0, 0.0), (1 / 12, 0.0, 1 / 12)])
@pytest.mark.parametrize("cells", [(7, 5, 9), (6, 1, 8)])
def test_helmholtz_solution_satisfies_its_equation(boundary, far, cells):
    """For u, v, w and values in cells, whatever the faces and the number of ranks."""
    c = (0.7, 20.0, 3.0)
    with simulation(make_scene(cells, boundary)) as sim:
        grid = sim.state.grid
        set_random(sim)
        fields = [*sim.state.velocity, np.copy(sim.state.u)]
        fill_scalar(grid, fields[CELLS])
        right = [field[INNER].copy() for field in fields]
        for place, field in enumerate(fields):
            Helmholtz(grid, place, far)(field, c)
        for axis in range(3):
            grid.exchange(axis, *fields)
        fill_velocity(grid, fields[:3])
        fill_scalar(grid, fields[CELLS])
        for place, (field, r) in enumerate(zip(fields, right, strict=True)):
            defect = field[INNER] - differences(field, c, far) - r
            if place < CELLS and not grid.periodic[place] and grid.at_high_end(place):
                on_wall = [slice(None)] * 3
                on_wall[AXES[place]] = slice(-1, None)
                defect[tuple(on_wall)] = 0.0
            assert np.abs(defect).max() < 1e-11, place


def decay(steps, **sections):
    """Velocity and temperature after half a unit of time in a viscous box."""
    fluid = {"reynolds": 5.0, "conductivity": 0.2, "diffusion": "implicit",
             "temperature_advection": "central4"}
    scene = make_scene((12, 12, 1), faces("wall", "wall", "wall", "slip", "periodic", "periodic"),
                       fluid={**fluid, **sections.get("fluid", {})},
                       initial={"u": "sin(pi*x)**2*sin(2*pi*y)", "v": "-sin(2*pi*x)*sin(pi*y)**2",
                                "T": "5+cos(pi*x)*cos(pi*y)"},
                       time={"end": 0.5, "frame": 0.5, "dt_max": 0.5 / steps,
                             **sections.get("time", {})})
    with simulation(scene) as sim:
        for _ in sim.run_to(0.5):
            pass
        assert sim.state.step == steps
        return [*velocity(sim.state)[:2], gathered(sim.state.grid, sim.state.T),
                gathered(sim.state.grid, sim.state.p)]


def test_implicit_diffusion_is_of_second_order_in_time():
    """Velocity, temperature, and the pressure, which sees ν∇² of what slips along the walls."""
    fine, *coarse = [decay(steps) for steps in (512, 32, 64)]
    for exact, first, second in zip(fine, *coarse, strict=True):
        ratio = np.linalg.norm(first - exact) / np.linalg.norm(second - exact)
        assert ratio > 3.4


def test_without_walls_a_wave_decays_with_third_order_in_time():
    """Alone, of a shear flow that carries nothing; ν k² t = 2."""
    def error(steps):
        scene = make_scene((4, 16, 4), initial={"u": "sin(2*pi*y)"},
                           fluid={"reynolds": 2 * np.pi**2, "diffusion": "implicit"},
                           time={"dt_max": 1 / steps})
        with simulation(scene) as sim:
            for _ in sim.run_to(1.0):
                pass
            assert sim.state.step == steps
            u = velocity(sim.state)[0][0, :, 0]
        once = 2 - 2 * np.cos(2 * np.pi / 16)
        left = np.exp(-(once + once**2 / 12) * 16**2 / (2 * np.pi**2))
        return np.abs(u - left * np.sin(2 * np.pi * (np.arange(16) + 0.5) / 16)).max()

    assert np.log2(error(16) / error(32)) > 2.8


def test_it_tends_to_the_explicit_answer():
    """Beside the same no-slip walls, to which explicit diffusion has the same shear."""
    explicit = decay(512, fluid={"diffusion": "explicit"})
    for a, b in zip(explicit, decay(512), strict=True):
        assert np.abs(a - b).max() < 1e-4


@pytest.mark.parametrize("integrator", ["euler", "rk3"])
def test_viscosity_does_not_bound_dt_and_the_flow_comes_to_rest(integrator):
    """Honey: explicit steps would be 2e-8 long."""
    scene = make_scene((8, 8, 8), "wall", initial={"noise": 1.0},
                       time={"integrator": integrator}, fluid={"reynolds": 1e-4})
    with simulation(scene) as sim:
        energies = [sim.report.energy]
        for _ in range(6):
            energies.append(sim.advance(sim.state.time + 1.0).energy)
            assert sim.reason != "viscosity" and sim.state.dt > 1e-3
        assert all(b < a for a, b in zip(energies, energies[1:], strict=False))
        assert energies[-1] < 1e-4 * energies[0]


def test_auto_is_explicit_where_viscosity_hardly_matters():
    scene = make_scene((8, 8, 8), "wall", initial={"noise": 1.0}, fluid={"reynolds": 1e4})
    with simulation(scene) as sim:
        sim.advance(sim.state.time + 1.0)
        assert not sim.state.viscosity.implicit


@pytest.mark.parametrize("diffusion", ["explicit", "implicit"])
def test_couette_flow_is_exact_and_steady(diffusion):
    scene = make_scene((4, 10, 1), faces("periodic", "periodic", "wall", LID, "periodic",
                                         "periodic"),
                       initial={"u": "y"}, fluid={"reynolds": 1.0, "diffusion": diffusion})
    with simulation(scene) as sim:
        for _ in range(20):
            sim.advance(sim.state.time + 1.0)
        u = velocity(sim.state)[0]
        assert np.abs(u[0, :, 0] - (np.arange(10) + 0.5) / 10).max() < 1e-9


def test_hot_spot_stays_within_its_bounds():
    """Conducted over many cells in a step."""
    scene = make_scene((12, 12, 12), "wall", initial={
        "noise": 1.0, "T": "where((x-0.4)**2+(y-0.5)**2<0.05, 90.0, 5.0)"},
        fluid={"conductivity": 3.0})
    with simulation(scene) as sim:
        for _ in range(5):
            sim.advance(sim.state.time + 1.0)
            assert sim.reason != "conduction"
            T = gathered(sim.state.grid, sim.state.T)
            assert 5 - 1e-9 <= T.min() and T.max() <= 90 + 1e-9


@pytest.mark.parametrize("sections", [
    {"domain": {"boundary": "open"}}, {"time": {"integrator": "rk2"}}])
def test_what_cannot_be_implicit_is_refused_with_a_fix(sections):
    with pytest.raises(SceneError, match="fluid.diffusion = .*fix: "):
        with simulation(make_scene((6, 6, 6), sections.get("domain", {}).get("boundary", "wall"),
                                   fluid={"diffusion": "implicit", "reynolds": 10.0},
                                   time=sections.get("time", {}))):
            pass
