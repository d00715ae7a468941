"""Hot bodies have the colours of the Planckian locus, and glow brighter the hotter they are."""

import numpy as np
import pytest

from render import blackbody
from render.observer import from_library, observer

# CIE 1931 xy of black bodies. 2856 K: CIE standard illuminant A (CIE 15:2004). The others: the
# cubic fit of Kim et al., US patent 7024034 (2006), which stays within 0.001 of the locus.
PUBLISHED = {2000: (0.52690, 0.41326), 2500: (0.47646, 0.41372), 2856: (0.44757, 0.40745),
             3500: (0.40534, 0.39085), 5000: (0.34499, 0.35159), 6500: (0.31349, 0.32366),
             10000: (0.28070, 0.28831)}


def test_chromaticities():
    xyz = blackbody.tristimulus(np.array(list(PUBLISHED), float))
    xy = xyz[:, :2] / xyz.sum(axis=1, keepdims=True)
    assert xy == pytest.approx(np.array(list(PUBLISHED.values())), abs=0.002)


def test_planck_integrates_to_stefan_boltzmann():
    wavelength = np.geomspace(1e-7, 1e-2, 20001)
    for kelvin in (300.0, 1000.0, 5000.0):
        total = np.trapz(blackbody.exitance(wavelength, np.array(kelvin)), wavelength)
        assert total == pytest.approx(5.670374419e-8 * kelvin ** 4, rel=1e-5)


def test_colours_run_from_red_through_orange_to_yellow():
    kelvin = np.arange(300.0, 4750.0, 50.0)
    rgb, luminance = blackbody.glow(kelvin, 3500.0)
    assert np.all(rgb[:, 0] >= rgb[:, 1]) and np.all(rgb[:, 1] >= rgb[:, 2])
    visible = rgb[kelvin >= 950]   # the colours that sRGB can show: less and less red
    assert np.all(np.diff(visible[:, 1] / visible[:, 0]) > 0)
    assert np.all(np.diff(luminance) > 0)
    assert np.all(rgb >= 0) and np.isfinite(rgb).all()


def test_luminance_is_relative_to_the_reference():
    rgb, luminance = blackbody.glow(np.array([2000.0, 3500.0]), 3500.0)
    assert luminance[1] == 1
    assert rgb @ (0.2126729, 0.7151522, 0.0721750) == pytest.approx((1, 1), rel=1e-6)


def test_nothing_breaks_at_absolute_zero():
    rgb, luminance = blackbody.glow(np.array([0.0, 1.0, 30.0]), 3000.0)
    assert np.isfinite(rgb).all() and np.all(luminance >= 0)


def test_the_polynomial_of_the_thesis_is_nearly_white():
    """Its offset hides the temperature: the reason why it is not the default."""
    rgb = blackbody.polynomial(np.array([300.0, 1000.0, 2000.0, 3500.0]), 3500.0)
    assert rgb[0] == pytest.approx((1000 / 1102,) * 3)
    assert rgb[-1, 0] == pytest.approx(1)
    assert rgb.min() > 0.9 and np.all(np.diff(rgb[:, 0]) > 0)


def test_the_table_of_the_observer_is_the_library_s():
    """`python -m render.observer` writes it again, digit by digit."""
    library = from_library()
    wavelength, curves = observer()
    assert np.array_equal(curves, library[:, 1:])
    assert np.array_equal(wavelength, library[:, 0] * 1e-9)
    assert (round(1e9 * wavelength[0]), round(1e9 * wavelength[-1]), len(curves)) == (360, 830, 471)
