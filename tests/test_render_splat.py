"""Particles in sparse bricks: the thesis' filter, each counted once, empty cells empty."""

import numpy as np
import pytest

from render import splat
from render.bricks import B, Bricks, from_cells, grid_of
from render.smoke import Haze
from render.volume import ENTRIES, Volume, along_ray

SIZE = np.array((1.0, 2.0, 1.5))
CELLS = (20, 40, 30)
NOTHING = np.zeros((1, 1, 1, 3), np.float32)
DARK = Haze(NOTHING[..., 0], NOTHING, NOTHING, SIZE)


def normalised(alpha: float = 1.4, n: int = 5) -> np.ndarray:
    weights = splat.gaussian(alpha, n)
    return weights / weights.sum()


def counted(position: np.ndarray, heat: float = 0.5, soot: bool = False) -> Bricks:
    n = len(position)
    return splat.counted(position, np.full(n, heat), np.full(n, soot), CELLS, SIZE, normalised())


def dense(bricks: Bricks) -> np.ndarray:
    """(nz, ny, nx, channels) from what each brick owns; shared values must agree."""
    shape = [n * B + 1 for n in bricks.place.shape]
    cells = np.full((*shape, bricks.pool.shape[-1]), np.nan, np.float32)
    for place in np.argwhere(bricks.place >= 0):
        block = cells[tuple(slice(p * B, p * B + B + 1) for p in place)]
        values = bricks.pool[bricks.place[tuple(place)]]
        assert np.array_equal(block[~np.isnan(block)], values[~np.isnan(block)])
        block[:] = values
    return np.nan_to_num(cells)[1:CELLS[2] + 1, 1:CELLS[1] + 1, 1:CELLS[0] + 1]


def test_the_filter_of_the_thesis():
    weights = splat.gaussian(1.4, 5)
    assert weights.sum() == pytest.approx(0.809500, abs=1e-6)
    assert weights[2, 2, 2] / weights.sum() == pytest.approx(0.0285844, abs=1e-7)


def test_one_particle_lays_down_the_filter():
    position = np.array([[0.42, 1.03, 0.77]])
    cells = dense(counted(position))
    i, j, k = np.floor(position[0] / SIZE * CELLS).astype(int)
    assert cells[k - 2:k + 3, j - 2:j + 3, i - 2:i + 3, 1] == pytest.approx(normalised(), rel=1e-6)
    assert (cells[..., 1] > 0).sum() == 125
    assert cells[..., 0] == pytest.approx(0.5 * cells[..., 1])
    assert cells.shape[-1] == 2     # no soot, no channel for it


@pytest.mark.parametrize("soot", [False, True])
def test_particles_are_counted_once(soot):
    """Also on the faces of bricks; those outside the box not at all."""
    random = np.random.default_rng(2)
    position = random.uniform(0.1, 0.9, (500, 3)) * SIZE
    position[:100] = np.round(position[:100] / SIZE * CELLS / B) * B / CELLS * SIZE + 1e-9
    position = np.clip(position, 0.1 * SIZE, 0.9 * SIZE)
    outside = np.array([[-0.1, 1, 1], [1.0, 1, 1], [0.5, 2.0, 1], [0.5, 1, 9]])
    cells = dense(counted(np.concatenate([position, outside]), soot=soot))
    assert cells[..., 2 if soot else 1].sum() == pytest.approx(500, rel=1e-5)
    assert not soot or not cells[..., :2].any()


def test_memory_is_in_proportion_to_what_is_filled():
    """A corner of 1/8 of the box needs about 1/8 of the bricks; nothing needs none."""
    random = np.random.default_rng(3)
    cells, weights = (160, 160, 160), normalised()

    def bricks(reach: float, count: int) -> Bricks:
        position = random.uniform(0, reach, (count, 3))
        return splat.counted(position, np.zeros(count), np.zeros(count, bool), cells,
                             np.ones(3), weights)

    full, eighth = bricks(1.0, 80_000), bricks(0.5, 10_000)
    assert 0.99 * 21 ** 3 < len(full.pool) <= 21 ** 3
    assert 0.99 * 11 ** 3 < len(eighth.pool) <= 11 ** 3
    assert len(bricks(0.5, 0).pool) == 0
    assert eighth.bytes < 0.16 * full.bytes


def test_counts_become_densities_and_empty_cells_stay_empty():
    random = np.random.default_rng(4)
    places = random.uniform(0.3, 0.7, (400, 3)) * SIZE
    bricks = counted(places, heat=0.8)
    most = splat.densest(bricks)
    cells, shown = dense(bricks), dense(splat.mapped(bricks, 0.05, 0.95, most))
    empty = cells[..., 1] == 0
    assert 0.3 < empty.mean() < 0.99
    assert not shown[empty].any()
    assert shown[..., 1][~empty].min() > 0.05
    assert shown[..., 1].max() == pytest.approx(0.95)
    assert shown[..., 0][~empty] == pytest.approx(0.8 * shown[..., 1][~empty], rel=1e-5)
    brighter = splat.mapped(counted(places, heat=0.8), 0.05, 0.95, most / 9)
    assert dense(brighter)[..., 1].max() == pytest.approx(0.95)


def test_bricks_hold_the_cells_they_were_made_from():
    random = np.random.default_rng(5)
    heat = random.random((CELLS[2], CELLS[1], CELLS[0])).astype(np.float32)
    soot = random.random(heat.shape).astype(np.float32)
    cells = dense(from_cells(heat, soot, -1.0))
    assert np.array_equal(cells, np.stack([heat, soot], axis=-1))


@pytest.mark.parametrize("n", [1, 7, 8, 9, 15, 16, 17])
def test_every_point_of_the_box_lies_in_a_brick(n):
    """Exact for a uniform volume, for sizes around multiples of the brick, up to the last face."""
    bricks = from_cells(np.ones((n, n, n), np.float32), np.empty((0, 0, 0), np.float32), 0.0)
    assert bricks.place.shape == grid_of((n, n, n)) and (bricks.place >= 0).all()
    table = np.column_stack([np.ones((ENTRIES, 3)), np.full(ENTRIES, 2.0)])
    volume = Volume(bricks, np.array((n, n, n)), np.ones(3), table, np.zeros(4), 0.03, DARK)
    for end in (0.0, 0.5, 1.0 - 1e-12):
        clear = along_ray(volume, (end, end, -1.0), (0.0, 0.0, 1.0), np.inf, 0.5)[3]
        assert clear == pytest.approx(np.exp(-2), rel=1e-6)


def test_mean_heat_is_not_darkened_by_empty_neighbours():
    """One hot particle has the same colour from its middle to the rim of its filter."""
    bricks = splat.mapped(counted(np.array([[0.5, 1.0, 0.75]]), heat=0.8), 0.05, 0.95, 1.0)
    table = np.zeros((ENTRIES, 4))
    table[:, 0], table[:, 1], table[:, 3] = np.linspace(0, 1, ENTRIES), 1.0, 3.0
    volume = Volume(bricks, np.array(CELLS), SIZE, table, np.zeros(4), 0.004, DARK)
    for x in (0.5, 0.58, 0.62):
        red, green, _, _ = along_ray(volume, (x, 1.0, -1.0), (0.0, 0.0, 1.0), np.inf, 0.5)
        assert green > 0 and red / green == pytest.approx(0.8, rel=1e-4)
