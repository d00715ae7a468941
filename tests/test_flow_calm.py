"""A lasting source does not feed noise on the grid, with the schemes that have no upwinding."""

import numpy as np
import pytest

from solver import plan
from tests.flow_case import faces, make_scene, simulation, velocity

BOX = faces("wall", "open", "slip", "slip", "periodic", "periodic")
FLUID = {"source": "where((x-.4)**2+(y-.5)**2<.05, 1.0, 0.0)"}
STEPS = 250


def energies(advection):
    """Kinetic energy over the source's own flow, early and at the end; the largest |w|."""
    scene = make_scene((9, 8, 4), BOX, initial={"noise": 1e-3},
                       fluid={**FLUID, "advection": advection}, time={"end": 1e3, "frame": 1e3})
    with simulation(scene) as sim:
        found = [sim.advance(1e3).energy for _ in range(STEPS)]
        return found[20], found[-1], max(float(np.abs(q).max()) for q in velocity(sim.state)[2:])


@pytest.mark.parametrize("advection", ["central", "central4"])
def test_noise_in_a_source_stays_small(advection):
    early, late, across = energies(advection)
    assert late == pytest.approx(early, rel=0.01)
    assert across < 0.03


def test_without_the_diffusion_the_noise_takes_over(monkeypatch):
    monkeypatch.setattr(plan, "ORDER", tuple(s for s in plan.ORDER if s.name != "calm"))
    early, late, across = energies("central")
    assert late > 2 * early and across > 0.1
