"""The default scheme is of second order on every smooth case, and exact where it should be.

Coarse grids (the benchmark `python -m runs bench accuracy` goes further).
"""

import numpy as np
import pytest

from runs.exact import case, series
from solver.grid import AXES
from tests.flow_case import gathered, make_scene, simulation, velocity

SMOOTH = [name for name in case.names() if "order" in case.answer(name)]
EXACT = [name for name in case.names() if "exact" in case.answer(name)]


def test_there_are_cases_of_both_kinds():
    assert len(SMOOTH) >= 10 and len(EXACT) >= 2


@pytest.mark.parametrize("name", SMOOTH)
def test_observed_order(name):
    """On the two coarsest grids, where it is not quite there yet; `python -m runs bench orders`
    asks for all of it on the two finest."""
    cells = case.answer(name)["ladder"][:2]
    coarse, fine = (case.run(name, n, []) for n in cells)
    for norm, number in (("l2", 0), ("most", 1)):
        for field, before in getattr(coarse, norm).items():
            least = case.expected(name, field)[number] - (0.35 if field == "T" else 0.15)
            after = getattr(fine, norm)[field]
            if before > 1e-12:
                assert np.log2(before / after) >= least, (field, norm, before, after)


def test_implicit_viscosity_between_walls_leaves_the_pressure_of_second_order():
    """A guess of the pressure that is off by O(dt) shows on fine grids only: order 1.0 there."""
    coarse, fine = (case.run("manufactured_closed", n, []) for n in (64, 128))
    for norm in ("l2", "most"):
        assert np.log2(getattr(coarse, norm)["p"] / getattr(fine, norm)["p"]) > 1.8


@pytest.mark.parametrize("scheme", case.temperature_schemes("turning_blob"))
def test_a_blob_carried_round_keeps_its_bounds_with_bounded_schemes(scheme):
    overrides = [f'fluid.temperature_advection="{scheme}"'] if scheme else []
    with simulation(case.build("turning_blob", 32, overrides)) as sim:
        start = gathered(sim.state.grid, sim.state.T)
        for _ in sim.run_to(1.0):
            pass
        found = gathered(sim.state.grid, sim.state.T)
    beyond = max(start.min() - found.min(), found.max() - start.max())
    assert beyond <= 1e-12 if scheme in ("", "donor") else beyond < 0.2


@pytest.mark.parametrize("force", [True, False])
def test_what_an_expanding_ball_makes_leaves_through_the_open_faces(force):
    overrides = ["time.end=0.1", "time.frame=0.1"]
    with simulation(case.build("expanding_ball", 12, overrides + [
            'fluid.force=["0","0","0"]'] * (not force))) as sim:
        for _ in sim.run_to(0.1):
            out = 0.0
            for axis, (field, h) in enumerate(zip(velocity(sim.state), sim.state.grid.spacing,
                                                  strict=True)):
                ends = np.moveaxis(field, AXES[axis], 0)
                out += float((ends[-1] - ends[0]).sum()) * sim.state.grid.volume / h
            made = float(gathered(sim.state.grid, sim.state.phi).sum()) * sim.state.grid.volume
            assert out == pytest.approx(made, rel=1e-9)


@pytest.mark.parametrize("name", EXACT)
def test_exact_to_round_off(name):
    known = case.answer(name)
    found = case.run(name, known["ladder"][-1], [])
    assert max(found.most.values()) < known["exact"]


def test_energy_of_an_inviscid_flow_drifts_little_and_never_grows():
    """Ten turnovers of a travelling vortex array at 24²; the benchmark has 64²."""
    scene = case.build("travelling_wave", 24, ["time.end=3.0", "time.frame=3.0"])
    with simulation(scene) as sim:
        before = start = sim.report.energy
        for report in sim.run_to(3.0):
            assert report.energy <= before * (1 + 1e-12)
            before = report.energy
    assert 1 - before / start < 1e-2


@pytest.mark.parametrize("frame_velocity", [0.0, 3.0])
def test_answer_does_not_depend_on_how_the_end_is_cut_into_frames(frame_velocity):
    scene = make_scene((12, 12, 1), initial={"u": f"{frame_velocity}+sin(2*pi*y)", "v": "cos(6*x)"},
                       time={"end": 0.1, "frame": 0.05, "dt_max": 0.01})
    found = []
    for targets in ((0.1,), (0.05, 0.1)):
        with simulation(scene) as sim:
            for target in targets:
                for _ in sim.run_to(target):
                    pass
            found.append(gathered(sim.state.grid, sim.state.u, 0))
    assert np.abs(found[0] - found[1]).max() < 1e-5


def test_the_series_of_the_taylor_green_vortex_solves_the_equations():
    """Residual of the momentum equation between its powers, by differences in time; ∇·u = 0."""
    reynolds, t, step = 100.0, 0.2, 1e-3
    powers, pressures = series.series(reynolds)

    def at(time):
        return [sum(power[axis] * time**n for n, power in enumerate(powers)) for axis in range(3)]

    now = at(t)
    p = sum(power * t**n for n, power in enumerate(pressures))
    scale = max(np.abs(q).max() for q in now)
    for axis, (before, after) in enumerate(zip(at(t - step), at(t + step), strict=True)):
        rate = (after - before) / (2 * step)
        others = (series.advection(now, now[axis]) + 1j * series.K[axis] * p
                  + series.K2 * now[axis] / reynolds)
        assert np.abs(rate + others).max() < 1e-6 * scale
    assert np.abs(sum(k * q for k, q in zip(series.K, now, strict=True))).max() < 1e-12 * scale
