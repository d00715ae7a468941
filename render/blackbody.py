"""Which colour does something hot glow in? Planck's law through the CIE 1931 observer.

    M(lambda, T) = 2 pi h c² / (lambda^5 (exp(h c / (lambda k T)) - 1))      W m^-3
    (X, Y, Z)    = integral of M (xbar, ybar, zbar) over 360 to 830 nm
and from XYZ by the matrix of sRGB to linear RGB; colours outside its gamut (below about 1900 K) are
clipped at 0. Luminance is Planck's, relative to that at a reference temperature.

The thesis adjusts P to 2 P² + 100 P + 1000 and gives no units. `polynomial` takes P at a red, a
green and a blue wavelength as a share of the red one at the reference; the offset of 1000 then
leaves almost nothing but white, which is why this is not the default.
"""

import numpy as np
from numpy.typing import NDArray

from render.observer import observer

Array = NDArray[np.float64]

PLANCK, LIGHT_SPEED, BOLTZMANN = 6.62607015e-34, 299792458.0, 1.380649e-23   # exact SI values
SRGB = np.array([[3.2404542, -1.5371385, -0.4985314],
                 [-0.9692660, 1.8760108, 0.0415560],
                 [0.0556434, -0.2040259, 1.0572252]])


def exitance(wavelength: Array | float, kelvin: Array) -> Array:
    """Planck's spectral exitance, W m^-3, of wavelengths (m) and temperatures that broadcast."""
    with np.errstate(over="ignore", divide="ignore"):
        exponent = PLANCK * LIGHT_SPEED / (wavelength * BOLTZMANN * kelvin)
        return 2 * np.pi * PLANCK * LIGHT_SPEED ** 2 / (wavelength ** 5 * np.expm1(exponent))


def tristimulus(kelvin: Array) -> Array:
    """(n, 3) X, Y, Z of black bodies at n temperatures, in W m^-2 weighted by the observer."""
    wavelength, curves = observer()
    spectra = exitance(wavelength, np.asarray(kelvin, np.float64)[:, None])
    return np.asarray(np.trapz(spectra[:, :, None] * curves, wavelength, axis=1))


def glow(kelvin: Array, reference: float) -> tuple[Array, Array]:
    """(linear RGB (n, 3) of luminance 1, luminance (n,) relative to that at `reference` kelvin)."""
    xyz = tristimulus(np.append(np.maximum(kelvin, 1.0), reference))
    luminance = xyz[:, 1]
    # Below some 100 K nothing is left of the visible spectrum: such a body is the deepest red
    scale = np.where(luminance > 0, luminance, 1.0)[:, None]
    rgb = np.clip((xyz / scale) @ SRGB.T, 0, None)
    bright = rgb @ np.array((0.2126729, 0.7151522, 0.0721750))
    rgb = np.where(bright[:, None] > 0, rgb / np.maximum(bright, 1e-300)[:, None], (4.7, 0, 0))
    return rgb[:-1], luminance[:-1] / luminance[-1]


def polynomial(kelvin: Array, reference: float) -> Array:
    """(n, 3) the thesis' 2 P² + 100 P + 1000 of P at 610, 550, 465 nm, as a share of its most."""
    wavelength = np.array((610e-9, 550e-9, 465e-9))
    most = exitance(wavelength[0], np.array(reference))
    p = exitance(wavelength, np.maximum(kelvin, 1.0)[:, None]) / most
    return (2 * p ** 2 + 100 * p + 1000) / 1102.0
