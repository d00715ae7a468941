"""Does anything blow up? A violent flow with every scheme, stepper, face, viscosity, cell and CFL.

    python -m runs bench stability [quick] [key=value ...]     (20 minutes; results/stability.csv)

Each run is 120 steps of a small box: random velocity, a divergence source of 1 or 10⁴ per unit of
time (which without a bound on dt would fill the box hundreds of times per step), a spot at 10⁶
times max_temperature, cooling and conduction. It must stay finite; T within [ambient, spot], or
twice that range for schemes without bounds; the kinetic energy below twice that at first and that
of all air moving at the speed by which the sources can drive it; or it must be refused with a
reason. `quick` makes every 23rd run. Runs that were not sound are listed.
"""

import itertools
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from runs.bench import chart
from solver import scene as scenes
from solver.grid import INNER
from solver.scene_physics import LARGEST_CFL
from solver.step import Simulation, StepError

RESULTS = Path(__file__).parent / "results"
STEPS, STRIDE = 120, 23
AMBIENT, HOT = 5.0, 1e8
MIXED = {"x_min": "wall", "x_max": "open", "y_min": {"wall": [1.0, 0.0, 0.0]}, "y_max": "slip",
         "z_min": "periodic", "z_max": "periodic"}
FACES = {"open": "open", "wall": "wall", "slip": "slip", "periodic": "periodic", "mixed": MIXED,
         "mixed 2-D": MIXED}
INTEGRATORS = tuple(dict.fromkeys(integrator for integrator, _ in LARGEST_CFL))
SCHEMES = tuple(dict.fromkeys(scheme for _, scheme in LARGEST_CFL))
BOUNDED = ("donor", "tvd")
PAIRS = [(s, s) for s in SCHEMES] + [(s, "tvd") for s in SCHEMES if s not in BOUNDED]
REYNOLDS = (0.1, 100.0, np.inf)
ASPECTS = (1.0, 20.0)
RATES = (1.0, 1e4)
CFL = (0.1, "largest", "beyond")
SOURCE = "{rate}*where((x-.4)**2+(y-.5)**2+(z-.5*{depth})**2<0.05, 1.0, 0.0)"
Case = tuple[str, tuple[str, str], str, float, float, float, Any]


def main(argv: list[str]) -> None:
    """Sweep and print how many runs of each scheme and CFL were sound, refused and not sound."""
    overrides = [a for a in argv if "=" in a]
    cases = list(itertools.product(INTEGRATORS, PAIRS, FACES, REYNOLDS, ASPECTS, RATES, CFL))
    if "quick" in argv:
        cases = cases[::STRIDE]
    start, counts, worst = time.perf_counter(), Counter[Any](), dict[Any, float]()
    for case in cases:
        outcome, energy = trial(*case, overrides)
        key = (f"{case[0]}/{case[1][0]}/{case[1][1]}", case[6])
        kind = outcome if outcome in ("sound", "refused") else "unsound"
        counts[*key, kind] += 1
        worst[key] = max(worst.get(key, 0.0), energy if np.isfinite(energy) else np.inf)
        if kind == "unsound":
            print(f"{outcome}: {' '.join(map(str, case))}, energy {energy:.3g} of its bound",
                  flush=True)
    rows = [(*key, *(counts[*key, kind] for kind in ("sound", "refused", "unsound")), energy)
            for key, energy in worst.items()]
    RESULTS.mkdir(exist_ok=True)
    chart.write_csv(RESULTS / "stability.csv", "integrator/velocity/temperature,cfl,sound,refused,"
                    "unsound,largest energy over its bound", rows,
                    f"python -m runs bench stability {' '.join(argv)}".rstrip())
    for row in rows:
        print(f"{row[0]:<24} cfl {row[1]!s:<8} {row[2]:4d} sound {row[3]:4d} refused {row[4]:4d} "
              f"unsound, energy up to {row[5]:.2g} of its bound")
    print(f"{len(cases)} runs in {time.perf_counter() - start:.0f} s")


def trial(integrator: str, schemes: tuple[str, str], faces: str, reynolds: float, aspect: float,
          rate: float, cfl: Any, overrides: list[str]) -> tuple[str, float]:
    """("sound" | "refused" | what is wrong, energy over its bound)."""
    largest = min(LARGEST_CFL[integrator, scheme] for scheme in schemes)
    depth = 0.8 / aspect
    data: dict[str, Any] = {
        "domain": {"cells": [9, 8, 1 if faces.endswith("2-D") else 7], "size": [1.0, 1.0, depth],
                   "boundary": FACES[faces], "expansion": "spread"},
        "time": {"end": 1.0, "frame": 1.0, "integrator": integrator,
                 "cfl": {"largest": largest, "beyond": 1.1 * largest}.get(cfl, cfl)},
        "fluid": {"reynolds": reynolds, "advection": schemes[0],
                  "temperature_advection": schemes[1], "cooling": 5.0,
                  "conductivity": 0.0 if np.isinf(reynolds) else 1 / reynolds,
                  "source": SOURCE.format(rate=rate, depth=depth)},
        "initial": {"noise": 1.0, "T": f"where((x-.5)**2+(y-.5)**2<.05, {HOT}, {AMBIENT})"}}
    for override in overrides:
        scenes.apply_override(data, override)
    try:
        simulation = Simulation(scenes.build(data))
    except scenes.SceneError:
        return "refused", 0.0
    try:
        return follow(simulation, rate, schemes[1] in BOUNDED)
    finally:
        simulation.destroy()


def follow(simulation: Simulation, rate: float, bounded: bool) -> tuple[str, float]:
    """Make the steps and judge them."""
    start = peak = simulation.report.energy
    volume = float(np.prod(simulation.scene.domain.size))
    # Gas that is made at `rate` leaves through the faces; the lid moves at 1.
    bound = 2 * start + volume * (0.5 + rate**2)
    margin = 1e-9 if bounded else 1.0
    for _ in range(STEPS):
        try:
            simulation.advance(simulation.state.time + 1.0)
        except StepError as error:
            return ("refused" if "collapsed" in str(error) else "not finite"), peak / bound
        peak = max(peak, simulation.report.energy)
        T = simulation.state.T[INNER]
        low, high = float(T.min()), float(T.max())
        if not -margin * HOT <= low - AMBIENT <= high - AMBIENT <= (1 + margin) * HOT:
            return f"T in {low:.3g} … {high:.3g}", peak / bound
        if not peak <= bound:
            return "energy grows", peak / bound
    return "sound", peak / bound
