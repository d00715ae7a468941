"""Does anything blow up? A violent flow with every scheme, stepper, face, viscosity, cell and CFL.

    mpirun -n 2 python -m runs bench stability [quick] [seconds=N] [axis=value …]   (3 minutes)

Every combination of the values of `AXES` (every 23rd with `quick`; those with one value of an axis
with axis=value; as many as fit, drawn at random, with seconds=N) is a run of 120 steps of a small
box, one rank each: random velocity as fine as the grid, a spot at 10⁶ times max_temperature,
cooling, conduction, and a source of divergence in a ball (10⁴ fills the box 500 times per unit of
time, and does so from one step to the next). A run is sound where, after every step,

    all is finite
    T is within [ambient, spot], or twice that range for schemes without bounds
    kinetic energy ≤ 1.1 of that at first + ½ |lid|² V, without a source
                   ≤ 2 of that at first + ½ |lid|² V + rate² V, with one: its gas moves at `rate`

else it is refused with a reason, or not sound. Writes results/stability.csv and prints it as a
table, and the runs that were not sound.
"""

import itertools
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

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
FACES: dict[str, Any] = {"open": "open", "wall": "wall", "slip": "slip", "periodic": "periodic",
                         "mixed": MIXED, "mixed 2-D": MIXED}
SCHEMES = tuple(dict.fromkeys(scheme for _, scheme in LARGEST_CFL))
BOUNDED = ("donor", "tvd")
BALL = "where((x-.4)**2+(y-.5)**2+(z-.5*{depth})**2<0.05, 1.0, 0.0)"
SOURCES = {"none": (0.0, ""), "1": (1.0, BALL),
           "10⁴, sudden": (1e4, f"1e4*where(t>0.001, 1.0, 0.0)*{BALL}")}


class Case(NamedTuple):
    """One run: an entry of every axis of the sweep."""

    integrator: str
    velocity: str
    temperature: str
    faces: str
    reynolds: float
    aspect: float
    source: str
    cfl: str


AXES: dict[str, tuple[Any, ...]] = {
    "integrator": tuple(dict.fromkeys(integrator for integrator, _ in LARGEST_CFL)),
    "velocity": SCHEMES, "temperature": SCHEMES, "faces": tuple(FACES),
    "reynolds": (0.1, 100.0, np.inf), "aspect": (1.0, 20.0), "source": tuple(SOURCES),
    "cfl": ("0.1", "largest", "beyond")}
KINDS = ("sound", "refused", "unsound")


def main(argv: list[str]) -> None:
    """Sweep and print how many runs were sound, refused and not sound, by axis."""
    cases, comm = selected(argv), MPI.COMM_WORLD
    start, found = time.perf_counter(), []
    longest = float(wanted(argv).get("seconds", np.inf))
    for case in cases[comm.rank::comm.size]:
        if time.perf_counter() - start > longest:
            break
        outcome, energy = trial(case)
        found.append((case, outcome, energy))
        if outcome not in KINDS:
            print(f"{outcome}: {' '.join(map(str, case))}, energy {energy:.3g} of its bound",
                  flush=True)
    every = [result for part in comm.allgather(found) for result in part]
    if comm.rank == 0:
        report(every, f"python -m runs bench stability {' '.join(argv)}".rstrip())
        print(f"{len(every)} of {len(cases)} runs in {time.perf_counter() - start:.0f} s")


def wanted(argv: list[str]) -> dict[str, str]:
    """What is given as key=value."""
    return dict(argument.split("=", 1) for argument in argv if "=" in argument)


def selected(argv: list[str]) -> list[Case]:
    """The combinations that are asked for, those of one kind far apart. Velocity and temperature
    have the same scheme, or the temperature has the default one."""
    asked = {axis: value for axis, value in wanted(argv).items() if axis != "seconds"}
    for axis, value in asked.items():
        if value not in map(str, AXES.get(axis, ())):
            raise SystemExit(f"bench stability {axis}={value}: fix: one of "
                             + "; ".join(f"{a}={'|'.join(map(str, v))}" for a, v in AXES.items()))
    cases = [case for case in itertools.starmap(Case, itertools.product(*AXES.values()))
             if case.temperature in (case.velocity, "tvd")
             and all(str(getattr(case, axis)) == value for axis, value in asked.items())]
    order = np.random.default_rng(1).permutation(len(cases))
    return [cases[n] for n in (order[::STRIDE] if "quick" in argv else order)]


def report(found: Iterable[tuple[Case, str, float]], command: str) -> None:
    """Write and print the counts by axis, with the largest energy of a run over its bound."""
    counts, worst = Counter[Any](), dict[Any, float]()
    for case, outcome, energy in found:
        kind = outcome if outcome in KINDS else "unsound"
        for key in (("all", ""), *zip(Case._fields, case, strict=True)):
            counts[*key, kind] += 1
            worst[key] = max(worst.get(key, 0.0), energy if np.isfinite(energy) else np.inf)
    order = [("all", ""), *((axis, value) for axis, values in AXES.items() for value in values)]
    rows = [(*key, *(counts[*key, kind] for kind in KINDS), worst[key])
            for key in order if key in worst]
    RESULTS.mkdir(exist_ok=True)
    chart.write_csv(RESULTS / "stability.csv", f"axis,value,{','.join(KINDS)},"
                    "largest energy over its bound", rows, command)
    print("| | | sound | refused | not sound | energy, of its bound |\n|---|---|---|---|---|---|")
    for axis, value, *numbers, energy in rows:
        print(f"| {axis} | {value} | {' | '.join(map(str, numbers))} | {energy:.2g} |")


def trial(case: Case) -> tuple[str, float]:
    """("sound" | "refused" | what is wrong, energy over its bound)."""
    try:
        simulation = Simulation(scene_of(case), MPI.COMM_SELF)
    except scenes.SceneError:
        return "refused", 0.0
    try:
        return follow(simulation, SOURCES[case.source][0], case.temperature in BOUNDED)
    finally:
        simulation.destroy()


def scene_of(case: Case) -> scenes.Scene:
    """The box of a case; `SceneError` where it is refused."""
    largest = min(LARGEST_CFL[case.integrator, s] for s in (case.velocity, case.temperature))
    depth = 0.8 / case.aspect
    return scenes.build({
        "domain": {"cells": [9, 8, 1 if case.faces.endswith("2-D") else 7],
                   "size": [1.0, 1.0, depth], "boundary": FACES[case.faces],
                   "expansion": "spread"},
        "time": {"end": 1.0, "frame": 1.0, "integrator": case.integrator,
                 "cfl": {"0.1": 0.1, "largest": largest, "beyond": 1.1 * largest}[case.cfl]},
        "fluid": {"reynolds": case.reynolds, "advection": case.velocity,
                  "temperature_advection": case.temperature, "cooling": 5.0,
                  "conductivity": 0.0 if np.isinf(case.reynolds) else 1 / case.reynolds,
                  "source": SOURCES[case.source][1].format(depth=depth)},
        "initial": {"noise": 1.0, "T": f"where((x-.5)**2+(y-.5)**2<.05, {HOT}, {AMBIENT})"}})


def follow(simulation: Simulation, rate: float, bounded: bool) -> tuple[str, float]:
    """Make the steps and judge them."""
    start = peak = simulation.report.energy
    volume = float(np.prod(simulation.scene.domain.size))
    lid = simulation.wall_rate > 0
    bound = (2 if rate else 1.1) * start + volume * (0.5 * lid + rate**2)
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
