"""Pixels whose samples differ are sampled again: less error at edges, no change elsewhere."""

from typing import Any

import numpy as np
import pytest

from render.lights import illuminate, joined, light_table, parts
from render.rays import allocate_lit
from solver.scene_render import Light
from tests.render_run import WINDOW, still
from tests.test_render_scene import film_of, snapshot

EDGES = {"width": 40, "height": 40, "light": [], "ambient": [1, 1, 1],
         "backdrop": {"kind": "uniform", "colour": [0, 0, 0]},
         "object": [{"shape": "sphere", "place": [0.5, 0.5, 0.5], "radius": 0.3,
                     "material": "white"}], "material": {"white": {"colour": [1, 1, 1]}}}


def error(look: dict, exact: np.ndarray) -> float:
    return float(np.sqrt(np.mean((still({**EDGES, **look}) - exact) ** 2)))


def test_edges_get_better_and_the_rest_stays():
    exact = still({**EDGES, "samples": 24})
    plain, finer = still({**EDGES}), still({**EDGES, "adaptive": 0.05})
    changed = (plain != finer).any(axis=2)
    assert 0.02 < changed.mean() < 0.2
    assert not changed[(exact == 0).all(axis=2) | (exact == 1).all(axis=2)].any()
    assert error({"adaptive": 0.05}, exact) < 0.6 * error({}, exact)


def test_one_sample_tells_nothing_about_its_pixel():
    assert np.array_equal(still({**EDGES, "samples": 1}),
                          still({**EDGES, "samples": 1, "adaptive": 0.01}))


def test_constant_surroundings_stay_constant():
    light = still({"width": 5, "height": 4, "adaptive": 1e-9, "backdrop": {
        "kind": "uniform", "colour": [0.3, 0.6, 0.9]}})
    assert light == pytest.approx(np.broadcast_to((0.3, 0.6, 0.9), (4, 5, 3)), rel=1e-6)


def test_rows_do_not_show():
    film = film_of({**WINDOW, "render": {"width": 24, "height": 20, "adaptive": 0.1}}, fire=True)
    moment = snapshot(film, 0.1, 0.5)
    whole = film.frame(moment).light
    for first in range(3):
        assert np.array_equal(whole[first::3], film.frame(moment, range(first, 20, 3)).light)


class Veil:
    """Surfaces that let light pass on one side of x = 0 only."""

    def transmittance(self, shadow, reach):
        assert np.isfinite(reach).all()
        shadow.weight[shadow.direction[:, 0] < 0] = 0


@pytest.mark.parametrize("lamps", [(), (Light(position=(0.0, 2.0, 0.0), intensity=3.0),)])
def test_one_shadow_ray_stands_for_all_parts_of_the_fire(lamps):
    """On average the light of the parts that are seen; exactly all of it where all are."""
    count = 20_000
    points = allocate_lit(count)
    for column in points:
        column[:] = 0
    points.normal[:, 1], points.weight[:], points.diffuse[:] = 1, 1, 1
    points.viewer[:, 1], points.exponents[:] = 1, 1
    points.pixel[:] = points.seed[:] = np.arange(count)
    place = np.array([[-1.0, 1, 0], [0.5, 1, 0], [0.5, 2, 1]])
    fire = parts(place, np.array([[4.0, 2, 1], [2, 1, 0.5], [1, 0.5, 0.25]]), np.array([0, 0.1, 1]))
    image = np.zeros((count, 3))
    veil: Any = Veil()
    illuminate(points, joined(light_table(lamps), fire), veil, image)
    square = (place ** 2).sum(axis=1)
    each = fire.colour[:, 0] * place[:, 1] / np.sqrt(square) / (square + fire.spread)
    lamp = 3.0 / 4 if lamps else 0.0
    assert image[:, 0].mean() == pytest.approx(lamp + each[1:].sum(), rel=0.02)
    assert set(np.round(np.unique(image[:, 0]), 9)) == {round(lamp, 9),
                                                        round(lamp + each.sum(), 9)}
