"""Ashikhmin and Shirley's BRDF: golden values, reciprocal, never more light out than in."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from render import ashikhmin
from render.ashikhmin import diffuse, grazing, lighting, specular

N, U = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
cosines, angles = st.floats(0.02, 1.0), st.floats(0.0, 2 * np.pi)
exponents = st.floats(1.0, 1000.0)


def direction(cosine: float, angle: float) -> tuple[float, float, float]:
    sine = np.sqrt(1 - cosine * cosine)
    return sine * np.cos(angle), sine * np.sin(angle), cosine


def test_golden_value_at_normal_incidence():
    """n_u = n_v = 100, R_s = 0.3: 101 * 0.3 / (8 pi)."""
    value = specular(N, U, N, N, 100.0, 100.0) * (0.3 + 0.7 * grazing(N, N))
    assert value == pytest.approx(1.20560, abs=1e-5)


@given(cosines, angles, cosines, angles, exponents, exponents)
def test_reciprocity(c1, a1, c2, a2, n_u, n_v):
    k1, k2 = direction(c1, a1), direction(c2, a2)
    there, back = specular(N, U, k1, k2, n_u, n_v), specular(N, U, k2, k1, n_u, n_v)
    assert there == pytest.approx(back, rel=1e-12, abs=1e-300)
    assert grazing(k1, k2) == pytest.approx(grazing(k2, k1), rel=1e-9, abs=1e-14)
    assert diffuse(0.7, 0.2, c1, c2) == diffuse(0.7, 0.2, c2, c1) or diffuse(
        0.7, 0.2, c1, c2) == pytest.approx(diffuse(0.7, 0.2, c2, c1), rel=1e-12)


def albedo(cosine: float, r_d: float, r_s: float, n: float, count: int = 300) -> float:
    """Share of the light from one direction that leaves in all directions, by the midpoint rule."""
    k1 = direction(cosine, 0.3)
    colour_d, colour_s = (r_d, r_d, r_d), (r_s, r_s, r_s)
    c = (np.arange(count) + 0.5) / count
    a = 2 * np.pi * (np.arange(2 * count) + 0.5) / (2 * count)
    x, y = np.meshgrid(c, a, indexing="ij")
    values = np.array([lighting(N, U, k1, direction(p, q), colour_d, colour_s, n, n)[0]
                       for p, q in zip(x.ravel(), y.ravel(), strict=True)])
    return float((values / (np.pi * cosine) * x.ravel()).mean() * 2 * np.pi)


@pytest.mark.parametrize("cosine", [1.0, 0.7, np.cos(np.radians(75)), 0.1])
@pytest.mark.parametrize("r_s", [0.0, 0.3, 1.0])
def test_albedo_is_at_most_one(cosine, r_s):
    assert albedo(cosine, 1.0, r_s, 20.0, count=120) <= 1.0


def test_albedo_of_the_lobe_at_75_degrees():
    """F = 1, n = 100: 0.725, found by an independent quadrature."""
    assert albedo(np.cos(np.radians(75)), 0.0, 1.0, 100.0) == pytest.approx(0.725, abs=0.005)


def test_diffuse_albedo_at_normal_incidence():
    assert albedo(1.0, 1.0, 0.0, 10.0, count=100) == pytest.approx(0.969, abs=0.002)


@given(cosines, angles, st.floats(1.0, 1e4))
def test_finite_also_where_the_exponent_is_0_by_0(c, a, n):
    k = direction(c, a)
    mirrored = (-k[0], -k[1], k[2])
    assert np.isfinite(specular(N, U, k, mirrored, n, n))
    assert specular(N, U, k, mirrored, n, n) == pytest.approx(
        (n + 1) / (8 * np.pi) / (c * c), rel=1e-6)


@given(cosines, angles)
def test_nothing_from_behind(c, a):
    k = direction(c, a)
    below = (k[0], k[1], -k[2])
    assert specular(N, U, below, k, 10.0, 10.0) == 0 == specular(N, U, k, below, 10.0, 10.0)
    assert diffuse(1.0, 0.0, -c, c) == 0
    assume(c < 1)
    assert ashikhmin.lighting(N, U, below, k, (1.0,) * 3, (0.5,) * 3, 5.0, 5.0) == (0, 0, 0)


def test_anisotropy_stretches_the_highlight():
    """A sharp n_u and a blunt n_v: the lobe is wide along v, narrow along u."""
    along_u = specular(N, U, direction(0.9, 0.0), N, 400.0, 4.0)
    along_v = specular(N, U, direction(0.9, np.pi / 2), N, 400.0, 4.0)
    assert along_v > 10 * along_u
