"""After a step ∇·u = φ in every cell, whatever the faces, the sizes and the number of ranks."""

import numpy as np
import pytest

from solver.scene import SceneError
from solver.step import StepError
from tests.flow_case import (divergence, faces, gathered, make_scene, set_random, simulation,
                             velocity)

MOVING = {"wall": [1.0, 0.0, 0.3]}
MIXES = {
    "periodic": "periodic", "walls": "wall", "slip": "slip", "open": "open",
    "lid": faces("wall", "wall", "wall", MOVING, "slip", "wall"),
    "channel": faces("periodic", "periodic", "wall", MOVING, "periodic", "periodic"),
    "vent": faces("wall", "open", "slip", "wall", "wall", "wall"),
    "chimney": faces("open", "wall", "wall", "open", "periodic", "periodic"),
    "tunnel": faces("open", "open", "periodic", "periodic", "slip", "open"),
}
SIZES = [(9, 7, 5), (8, 1, 6), (7, 9, 1), (1, 5, 8)]
SOURCE = "3*sin(5*x+1)*cos(3*y)*exp(-z)"


@pytest.mark.parametrize("cells", SIZES, ids=str)
@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("integrator", ["euler", "rk3"])
def test_divergence_equals_its_source(mix, cells, integrator):
    scene = make_scene(cells, MIXES[mix], size=(1.0, 0.7, 1.3), initial={"noise": 1.0},
                       fluid={"source": SOURCE, "reynolds": 50.0},
                       time={"integrator": integrator}, domain={"expansion": "spread"})
    with simulation(scene) as sim:
        for _ in range(3):
            report = sim.advance(1.0)
        state = sim.state
        gap = divergence(velocity(state), state.grid.spacing) - gathered(state.grid, state.phi)
    assert np.abs(gap).max() < 1e-8 * report.rate
    assert report.divergence < 1e-8


@pytest.mark.parametrize("source", ["", SOURCE])
@pytest.mark.parametrize("cells", SIZES, ids=str)
def test_the_report_of_a_step_says_what_whole_arrays_say(cells, source):
    scene = make_scene(cells, "open", size=(1.0, 0.7, 1.3), fluid={"source": source})
    with simulation(scene) as sim:
        sim.advance(1.0)
        set_random(sim)
        report, state = sim.monitor(sim.state), sim.state
        phi = gathered(state.grid, state.phi) if source else np.zeros(tuple(reversed(cells)))
        q = velocity(state)
        gap = divergence(q, state.grid.spacing) - phi
    rate, energy = np.zeros(phi.shape), 0.0
    for values, axis, h in zip(q, (2, 1, 0), state.grid.spacing, strict=True):
        low, high = (np.take(values, range(part, part + phi.shape[axis]), axis) for part in (0, 1))
        rate += np.maximum(abs(low), abs(high)) / h
        energy += (low**2 + high**2).sum() / 4 * state.grid.volume
    assert report.rate == pytest.approx(rate.max(), rel=1e-13)
    assert report.energy == pytest.approx(energy, rel=1e-13)
    most = max(abs(phi).max(), rate.max())
    assert report.divergence == pytest.approx(abs(gap).max() / most, rel=1e-13)


@pytest.mark.parametrize("mix", ["walls", "slip", "lid", "vent"])
def test_walls_carry_no_flux(mix):
    scene = make_scene((9, 7, 5), MIXES[mix], initial={"noise": 1.0})
    with simulation(scene) as sim:
        for _ in range(3):
            sim.advance(sim.state.time + 1.0)
        low_high = [(np.moveaxis(q, 2 - a, 0)[[0, -1]]) for a, q in enumerate(velocity(sim.state))]
    for axis, (low, high) in enumerate(low_high):
        for name, face in ((f"{'xyz'[axis]}_min", low), (f"{'xyz'[axis]}_max", high)):
            if scene.domain.face(name) != "open":
                assert np.all(face == 0)
            else:
                assert np.any(face != 0)


ONE_CELL = "where((abs(x-0.5)<0.05)&(abs(y-0.5)<0.05)&(abs(z-0.5)<0.05), 7.0, 0.0)"


def test_open_box_lets_out_what_one_cell_makes():
    with simulation(make_scene((9, 9, 9), "open", fluid={"source": ONE_CELL})) as sim:
        sim.advance(1e-3)
        flux = 0.0
        for axis, q in enumerate(velocity(sim.state)):
            ends = np.moveaxis(q, 2 - axis, 0)
            area = sim.state.grid.volume / sim.state.grid.spacing[axis]
            flux += float((ends[-1] - ends[0]).sum()) * area
        made = float(gathered(sim.state.grid, sim.state.phi).sum()) * sim.state.grid.volume
    assert made == pytest.approx(7 / 9**3)
    assert flux == pytest.approx(made, rel=1e-9)


def test_closed_box_spreads_what_one_cell_makes():
    scene = make_scene((9, 9, 9), "wall", fluid={"source": ONE_CELL},
                       domain={"expansion": "spread"})
    with simulation(scene) as sim:
        sim.advance(1e-3)
        found = divergence(velocity(sim.state), sim.state.grid.spacing)
    wanted = np.zeros((9, 9, 9))
    wanted[4, 4, 4] = 7
    assert np.allclose(found, wanted - 7 / 9**3, atol=1e-8, rtol=0)


def test_closed_box_refuses_net_expansion_with_two_remedies():
    scene = make_scene((9, 9, 9), "wall", fluid={"source": ONE_CELL})
    with pytest.raises(SceneError, match='open a face, or set domain.expansion = "spread"'):
        with simulation(scene):
            pass
    with pytest.raises(SceneError, match='open a face, or set domain.expansion = "spread"'):
        make_scene((9, 9, 9), "slip", fuel={})


def test_expansion_that_begins_later_names_stage_and_remedies():
    scene = make_scene((9, 9, 9), "wall", fluid={"source": "where(t>0.5, 1.0, 0.0)"},
                       time={"dt_max": 0.3})
    with pytest.raises((StepError, SceneError), match="open a face"), simulation(scene) as sim:
        for _ in sim.run_to(1.0):
            pass
