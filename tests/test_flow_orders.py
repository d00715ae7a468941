"""The default scheme is of second order on every smooth case, and exact where it should be.

Coarse grids (the benchmark `python -m runs bench accuracy` goes further).
"""

import numpy as np
import pytest

from runs.exact import case
from tests.flow_case import gathered, make_scene, simulation

SMOOTH = [name for name in case.names() if "order" in case.answer(name)]
EXACT = [name for name in case.names() if "exact" in case.answer(name)]


def test_there_are_cases_of_both_kinds():
    assert len(SMOOTH) >= 10 and len(EXACT) >= 2


@pytest.mark.parametrize("name", SMOOTH)
def test_observed_order(name):
    known = case.answer(name)
    coarse, fine = (case.run(name, cells, []) for cells in known["ladder"][:2])
    for norm, least in (("l2", known["order"] - 0.05), ("most", known["order"] - 0.15)):
        for field, before in getattr(coarse, norm).items():
            after = getattr(fine, norm)[field]
            if field == "T" and name != "heat_conduction":
                least -= 0.3   # limited at its extrema
            if before > 1e-12:
                assert np.log2(before / after) >= least, (field, norm, before, after)


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
