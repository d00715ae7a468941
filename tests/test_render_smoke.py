"""Smoke is lit by what surrounds it, and darker on the side turned away from the light."""

import numpy as np
import pytest

from render.bricks import from_cells
from render.fire import emitted
from render.lights import Lights, light_table, parts
from render.smoke import Haze, clearness, coarse, escaping, light_up, lit_at
from render.volume import ENTRIES
from solver.scene_render import Light

SIZE = np.array((1.0, 1.0, 2.0))
NO_LIGHTS = light_table(())


def hazy(soot: np.ndarray, lamps: Lights = NO_LIGHTS, fire: Lights = NO_LIGHTS) -> Haze:
    """Absorption 3 times soot, no fire, ambient light (0.1, 0.2, 0.3)."""
    bricks = from_cells(np.zeros(soot.shape, np.float32), soot.astype(np.float32), 0.5)
    haze = coarse(bricks, np.array(soot.shape[::-1]), SIZE, np.zeros((ENTRIES, 4)), 3.0)
    light_up(haze, lamps, fire, np.array((0.1, 0.2, 0.3)))
    return haze


@pytest.mark.parametrize("n", [5, 16, 40, 100])
def test_coarse_absorption_keeps_the_total(n):
    soot = np.random.default_rng(0).random((n + 3, n, n + 1))
    haze = hazy(soot)
    assert haze.dense.shape[1] <= 38
    total = haze.dense.sum() * np.prod(haze.edge)
    assert total == pytest.approx(3 * soot.mean() * SIZE.prod(), rel=1e-5)


def test_without_lamps_there_is_the_ambient_light():
    haze = hazy(np.ones((8, 8, 8)))
    assert haze.lit.reshape(-1, 3) == pytest.approx(np.tile((0.1, 0.2, 0.3), (512, 1)))


def test_a_lamp_reaches_into_smoke_as_beer_and_lambert_say():
    sun = light_table([Light(kind="directional", direction=(0, -1, 0), intensity=4.0)])
    haze = hazy(np.ones((16, 16, 16)), sun)
    depth = 1 - (np.arange(16) + 0.5) / 16
    expected = 0.1 + np.exp(-3 * depth)
    assert haze.lit[3, :, 5, 0] == pytest.approx(expected, rel=1e-5)


def test_a_lamp_is_weaker_far_away_and_behind_a_cloud():
    lamp = light_table([Light(position=(0.5, 0.5, -1.0), intensity=4.0)])
    soot = np.zeros((32, 16, 16))
    soot[8:12, 4:12, 4:12] = 2.0
    haze = hazy(soot, lamp)
    before, behind, beside = (haze.lit[k, j, j, 0] for k, j in ((4, 8), (20, 8), (20, 0)))
    assert before == pytest.approx(0.1 + 1 / 1.28125 ** 2, rel=0.01)
    assert behind < 0.1 + 0.4 * (beside - 0.1)


def test_fire_lights_smoke_around_it():
    fire = parts(np.array([[0.5, 0.5, 1.0]]), np.array([[4.0, 2.0, 0.0]]), np.array([0.01]))
    haze = hazy(np.ones((16, 8, 8)), fire=fire)
    gain = haze.lit - np.array((0.1, 0.2, 0.3), np.float32)
    assert gain[8, 4, 4, 0] > gain[12, 4, 4, 0] > gain[15, 4, 4, 0] > 0
    assert gain[..., 1] == pytest.approx(gain[..., 0] / 2, rel=1e-4)
    assert not gain[..., 2].any()


def test_the_way_through_uniform_haze():
    haze = hazy(np.ones((16, 16, 16)))
    for reach, length in ((np.inf, 1.0), (0.25, 0.25)):
        clear = clearness(haze.dense, haze.edge, (0.5, 0.0, 1.0), (0.0, 1.0, 0.0), reach)
        assert clear == pytest.approx(np.exp(-3 * length), rel=1e-6)
    assert clearness(haze.dense, haze.edge, (2.0, 0.0, 1.0), (0.0, 1.0, 0.0), np.inf) == 1


def test_light_between_coarse_cells_is_linear():
    k, j, i = np.indices((4, 5, 6))
    lit = np.stack([i, j, k], axis=-1).astype(np.float32)
    assert lit_at(lit, 2.25, 1.5, 0.75) == pytest.approx((2.25, 1.5, 0.75))
    assert lit_at(lit, -3.0, 9.0, 1.0) == pytest.approx((0, 4, 1))


def test_light_escapes_from_the_rim_and_not_from_the_middle():
    haze, share = hazy(30 * np.ones((16, 16, 16))), np.zeros(3)
    place = np.array([[0.5, 0.5, 1.0], [0.5, 0.5, 0.0], [0.5, 0.5, -1.0]])
    escaping(haze.dense, haze.edge, place, share)
    assert share[0] < 1e-15
    assert share[1] == pytest.approx(1 / 6, rel=1e-6)
    assert share[2] == pytest.approx(5 / 6, rel=1e-6)


def test_thin_fire_gives_off_all_its_light():
    """s I V / pi of a lamp's intensity, at the middle of the hot cells."""
    heat = np.zeros((32, 16, 16), np.float32)
    heat[8:16, 4:8, 4:8] = 1.0
    table = np.tile((3.0, 2.0, 1.0, 1e-4), (ENTRIES, 1)) * np.linspace(0, 1, ENTRIES)[:, None]
    bricks = from_cells(heat, np.zeros((0, 0, 0), np.float32), 0.5)
    power, place = emitted(coarse(bricks, np.array((16, 16, 32)), SIZE, table, 0.0))
    assert power.sum(axis=0) == pytest.approx(
        np.array((3, 2, 1)) * 1e-4 * 2 / 64 / np.pi, rel=1e-3)
    assert (power[:, :1] * place).sum(axis=0) / power[:, 0].sum() == pytest.approx(
        (0.375, 0.375, 0.75), abs=1e-5)
