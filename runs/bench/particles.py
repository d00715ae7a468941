"""`python -m runs bench particles`: particle-steps per second, bodies per step, error against time.

Alone or as `mpirun -n N python -m runs bench particles` (then the cost of the exchange shows). The
particles of a closed box with a vortex move, heat up, burn and deposit for 100 steps of a real run
before they are timed, so that they stand in memory as they do in a run; sorting is counted. The
yardstick is a bare loop that only reads one field at the same points, by trilinear interpolation,
in the same order. Options: particles=1000000 cells=64 steps=64 out=out/bench.
"""

import csv
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from partition.build import build as build_fragments
from runs.exact import bodies as exact_bodies, particles as exact_particles
from solver import scene as scenes
from solver.step import Simulation

OPTIONS: dict[str, Any] = {"particles": 1_000_000, "cells": 64, "steps": 64, "out": "out/bench"}
WARM_STEPS, END = 100, 1e3
STAGES = ("burn", "particles", "emit")
VORTEX = {"u": "sin(2*pi*x)*cos(2*pi*y)", "v": "-cos(2*pi*x)*sin(2*pi*y)",
          "w": "0.5*sin(2*pi*z)*cos(2*pi*x)"}
Row = tuple[str, float, str]


def main(argv: list[str]) -> int:
    """Measure, print, and write particles_N_ranks.csv, errors.csv and particles.png into `out`."""
    options = dict(OPTIONS)
    for argument in argv:
        key, _, value = argument.partition("=")
        if key not in options:
            print(f"bench particles: {argument}: unknown; fix: one of "
                  + " ".join(f"{k}={v}" for k, v in OPTIONS.items()))
            return 2
        options[key] = type(options[key])(value)
    rows, rank, ranks = particle_speed(options["particles"], options["cells"], options["steps"])
    if ranks == 1:   # the rest knows no ranks
        rows += [*body_speed(), *exact_rows()]
    if rank > 0:
        return 0
    out = Path(options["out"])
    out.mkdir(parents=True, exist_ok=True)
    write_csv(out / f"particles_{ranks}_ranks.csv", ("quantity", "value", "unit"), rows)
    for name, found, unit in rows:
        print(f"{name:<58} {found:12.5g} {unit}")
    if ranks == 1:
        errors = [*errors_against_time("tracer in a vortex", exact_particles.tracer_error,
                                       (25, 50, 100, 200, 400, 800, 1600, 3200)),
                  *errors_against_time("symmetric top", exact_bodies.top_error,
                                       (25, 50, 100, 200, 400, 800, 1600, 3200))]
        write_csv(out / "errors.csv", ("case", "steps", "error", "seconds"), errors)
        plot(out / "particles.png", errors)
    print(f"written to {out}")
    return 0


def particle_speed(number: int, cells: int, steps: int) -> tuple[list[Row], int, int]:
    """Timings of the particle stages, this rank and the number of ranks (all must call)."""
    simulation = Simulation(burning_box(number, cells))
    state, comm = simulation.state, simulation.state.grid.comm
    exchange = Stopwatch(state.swarm.exchange)
    state.swarm.exchange = exchange
    for _ in range(WARM_STEPS):
        simulation.advance(END)
    exchange.seconds = 0.0
    spent = []
    for _ in range(steps):
        comm.Barrier()
        before = sum(simulation.seconds[stage] for stage in STAGES)
        simulation.advance(END)
        spent.append(sum(simulation.seconds[stage] for stage in STAGES) - before)
    count = comm.allreduce(len(state.swarm.points))
    per_step = comm.allreduce(float(np.mean(spent)), op=max)
    typical = comm.allreduce(statistics.median(spent), op=max)
    exchanging = comm.allreduce(exchange.seconds, op=max) / steps
    rows: list[Row] = [
        ("ranks", comm.size, ""), ("particles", count, ""),
        ("particle step, mean with sorting", 1e3 * per_step, "ms"),
        ("particle step, median", 1e3 * typical, "ms"),
        ("particle-steps, mean with sorting", count / per_step / 1e6, "10⁶/s"),
        ("particle-steps, median", count / typical / 1e6, "10⁶/s"),
        ("exchange, share of the particle step", exchanging / per_step, "")]
    alone = processor_seconds(simulation, steps)
    rows.append(("particle-steps per second of processor",
                 count / comm.size / comm.allreduce(alone, op=max) / 1e6, "10⁶/s"))
    bare = bare_gather(state.swarm.points["position"], state.T, cells)
    rows.append(("bare trilinear read of one field", len(state.swarm.points) / bare / 1e6, "10⁶/s"))
    rows.append(("particle step / bare read", typical / bare, ""))
    rank, ranks = comm.rank, comm.size
    simulation.destroy()
    return rows, rank, ranks


def processor_seconds(simulation: Simulation, steps: int) -> float:
    """Processor time of one particle step, in the flow as it is now, with its share of sorting;
    other work on the machine does not count in it as it does in the seconds of the clock."""
    state = simulation.state
    burn, particles = (simulation.stages[name][1] for name in ("burn", "particles"))
    start = time.process_time()
    for _ in range(steps):
        burn.prepare(state)
        burn(state, state.dt)
        particles(state, state.dt)
    return (time.process_time() - start) / steps


class Stopwatch:
    """A function that adds up how long it takes."""

    def __init__(self, function: Callable[[], None]):
        self.function, self.seconds = function, 0.0

    def __call__(self) -> None:
        start = time.perf_counter()
        self.function()
        self.seconds += time.perf_counter() - start


def burning_box(number: int, cells: int) -> scenes.Scene:
    """A closed box with a vortex in which all particles burn, faintly."""
    return scenes.build({
        "domain": {"cells": [cells] * 3, "boundary": "wall", "expansion": "spread"},
        "time": {"end": END, "frame": END, "dt_max": 5e-3},
        "initial": VORTEX,
        "detonation": {"position": (0.5, 0.5, 0.5), "radius": 0.5, "fill": "ball"},
        "fuel": {"particles": number, "ignited": number, "cap": number, "mass": 1.0 / number,
                 "burn_rate": 0.1 / number, "gas": 0.1, "heat": 1.0, "min_mass": 0.0}})


def bare_gather(position: np.ndarray, field: np.ndarray, cells: int) -> float:
    """Seconds that reading one field at these points takes, best of five."""
    x, y, z = (np.ascontiguousarray(position[:, a]) * cells + 1.5 for a in range(3))
    found = np.empty(len(x))
    return min(timed(lambda: gather(field, x, y, z, found)) for _ in range(6))


@njit(error_model="numpy")
def gather(f, x, y, z, found):  # type: ignore[no-untyped-def]
    """The yardstick: nothing but eight values and seven weights per point."""
    for n in range(len(x)):
        i, j, k = int(x[n]), int(y[n]), int(z[n])
        a, b, c = x[n] - i, y[n] - j, z[n] - k
        found[n] = ((1 - c) * ((1 - b) * ((1 - a) * f[k, j, i] + a * f[k, j, i + 1])
                               + b * ((1 - a) * f[k, j + 1, i] + a * f[k, j + 1, i + 1]))
                    + c * ((1 - b) * ((1 - a) * f[k + 1, j, i] + a * f[k + 1, j, i + 1])
                           + b * ((1 - a) * f[k + 1, j + 1, i] + a * f[k + 1, j + 1, i + 1])))


def timed(job: Callable[[], Any]) -> float:
    """Seconds that it takes."""
    start = time.perf_counter()
    job()
    return time.perf_counter() - start


def body_speed() -> list[Row]:
    """512 pieces of a pane at 32³, and one body of a million vertices."""
    rows: list[Row] = []
    pane = {"name": "pane", "shape": "pane", "size": (0.6, 0.5, 0.01), "points": 2000,
            "areal_density": 20.0, "fracture": {"pieces": 512}}
    ball = {"name": "ball", "shape": "sphere", "radius": 0.3, "detail": 8, "density": 1.0}
    for body in (pane, ball):
        scene = scenes.build({"time": {"end": 1.0, "frame": 1.0}, "initial": VORTEX,
                              "domain": {"boundary": "wall"}, "body": [body]})
        simulation = Simulation(scene, fragments=build_fragments(scene))
        bodies, state = simulation.stages["bodies"][1], simulation.state
        best = min(timed(lambda: bodies(state, 1e-3)) for _ in range(20))
        name = f"{len(bodies.mass)} bodies, {len(bodies.weight)} vertices"
        rows.append((name, 1e3 * best, "ms per step"))
        simulation.destroy()
    return rows


def exact_rows() -> list[Row]:
    """The closed-form cases: the error of each."""
    return [(check.name, check.error, f"error (at most {check.tolerance:g})")
            for check in (*exact_particles.checks(), *exact_bodies.checks())]


def errors_against_time(name: str, error: Callable[[int], float],
                        ladder: tuple[int, ...]) -> list[tuple[str, int, float, float]]:
    """(case, steps, error, seconds of processor, the best of three) for each number of steps."""
    rows = []
    for steps in ladder:
        seconds = []
        for _ in range(3):
            start = time.process_time()
            found = error(steps)
            seconds.append(time.process_time() - start)
        rows.append((name, steps, found, min(seconds)))
    return rows


def write_csv(path: Path, heading: tuple[str, ...], rows: list[Any]) -> None:
    """A table with one line of headings."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(heading)
        writer.writerows(rows)


def plot(path: Path, rows: list[tuple[str, int, float, float]]) -> None:
    """Error against steps and against seconds, with the slope of second order."""
    from matplotlib.figure import Figure
    figure = Figure(figsize=(9, 4), layout="constrained")
    by_steps, by_time = figure.subplots(1, 2, sharey=True)
    for name in dict.fromkeys(row[0] for row in rows):
        steps, error, seconds = zip(*(row[1:] for row in rows if row[0] == name), strict=True)
        by_steps.loglog(steps, error, "o-", label=name)
        by_time.loglog(seconds, error, "o-", label=name)
        by_steps.loglog(steps, error[0] * (steps[0] / np.array(steps))**2, "k:", lw=1)
    by_steps.set(xlabel="steps (dotted: second order)", ylabel="error")
    by_time.set(xlabel="seconds of processor, set-up included")
    by_steps.legend()
    figure.savefig(path, dpi=120)
