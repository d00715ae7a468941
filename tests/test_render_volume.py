"""Fire and smoke along a ray: emission and absorption, front to back, with nothing skipped."""

import numpy as np
import pytest

from render.bricks import from_cells
from render.rays import Hits, allocate
from render.smoke import Haze
from render.volume import ENTRIES, Volume, along_ray, march

SIZE = np.array((1.0, 1.0, 1.0))
LIGHT = np.array((0.5, 0.25, 0.125))


def volume(heat: np.ndarray, soot: np.ndarray | float = 0.0, step: float = 0.01,
           opacity: float = 2.0, onset: float = -1.0, light: float = 0.0) -> Volume:
    """Absorption opacity * heat, emission (3, 2, 1) at all heats, albedo (0.1, 0.2, 0.3) of
    uniform light."""
    cells = np.array(heat.shape[::-1])
    bricks = from_cells(heat.astype(np.float32),
                        np.broadcast_to(soot, heat.shape).astype(np.float32), onset)
    table = np.column_stack([np.broadcast_to((3.0, 2.0, 1.0), (ENTRIES, 3)),
                             opacity * np.linspace(0, 1, ENTRIES)])
    haze = Haze(np.zeros((1, 1, 1), np.float32), np.zeros((1, 1, 1, 3), np.float32),
                np.full((1, 1, 1, 3), light, np.float32), SIZE)
    return Volume(bricks, cells, SIZE, table, np.array((0.1, 0.2, 0.3, 4.0)), step, haze)


@pytest.mark.parametrize("step", [0.5, 0.1, 0.003])
def test_uniform_slab_is_exact_for_every_step(step):
    """Radiance I (1 - exp(-s L)), transparency exp(-s L), along any ray, also a clipped one."""
    fire = volume(np.ones((9, 5, 7)), step=step)
    for d, reach, length in (((0.0, 0.0, 1.0), np.inf, 1.0), ((0.0, 0.6, 0.8), np.inf, 0.625),
                             ((1.0, 0.0, 0.0), 0.3, 0.3)):
        *rgb, clear = along_ray(fire, (0.5, 0.625, 0.0), d, reach, 0.7)
        expected = 1 - np.exp(-2.0 * length)
        assert rgb == pytest.approx(np.array((3, 2, 1)) * expected, rel=1e-6)
        assert clear == pytest.approx(1 - expected, rel=1e-6)


def test_hot_gas_glows_and_all_of_it_scatters():
    both = volume(np.ones((4, 4, 4)), np.ones((4, 4, 4)), light=2.0)
    *rgb, clear = along_ray(both, (0.5, 0.5, -1.0), (0, 0, 1), np.inf, 0.5)
    source = 2 / 6 * np.array((3, 2, 1)) + 2.0 * np.array((0.1, 0.2, 0.3))
    assert rgb == pytest.approx(source * (1 - np.exp(-6)), rel=1e-5)
    assert clear == pytest.approx(np.exp(-6), rel=1e-5)


def test_linear_heat_is_interpolated_and_converges_in_second_order():
    """Heat z on cell centres: absorption 2 z; the exact optical depth is 1."""
    n = 64
    heat = np.broadcast_to(((np.arange(n) + 0.5) / n)[:, None, None], (n, 4, 4))
    errors = []
    for step in (0.1, 0.05, 0.025):
        fire = volume(heat, step=step)
        clear = along_ray(fire, (0.5, 0.5, 0.0), (0, 0, 1), np.inf, 0.3)[3]
        back = along_ray(fire, (0.5, 0.5, 0.0), (0, 0, 1), np.inf, 0.7)[3]
        errors.append(abs(np.sqrt(clear * back) - np.exp(-1)))
    assert errors[-1] < 1e-4
    clear = along_ray(volume(heat, step=1e-3), (0.5, 0.5, 0.0), (0, 0, 1), np.inf, 0.5)[3]
    assert clear == pytest.approx(np.exp(-1), abs=2e-5)


def test_skipping_empty_bricks_changes_no_ray():
    random = np.random.default_rng(0)
    heat = np.zeros((24, 20, 28))
    heat[9:14, 6:9, 11:17] = random.random((5, 3, 6))
    full, sparse = volume(heat), volume(heat, onset=0.0)
    assert len(full.bricks.pool) == 3 * 4 * 4
    assert 0 < len(sparse.bricks.pool) < 0.3 * len(full.bricks.pool)
    for _ in range(300):
        o, d = random.uniform(-1, 2, 3), random.normal(size=3)
        d /= np.linalg.norm(d)
        ray = tuple(o), tuple(d), np.inf, random.random()
        assert along_ray(full, *ray) == pytest.approx(along_ray(sparse, *ray), abs=1e-12)


def test_a_dense_volume_hides_what_is_behind():
    fire = volume(np.ones((4, 4, 4)), opacity=50.0)
    assert along_ray(fire, (0.5, 0.5, -1.0), (0, 0, 1), np.inf, 0.5)[3] == 0


def test_rays_beside_before_and_inside_the_box():
    fire = volume(np.ones((4, 4, 4)))
    assert along_ray(fire, (2.0, 2.0, -1.0), (0, 0, 1), np.inf, 0.5) == (0, 0, 0, 1)
    assert along_ray(fire, (0.5, 0.5, -1.0), (0, 0, 1), 0.9, 0.5) == (0, 0, 0, 1)
    assert along_ray(fire, (0.5, 0.5, 0.75), (0, 0, 1), np.inf, 0.5)[3] == pytest.approx(
        np.exp(-0.5), rel=1e-6)


def test_march_weighs_light_and_rays():
    rays = allocate(1)
    rays.origin[0], rays.direction[0], rays.weight[0] = (0.5, 0.5, -1), (0, 0, 1), LIGHT
    rays.pixel[0], rays.seed[0] = 2, 9
    image = np.zeros((3, 3))
    nowhere = np.zeros(1, np.float32)
    march(volume(np.ones((4, 4, 4))), rays, Hits(np.array([np.inf]), np.array([-1]), nowhere,
                                                 nowhere), image, 0.5)
    left = np.exp(-2)
    assert image[2] == pytest.approx(LIGHT * (3, 2, 1) * (1 - left), rel=1e-6)
    assert rays.weight[0] == pytest.approx(LIGHT * left, rel=1e-6)
    assert not image[:2].any()


def test_a_weak_ray_stops_early_and_a_camera_ray_does_not():
    """What is left out behind a reflected ray is at most 0.001 of its sample."""
    fire = volume(np.ones((4, 4, 4)), opacity=5.0)
    whole = along_ray(fire, (0.5, 0.5, 0.0), (0, 0, 1), np.inf, 0.5)
    assert whole[3] == pytest.approx(np.exp(-5), rel=1e-5)
    for share in (1.0, 0.5, 0.04, 0.001):
        rays, image, nowhere = allocate(1), np.zeros((1, 3)), np.zeros(1, np.float32)
        rays.origin[0], rays.direction[0], rays.weight[0] = (0.5, 0.5, 0), (0, 0, 1), share / 4
        rays.pixel[0], rays.seed[0] = 0, 1
        march(fire, rays, Hits(np.array([np.inf]), np.array([-1]), nowhere, nowhere), image, 0.25)
        lost = share / 4 * np.array(whole[:3]) - image[0]
        assert lost == pytest.approx(np.zeros(3), abs=3 * 0.001 / 4)
        assert (rays.weight[0, 0] == 0) == (share * np.exp(-5) < 0.001)


def test_empty_bricks_know_how_far_it_is_to_the_next_filled_one():
    heat = np.zeros((8 * 9, 8 * 9, 8 * 9), np.float32)
    heat[36, 36, 36] = 1.0
    place = from_cells(heat, np.zeros((0, 0, 0), np.float32), 0.5).place
    k, j, i = np.indices(place.shape)
    away = np.maximum(np.maximum(abs(i - 4), abs(j - 4)), abs(k - 4))
    assert np.array_equal(place, -away)     # brick 4, 4, 4 is the first of the pool: 0
