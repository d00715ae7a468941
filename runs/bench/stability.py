"""Does anything blow up? A violent flow with every scheme, face, viscosity, cell shape and CFL.

    python -m runs bench stability [key=value ...]     (a few minutes; results/stability.csv)

Each run is 30 steps of a small box: random velocity, a divergence source of 1 or 1000 per unit of
time, a spot at a million times max_temperature, cooling and conduction. It must stay finite, T
within [ambient, spot], and the kinetic energy below that of all air moving at the speed by which
the sources can drive it; or it must be refused with a reason.
"""

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from runs.bench import chart
from solver import scene as scenes
from solver.grid import INNER
from solver.step import Simulation, StepError

RESULTS = Path(__file__).parent / "results"
STEPS = 30
AMBIENT, HOT = 5.0, 1e8
MIXED = {"x_min": "wall", "x_max": "open", "y_min": {"wall": [1.0, 0.0, 0.0]}, "y_max": "slip",
         "z_min": "periodic", "z_max": "periodic"}
SCHEMES = (("euler", "donor", "donor"), ("rk2", "tvd", "tvd"), ("rk3", "tvd", "tvd"),
           ("rk3", "central", "tvd"), ("rk3", "donor", "donor"))
SOURCE = "{rate}*where((x-.4)**2+(y-.5)**2+(z-.5)**2<0.05, 1.0, 0.0)"


def main(argv: list[str]) -> None:
    """Sweep and print how many runs of each scheme and CFL were sound, refused and not sound."""
    RESULTS.mkdir(exist_ok=True)
    rows = [(*key, *trial(*key, argv)) for key in itertools.product(
        SCHEMES, ("open", "wall", "periodic", "mixed"), (0.1, 100.0, np.inf), (1.0, 20.0),
        (1.0, 1e3), (0.1, 0.5, 1.0, 1.5, 2.0, 4.0))]
    flat = [("/".join(row[0]), *row[1:]) for row in rows]
    chart.write_csv(RESULTS / "stability.csv", "scheme,faces,reynolds,aspect,source,cfl,outcome,"
                    "growth", flat, f"python -m runs bench stability {' '.join(argv)}".rstrip())
    for name in dict.fromkeys(row[0] for row in flat):
        for cfl in dict.fromkeys(row[5] for row in flat):
            found = [row[6] for row in flat if row[0] == name and row[5] == cfl]
            print(f"{name:<20} cfl {cfl:<4} " + ", ".join(
                f"{found.count(kind)} {kind}" for kind in dict.fromkeys(found)))


def trial(scheme: tuple[str, str, str], faces: str, reynolds: float, aspect: float, rate: float,
          cfl: float, overrides: list[str]) -> tuple[str, float]:
    """("sound" | "refused" | what is wrong, energy over its bound)."""
    data: dict[str, Any] = {
        "domain": {"cells": [9, 8, 7], "size": [1.0, 1.0, 1.0 / aspect * 0.8],
                   "boundary": MIXED if faces == "mixed" else faces, "expansion": "spread"},
        "time": {"end": 1.0, "frame": 1.0, "cfl": cfl, "integrator": scheme[0]},
        "fluid": {"reynolds": reynolds, "advection": scheme[1], "temperature_advection": scheme[2],
                  "cooling": 5.0, "conductivity": 0.0 if np.isinf(reynolds) else 1 / reynolds,
                  "source": SOURCE.format(rate=rate)},
        "initial": {"noise": 1.0, "T": f"where((x-.5)**2+(y-.5)**2<.05, {HOT}, {AMBIENT})"}}
    for override in overrides:
        scenes.apply_override(data, override)
    try:
        simulation = Simulation(scenes.build(data))
    except scenes.SceneError:
        return "refused", 0.0
    start, peak = simulation.report.energy, 0.0
    volume = float(np.prod(simulation.scene.domain.size))
    # Gas that is made at `rate` leaves through the faces; the lid moves at 1.
    bound = 4 * start + 8 * volume * (1 + rate**2)
    try:
        for _ in range(STEPS):
            simulation.advance(simulation.state.time + 1.0)
            peak = max(peak, simulation.report.energy)
        T = simulation.state.T[INNER]
        outcome = "sound" if peak <= bound else "energy grows"
        if not AMBIENT * (1 - 1e-9) <= float(T.min()) <= float(T.max()) <= HOT * (1 + 1e-9):
            outcome = "T leaves its bounds"
    except StepError:
        outcome = "refused"
    finally:
        simulation.destroy()
    return outcome, peak / bound
