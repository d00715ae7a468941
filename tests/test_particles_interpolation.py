"""Reading and writing fields at points: exact for linear fields, right at every edge, adjoint."""

import numpy as np
import pytest

from solver.boundary import fill_temperature, fill_velocity
from solver.burn import deposit_burning
from solver.particles import move
from solver.state import coordinates
from solver.swarm import PARTICLE, owners
from tests.fire_case import COMM, QUIET, running

SIZE, CELLS = (1.5, 1.0, 0.8), (6, 7, 9)


def corners_edges_and_inside(count=200):
    """(n, 3) points of the closed box: random ones, some moved onto faces, edges and corners."""
    draw = np.random.default_rng(3)
    points = draw.random((count, 3))
    snap = draw.integers(0, 3, (count, 3))
    points = np.where(snap == 1, np.round(points), points)   # 0 or 1
    return points * SIZE


def place_of(grid):
    return np.array([1 / h for h in grid.spacing]), np.array(grid.start, float)


def read(simulation, points):
    """Velocity and temperature at points of this rank's block, as the particles read them."""
    state = simulation.state
    records = np.zeros(len(points), PARTICLE)
    records["position"], records["mass"] = points, 1.0
    move(records, *state.velocity, state.T, *place_of(state.grid), 0.0, 0.0, 0.0, 1e9)
    return records["velocity"], records["temperature"]


def mine(grid, points):
    return points[owners(grid, points) == COMM.rank]


def test_linear_fields_are_exact_on_right_top_and_front_faces():
    gradient = np.array([[2.0, -1, 0.5], [0.3, 4, 1], [-2, 0.7, 3], [1, 2, -3]])
    with running(domain={"size": SIZE, "cells": CELLS}, fuel=QUIET) as simulation:
        state = simulation.state
        for field, slope, axis in zip((*state.velocity, state.T), gradient, (0, 1, 2, None),
                                      strict=True):
            at = coordinates(state.grid, axis)
            field[...] = 1 + slope[0] * at["x"] + slope[1] * at["y"] + slope[2] * at["z"]
        points = mine(state.grid, corners_edges_and_inside())
        velocity, temperature = read(simulation, points)
        expected = 1 + points @ gradient.T
        assert np.abs(velocity - expected[:, :3]).max(initial=0) < 1e-13
        assert np.abs(temperature - expected[:, 3]).max(initial=0) < 1e-13


def test_each_component_reads_its_own_field():
    with running(fuel=QUIET) as simulation:
        for value, field in zip((1.0, 2.0, 3.0), simulation.state.velocity, strict=True):
            field.fill(value)
        velocity, _ = read(simulation, mine(simulation.state.grid, np.full((1, 3), 0.4)))
        assert np.array_equal(velocity, np.broadcast_to([1.0, 2, 3], velocity.shape))


@pytest.mark.parametrize("boundary", ["open", "wall", "slip", "periodic"])
def test_uniform_temperature_is_read_in_every_corner(boundary):
    with running(domain={"size": SIZE, "cells": CELLS, "boundary": boundary,
                         "expansion": "spread"}, fuel=QUIET) as simulation:
        state = simulation.state
        for field in (*state.velocity, state.T):
            field.fill(np.nan)   # whatever is not filled shows
            field[2:-2, 2:-2, 2:-2] = 5.0
        for axis, field in enumerate(state.velocity):
            view = np.moveaxis(field, (2, 1, 0)[axis], 0)
            view[1] = 5.0        # the low face of the box is a value, not a ghost
        fill_velocity(state.grid, state.velocity)
        fill_temperature(state.grid, state.T, state.velocity, 5.0)
        velocity, temperature = read(simulation, mine(state.grid, corners_edges_and_inside()))
        assert np.all(temperature == 5.0)
        assert np.all(np.isfinite(velocity))


def test_points_far_outside_or_nowhere_read_something_and_touch_nothing_else():
    with running(fuel=QUIET) as simulation:
        simulation.state.T.fill(5.0)
        points = np.array([[np.nan, 0.5, 0.5], [1e300, -1e300, 0], [np.inf, -np.inf, 0.1]])
        _, temperature = read(simulation, points)
        assert np.all(temperature == 5.0)


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
def test_deposit_is_the_adjoint_of_reading(boundary):
    """Σ_cells D(a) T = Σ_particles a T(x): the same weights, ghosts and ranks included."""
    with running(domain={"size": SIZE, "cells": CELLS, "boundary": boundary,
                         "expansion": "spread"}, fuel=QUIET) as simulation:
        state, grid = simulation.state, simulation.state.grid
        at = coordinates(grid, None)
        state.T[...] = (np.sin(2 * np.pi * at["x"] / SIZE[0]) + np.cos(2 * np.pi * at["y"])
                        * np.sin(4 * np.pi * at["z"] / SIZE[2]))
        fill_temperature(grid, state.T, state.velocity, 0.0)
        points = mine(grid, corners_edges_and_inside())
        amount = 1 + np.abs(points).sum(axis=1)
        field = grid.field()
        for point, a in zip(points, amount, strict=True):
            record = np.zeros(1, PARTICLE)
            record["position"], record["mass"], record["ignited"] = point, 1.0, 1
            deposit_burning(record, field, *place_of(grid), 0.0, a, 1.0, 0)
        grid.fold(field)
        inner = (slice(2, -2),) * 3
        _, temperature = read(simulation, points)
        written = COMM.allreduce(float((field[inner] * state.T[inner]).sum()))
        was_read = COMM.allreduce(float(amount @ temperature))
        assert written == pytest.approx(was_read, rel=1e-12)
        assert COMM.allreduce(float(field.sum())) == pytest.approx(
            COMM.allreduce(float(amount.sum())), rel=1e-13)
