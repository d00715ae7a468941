"""Light splits at glass as Snell, Fresnel (Schlick) and Beer-Lambert say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from render.glass import reflect, refract, schlick
from tests.render_run import still

angles = st.floats(0.0, np.pi / 2 - 1e-3)
indices = st.floats(1.0, 3.0)
UP = (0.0, 0.0, 1.0)


def incoming(angle: float) -> tuple[float, float, float]:
    return np.sin(angle), 0.0, -np.cos(angle)


@given(angles, indices)
def test_snell_entering(angle, ior):
    _, t = refract(incoming(angle), UP, 1 / ior)
    assert ior * t[0] == pytest.approx(np.sin(angle), abs=1e-14)
    assert t[2] < 0 and np.linalg.norm(t) == pytest.approx(1, abs=1e-14)


@given(angles, st.floats(1.001, 3.0))
def test_snell_leaving_or_total_reflection(angle, ior):
    share, t = refract(incoming(angle), UP, ior)
    if ior * np.sin(angle) > 1:
        assert share == 1 and t == (0, 0, 0)
    else:
        assert t[0] == pytest.approx(ior * np.sin(angle), abs=1e-13)
        assert np.linalg.norm(t) == pytest.approx(1, abs=1e-13)
        assert 0 <= share <= 1


@given(angles, indices)
def test_slab_returns_the_incoming_direction(angle, ior):
    _, inside = refract(incoming(angle), UP, 1 / ior)
    _, outside = refract(inside, UP, ior)
    assert outside == pytest.approx(incoming(angle), abs=1e-9)


@given(angles)
def test_reflection_mirrors(angle):
    i = incoming(angle)
    assert reflect(i, UP) == (i[0], 0.0, -i[2]) == reflect(i, (0.0, 0.0, -1.0))


def test_schlick_is_the_same_both_ways_and_total_at_grazing():
    assert schlick(1.0, 1.5) == pytest.approx(0.04) == schlick(1.0, 1 / 1.5)
    assert schlick(0.0, 1.5) == 1
    inside, t = refract(incoming(0.5), UP, 1 / 1.5)
    outside, _ = refract(t, UP, 1.5)
    assert inside == pytest.approx(outside, rel=1e-12)


def test_beer_lambert_through_a_slab():
    """Without bending (ior 1) a slab of thickness 0.3 leaves exp(-0.3 absorption) head on."""
    absorption = (1.0, 2.0, 5.0)
    light = still({
        "width": 1, "height": 1, "samples": 1, "light": [], "ambient": [0, 0, 0],
        "camera": {"position": [0.5, 0.5, 3], "target": [0.5, 0.5, 0], "fov": 1e-4},
        "backdrop": {"kind": "uniform"},
        "material": {"filter": {"kind": "glass", "ior": 1.0, "absorption": absorption}},
        "object": [{"shape": "box", "low": [0, 0, 0.4], "high": [1, 1, 0.7],
                    "material": "filter"}]})
    # the ray inside starts 2e-5 below the surface
    assert light[0, 0] == pytest.approx(np.exp(-0.3 * np.array(absorption)), rel=1.1e-4)


def test_glass_does_not_show_in_a_uniform_surrounding():
    """Reflected and refracted shares add up to one at every bounce, to the last."""
    for depth in (0, 1, 2, 8):
        light = still({
            "width": 40, "height": 40, "light": [], "depth": depth,
            "backdrop": {"kind": "uniform", "colour": [0.25, 0.5, 1.0]},
            "material": {"clear": {"kind": "glass"}},
            "object": [{"shape": "sphere", "place": [0.4, 0.5, 0.5], "radius": 0.25,
                        "material": "clear"},
                       {"shape": "box", "low": [0.5, 0.2, 0.2], "high": [0.9, 0.6, 0.5],
                        "material": "clear"}]})
        assert light == pytest.approx(np.broadcast_to((0.25, 0.5, 1.0), light.shape), rel=1e-6)


def test_glass_inside_glass_is_one_body():
    """A box in a box of the same glass cannot be seen: pieces that collide have no walls within."""
    def box(low: float, high: float) -> dict[str, object]:
        return {"shape": "box", "low": [low] * 3, "high": [high] * 3, "material": "clear"}

    def seen(*objects: dict[str, object]) -> np.ndarray:
        return still({
            "width": 40, "height": 40, "light": [], "depth": 16, "object": objects,
            "camera": {"position": [1.1, 0.9, 2.5], "target": [0.5, 0.5, 0.5]},
            "material": {"clear": {"kind": "glass", "absorption": [3, 1, 2]}}})

    alone = seen(box(0.2, 0.8))
    assert abs(alone - seen(box(0.2, 0.8), box(0.35, 0.62))).max() < 2e-3
    assert abs(alone - seen(box(0.2, 0.75))).max() > 0.05


def test_the_eye_may_be_inside_glass():
    """From within a box without bending, the way out is tinted by its length."""
    light = still({
        "width": 1, "height": 1, "samples": 1, "light": [], "ambient": [0, 0, 0],
        "camera": {"position": [0.5, 0.5, 0.5], "target": [0.5, 0.5, 0], "fov": 1e-4},
        "backdrop": {"kind": "uniform"},
        "material": {"filter": {"kind": "glass", "ior": 1.0, "absorption": [1, 2, 5]}},
        "object": [{"shape": "box", "material": "filter"}]})
    assert light[0, 0] == pytest.approx(np.exp(-0.5 * np.array((1, 2, 5))), rel=1e-4)
