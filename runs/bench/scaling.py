"""Ranks against one: strong and weak scaling, and what the exchanged bytes say about many ranks.

    python -m runs bench scaling [cells]     (default 128; runs mpirun with 2 ranks)

Strong: the same box on 2 ranks; weak: a box twice as deep; apart: a box half as deep on each of
them, with nothing to tell each other, which is what the machine allows (two cores share its memory,
often its clock, and where they are two threads of one core its arithmetic). Each of three mpiruns
makes the steps in turn: on rank 0 alone, while rank 1 sleeps, and on both, so that a machine that
slows down slows both; the median of the ratios of neighbours in time counts, and beside it the
fastest of one against the fastest of the other. Stages are those of `bench speed`. Writes
results/scaling.csv.

The model, of a closed box: per substep a rank exchanges GHOSTS layers of u, v, w and T and one of p
with its neighbours, passes on one of faces, and in the solve the two planes that join lines, there
and back (one, once, where two parts meet); where two axes are split, its whole block besides, there
and back, part of which stays at home. It counts bytes and messages; the time is that of a network,
the arithmetic that of the rank measured here. Writes results/scaling_model.csv and .png.
"""

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from runs.bench import chart, speed
from runs.bench.clock import solve_job
from runs.ranks import environment, mpirun
from solver.grid import process_grid
from solver.kernel import GHOSTS
from solver.pressure import PressureSolver

RESULTS = Path(__file__).parent / "results"
LAUNCHES, REPEATS = 3, 8   # where a process lies in memory matters as much as the moment
NAP = 5e-4   # s between two looks of a rank that has nothing to do
BANDWIDTHS = (1e9, 3e9, 10e9)   # bytes per second and rank: a shared, a common, a good network
LATENCY = 2e-6                  # s per message
RANKS = (1, 2, 8, 64, 512, 4096)
Box = tuple[int, int, int]


def main(argv: list[str]) -> None:
    """Measure, print and store both tables; with `worker` this is one of the ranks."""
    if argv[:1] == ["worker"]:
        worker(int(argv[1]))
        return
    RESULTS.mkdir(exist_ok=True)
    n = int(argv[0]) if argv else 128
    rate = measured(n)
    rows = []
    print(f"model of 1024³ cells at {rate / 1e6:.1f} million cell-substeps per second and rank")
    for ranks in RANKS:
        load = Load.of((1024,) * 3, ranks)
        rows.append((ranks, f"1x{load.rows}x{load.layers}", load.bytes / 1e6, load.messages,
                     load.cells / rate, *(load.efficiency(rate, b) for b in BANDWIDTHS)))
        print(f"  {ranks:5d} ranks  {rows[-1][2]:8.1f} MB, {load.messages:4d} messages per substep "
              "and rank; efficiency " + ", ".join(
                  f"{e:.2f} at {b / 1e9:g} GB/s" for e, b in
                  zip(rows[-1][5:], BANDWIDTHS, strict=True)))
    command = f"python -m runs bench scaling {n}"
    chart.write_csv(RESULTS / "scaling_model.csv", "ranks,process grid,MB per substep and rank,"
                    "messages,seconds of arithmetic," + ",".join(
                        f"efficiency at {b / 1e9:g} GB/s" for b in BANDWIDTHS), rows, command)
    chart.lines(RESULTS / "scaling_model.png",
                [(f"{b / 1e9:g} GB/s per rank", RANKS, [row[5 + i] for row in rows], "o-")
                 for i, b in enumerate(BANDWIDTHS)], "ranks",
                "share of a substep that is arithmetic",
                f"1024³ cells, model: {command}", x_scale="log")


def measured(n: int) -> float:
    """The measured table; returns cell-substeps per second of one rank."""
    found: dict[str, dict[str, list[float]]] = {}
    for _ in range(LAUNCHES):
        done = subprocess.run(
            [*mpirun(2), sys.executable, "-c", "import sys; from runs.bench import scaling; "
             "scaling.main(sys.argv[1:])", "worker", str(n)],
            env=environment(), capture_output=True, text=True, check=True, timeout=600)
        for kind, stages in json.loads(done.stdout.splitlines()[-1]).items():
            for what, seconds in stages.items():
                found.setdefault(kind, {}).setdefault(what, []).extend(seconds)
    rows = []
    for kind, work in (("apart", 1), ("strong", 1), ("weak", 2)):
        for what, seconds in found[kind].items():
            alone = [work * t for t in found["one"][what]]
            gain = statistics.median(a / b for a, b in zip(alone, seconds, strict=True))
            best = min(alone) / min(seconds)
            rows.append((kind, what, statistics.median(alone), statistics.median(seconds), gain,
                         best))
            print(f"{kind:<7} {what:<12} 1 rank {rows[-1][2]:.4f} s, 2 ranks {rows[-1][3]:.4f} s: "
                  f"{gain:.2f} times faster, the fastest {best:.2f}", flush=True)
    chart.write_csv(RESULTS / "scaling.csv", "kind,what,seconds on 1 rank,seconds on 2 ranks,"
                    "times faster,fastest against fastest", rows,
                    f"python -m runs bench scaling {n}")
    return n**3 * 3 / statistics.median(found["one"]["step"])


def worker(n: int) -> None:
    """Measure on two ranks; rank 0 prints the seconds of a step, a solve and each stage per
    repeat, for each kind of run: those of the slower rank."""
    world = MPI.COMM_WORLD
    single = world.Split(world.rank)
    kinds = {"one": (single, n), "apart": (single, n // 2), "strong": (world, n),
             "weak": (world, 2 * n)}
    here = {kind: speed.make([n, n, depth], [], comm) for kind, (comm, depth) in kinds.items()
            if kind != "one" or world.rank == 0}
    found: dict[str, dict[str, list[float]]] = {kind: {} for kind in kinds}
    solvers = {kind: PressureSolver(simulation.state.grid) for kind, simulation in here.items()}
    solves = {kind: solve_job(solver) for kind, solver in solvers.items()}
    for _ in range(REPEATS):
        for kind, seconds in found.items():
            if kind in here:
                simulation = here[kind]
                simulation.seconds = dict.fromkeys(simulation.seconds, 0.0)
                taken = {"step": clock(lambda: simulation.advance(1e3)), **simulation.seconds,
                         "solve": clock(solves[kind])}
                both = single if kind == "one" else world
                for what, t in taken.items():
                    seconds.setdefault(what, []).append(both.allreduce(t, MPI.MAX))
            sleep_until_all(world)
    if world.rank == 0:
        print(json.dumps(found))
    for kind, simulation in here.items():
        solvers[kind].destroy()
        simulation.destroy()
    single.Free()


def clock(job: Callable[[], Any]) -> float:
    """Seconds that a job takes."""
    start = time.perf_counter()
    job()
    return time.perf_counter() - start


def sleep_until_all(world: MPI.Comm) -> None:
    """A barrier that leaves the core free."""
    request = world.Ibarrier()
    while not request.Test():
        time.sleep(NAP)


@dataclass(frozen=True)
class Load:
    """What one rank of rows × layers does in a substep: cells to work on, bytes and messages to
    send."""

    rows: int
    layers: int
    cells: float
    bytes: float
    messages: int

    @classmethod
    def of(cls, box: Box, ranks: int) -> "Load":
        """Counted from the exchanges of `grid`, `boundary`, `project`, `poisson` and `interfaces`
        (but for the one line of λ = 0)."""
        nx, ny, nz = box
        _, rows, layers = process_grid(box, ranks)
        block = nx * ny * nz / ranks
        faces = (rows > 1) * nx * nz / layers + (layers > 1) * nx * ny / rows
        # Both ways: u, v, w and T in GHOSTS layers, p in one; one way: the low faces.
        layers_sent = 2 * (4 * GHOSTS + 1) + 1
        parts = layers if layers > 1 else rows
        ends = nx * (ny if layers > 1 else nz) / (rows if layers > 1 else 1)
        joined = ends * (1 if parts == 2 else 4 * (1 - 1 / parts))
        turned = 2 * block * (1 - 1 / rows) if rows > 1 and layers > 1 else 0.0
        # T, the velocity (packed along y, a message each along z), p, faces; joins; turns.
        messages = ((rows > 1) * 7 + (layers > 1) * 11
                    + (1 if parts == 2 else 2 * (parts - 1))
                    + (2 * (rows - 1) if rows > 1 and layers > 1 else 0))
        return cls(rows, layers, block, 8 * (layers_sent * faces + joined + turned), messages)

    def efficiency(self, rate: float, bandwidth: float) -> float:
        """Share of the time that is not spent exchanging."""
        work = self.cells / rate
        return work / (work + self.bytes / bandwidth + self.messages * LATENCY)
