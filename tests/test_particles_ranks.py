"""Particles on 1 to 4 ranks: none lost, none doubled, each on the rank that owns its cell."""

from pathlib import Path

import numpy as np
import pytest

from solver.grid import Grid
from solver.scene_physics import Domain
from solver.swarm import PARTICLE, SORT_FROM, Swarm, owners
from tests.fire_case import COMM, gathered, run, running

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.serial
@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
def test_wanderers_arrive(ranks, mpirun):
    result = mpirun(ranks, "-m", "tests.wanderers", cwd=ROOT)
    assert result.returncode == 0, result.stdout
    assert result.stdout.strip().splitlines()[-1] == "same", result.stdout


def test_owner_of_a_cell_is_the_grids():
    grid = Grid(Domain(cells=(5, 9, 8)), COMM)
    k, j, i = np.meshgrid(*(np.arange(n) for n in (8, 9, 5)), indexing="ij")
    centres = (np.stack([i, j, k], axis=-1).reshape(-1, 3) + 0.5) * grid.spacing
    mine = np.ones(len(centres), bool)
    for axis in range(3):
        cell = centres[:, axis] / grid.spacing[axis]
        mine &= (cell > grid.start[axis]) & (cell < grid.start[axis] + grid.count[axis])
    assert np.array_equal(owners(grid, centres) == COMM.rank, mine)
    grid.destroy()


def test_exchange_ends_where_the_migration_of_petsc_does():
    grid = Grid(Domain(cells=(8, 8, 8)), COMM)
    draw = np.random.default_rng(5)
    records = np.zeros(500, PARTICLE)
    records["position"], records["mass"] = draw.random((500, 3)), draw.random(500)
    records["id"] = np.arange(500)
    held = []
    for ours in (True, False):
        swarm = Swarm(grid)
        swarm.append(records[COMM.rank::COMM.size])
        if ours:
            swarm.settle()
        else:
            ranks = swarm.dm.getField("DMSwarm_rank").reshape(-1)   # newer PETSc: rows
            ranks[:] = owners(grid, swarm.points["position"])
            swarm.dm.restoreField("DMSwarm_rank")
            swarm.dm.migrate(remove_sent_points=True)
            swarm.points = swarm._view()
        held.append(np.sort(swarm.points.copy(), order="id"))
        swarm.destroy()
    assert np.array_equal(held[0], held[1])
    assert COMM.allreduce(len(held[0])) == 500
    grid.destroy()


def test_sorting_keeps_every_record_and_orders_by_cell():
    grid = Grid(Domain(cells=(8, 8, 8)), COMM)
    swarm = Swarm(grid)
    count = SORT_FROM + 100
    records = np.zeros(count * COMM.size, PARTICLE)
    draw = np.random.default_rng(1)
    records["position"] = draw.random((len(records), 3))
    records["id"] = np.arange(len(records))
    records["mass"] = draw.random(len(records))
    mine = owners(grid, records["position"]) == COMM.rank
    swarm.append(records[mine])
    swarm.sort()
    found = swarm.points
    assert np.array_equal(np.sort(found["id"]), records["id"][mine])
    assert np.array_equal(records["mass"][found["id"]], found["mass"])
    i, j, k = (found["position"] * 8).astype(int).T
    in_order = np.all(np.diff((k * 8 + j) * 8 + i) >= 0)
    assert in_order == (len(found) >= SORT_FROM)
    swarm.destroy()
    grid.destroy()


def test_same_fire_with_every_rank_count():
    """None has left the box: what is made, lit, burnt and sooted is known exactly."""
    with running(domain={"cells": [12, 10, 9]}, time={"dt_max": 2e-3},
                 fuel={"particles": 200, "ignited": 50, "rate": 1000.0, "gas": 0.1,
                       "heat_transfer": 0.0},
                 soot={"threshold": 0.005}) as simulation:
        run(simulation, 0.03)
        points = gathered(simulation)
        report = simulation.report
    assert len(np.unique(points["id"])) == len(points)
    assert (report.fuel, report.soot) == ((points["kind"] == 0).sum(), (points["kind"] == 1).sum())
    assert report.fuel == 230
    assert report.burnt == pytest.approx(50 * 0.21 * 0.03, rel=1e-13)
    assert report.soot == 50
    assert report.gas == pytest.approx(0.1 * report.burnt, rel=1e-13)
