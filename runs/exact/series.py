"""How does the 3-D Taylor-Green vortex begin? Its power series in time, from Navier and Stokes.

    python -m runs.exact.series          writes runs/exact/taylor_green_3d.answer.toml

With u = Σ u_n tⁿ, p = Σ p_n tⁿ in a periodic box the equations give one power after the other,

    (n + 1) u_{n+1} = -Σ_{a+b=n} (u_a·∇) u_b - ∇p_n + ∇²u_n / Re,   ∇·u_{n+1} = 0,

and every u_n is a finite sum of waves: with 32³ Fourier modes nothing is lost (Taylor & Green,
Proc. R. Soc. A 158 (1937) 499). By its symmetries u is made of sin(ax) cos(by) cos(cz), v, w alike
and p of cos(ax) cos(by) cos(cz).
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver import scene as scenes

SCENE = Path(__file__).parent / "taylor_green_3d.toml"
POWERS, MODES, LEAST = 11, 32, 1e-7   # LEAST: of a term at the end of the scene
Array = NDArray[Any]
WAVES = np.fft.fftfreq(MODES, 1 / MODES)
K = np.meshgrid(WAVES, WAVES, WAVES, indexing="ij")
K2: Array = np.sum(np.square(K), axis=0)
K2[0, 0, 0] = 1.0


def main() -> None:
    """Write the answer of the scene."""
    scene = scenes.load(SCENE)
    velocity, pressure = series(scene.fluid.reynolds)
    fields = {name: [power[axis] for power in velocity] for axis, name in enumerate("uvw")}
    shown = {name: formula(powers, "uvw".find(name), scene.time.end)
             for name, powers in {**fields, "p": pressure}.items()}
    lines = [f"# python -m runs.exact.series: up to t^{POWERS}; what is left out is below 1e-6.",
             "order = 1.9", "ladder = [16, 32, 64]"]
    for name, waves in shown.items():
        lines += [f"{name} = [", *(f'    "{wave}",' for wave in waves), "]"]
    SCENE.with_suffix(".answer.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def series(reynolds: float) -> tuple[list[list[Array]], list[Array]]:
    """Fourier coefficients of u, v, w and of p for each power of t."""
    x = 2 * np.pi * np.arange(MODES) / MODES
    X, Y, Z = np.meshgrid(x, x, x, indexing="ij")
    start = np.sin(X) * np.cos(Y) * np.cos(Z), -np.cos(X) * np.sin(Y) * np.cos(Z), 0 * X
    velocity: list[list[Array]] = [[np.fft.fftn(q) / MODES**3 for q in start]]
    pressure: list[Array] = []
    for n in range(POWERS + 1):
        push = [-sum(advection(velocity[a], velocity[n - a][axis]) for a in range(n + 1))
                for axis in range(3)]
        p: Array = np.sum([-1j * k * f for k, f in zip(K, push, strict=True)], axis=0) / K2
        pressure.append(p)
        velocity.append([(f - 1j * k * p - K2 * q / reynolds) / (n + 1) for f, k, q in
                         zip(push, K, velocity[n], strict=True)])
    return velocity[:-1], pressure


def advection(carrier: list[Array], q: Array) -> Array:
    """(u·∇)q of Fourier coefficients."""
    total = sum(np.fft.ifftn(c).real * np.fft.ifftn(1j * k * q).real
                for c, k in zip(carrier, K, strict=True))
    found: Array = np.fft.fftn(total) * MODES**3
    return found


def formula(powers: list[Array], axis: int, end: float) -> list[str]:
    """The waves, with powers of t, as text; the sine is along `axis` (-1: all cosines)."""
    waves: dict[tuple[int, ...], str] = {}
    for n, values in enumerate(powers):
        for wave in zip(*np.nonzero(np.abs(values) * end**n > LEAST), strict=True):
            if max(wave) < MODES // 2:
                value = values[wave].real if axis < 0 else -values[wave].imag
                factor = 2.0 ** sum(k > 0 for k in wave)
                waves[wave] = (waves.get(wave, "") + f"{factor * value:+.10g}"
                               + f"*t**{n}" * (n > 0))
    return [f"({parts})" + "".join(f"*{'sin' if a == axis else 'cos'}({k}*{letter})" for
                                   a, (k, letter) in enumerate(zip(wave, "xyz", strict=True)) if k)
            for wave, parts in sorted(waves.items())]


if __name__ == "__main__":
    main()
