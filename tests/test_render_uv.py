"""Where texture coordinates stand still there is a tangent all the same, and no NaN."""

import numpy as np
import pytest

from render.frame import Film
from render.uv import against
from solver import files, scene


@pytest.mark.parametrize("t", [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1e-200, 0.0, 0.0)])
@pytest.mark.parametrize("n", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)])
def test_a_tangent_where_u_stands_still(t, n):
    found = against(t, n)
    assert np.dot(found, found) == pytest.approx(1.0, abs=1e-15)
    assert abs(np.dot(found, n)) < 1e-15


def test_brushed_checker_on_a_pole_of_a_sphere():
    """The camera looks down on the pole; the middle ray meets it exactly."""
    found = scene.build({"time": {"end": 1.0, "frame": 1.0}, "render": {
        "width": 9, "height": 9, "samples": 1,
        "camera": {"position": [0.5, 2.0, 0.5], "target": [0.5, 0.5, 0.5], "up": [0, 0, 1]},
        "object": [{"shape": "sphere", "place": [0.5, 0.5, 0.5], "radius": 0.4,
                    "material": "brushed"}],
        "material": {"brushed": {"kind": "ashikhmin", "specular": 0.5, "exponent": 20.0,
                                 "exponent_v": 400.0,
                                 "texture": {"kind": "checker", "scale": 0.05}}}}})
    assert found.render is not None
    film = Film(found, found.render, None, None)
    light = film.frame(files.Snapshot(0, 0.0, 0, {}, {}, {})).light
    assert np.isfinite(light).all() and light.min() >= 0 and light.max() > 0
