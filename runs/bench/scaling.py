"""Ranks against one: strong and weak scaling, and what the exchanged bytes say about many ranks.

    python -m runs bench scaling [cells]     (default 128; runs mpirun with 1 and 2 ranks)

Strong: the same box on 2 ranks; weak: a box twice as deep. Fresh processes in turn, twice
each; the medians count. Stages are those of `bench speed`. Writes results/scaling.csv.

The model: per substep a rank exchanges GHOSTS layers of u, v, w and T, and single layers of p, of
the faces and of the solve with its neighbours, and its whole block in every transpose of the
pressure solve (two where only one axis is split, else four), part of which stays at home. It counts
bytes and messages; the time is that of a network, the arithmetic that of the rank measured here.
Writes results/scaling_model.csv and .png.
"""

import json
import os
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from runs.bench import chart, speed
from runs.bench.clock import in_turn, solve_job
from solver.grid import process_grid
from solver.kernel import GHOSTS

RESULTS = Path(__file__).parent / "results"
ROUNDS, REPEATS = 2, 6
BANDWIDTHS = (1e9, 3e9, 10e9)   # bytes per second and rank: a shared, a common, a good network
LATENCY = 2e-6                  # s per message
RANKS = (1, 2, 8, 64, 512, 4096)
Box = tuple[int, int, int]


def main(argv: list[str]) -> None:
    """Measure, print and store both tables; with `worker` this is one of the ranks."""
    if argv[:1] == ["worker"]:
        worker([int(n) for n in argv[1:4]])
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
    jobs = {"one": (1, (n, n, n)), "strong": (2, (n, n, n)), "weak": (2, (n, n, 2 * n))}
    rounds = [{name: launch(*job) for name, job in jobs.items()} for _ in range(ROUNDS)]
    found = {name: {what: statistics.median(r[name][what] for r in rounds)
                    for what in rounds[0][name]} for name in jobs}
    rows = []
    for name, work in (("strong", 1), ("weak", 2)):
        for what, seconds in found[name].items():
            gain = work * found["one"][what] / seconds
            rows.append((name, what, work * found["one"][what], seconds, gain))
            print(f"{name:<7} {what:<12} 1 rank {rows[-1][2]:.4f} s, 2 ranks {seconds:.4f} s: "
                  f"{gain:.2f} times faster", flush=True)
    chart.write_csv(RESULTS / "scaling.csv", "kind,what,seconds on 1 rank,seconds on 2 ranks,"
                    "times faster", rows, f"python -m runs bench scaling {n}")
    return n**3 * 3 / found["one"]["step"]


def launch(ranks: int, cells: Box) -> dict[str, float]:
    """Seconds per step, per solve and per stage of a step, from a fresh mpirun."""
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1",
                       NUMEXPR_NUM_THREADS="1")
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), sys.executable, "-c", "import sys; from runs.bench import "
         "scaling; scaling.main(sys.argv[1:])", "worker", *map(str, cells)],
        env=environment, capture_output=True, text=True, check=True, timeout=600)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def worker(cells: list[int]) -> None:
    """Measure on all ranks; rank 0 prints."""
    simulation = speed.make(cells, [])
    simulation.seconds = dict.fromkeys(simulation.seconds, 0.0)
    seconds = in_turn(REPEATS, step=lambda: simulation.advance(1e3),
                      solve=solve_job(simulation.stages["project"][1].solver))
    result: dict[str, Any] = {name: statistics.median(values) for name, values in seconds.items()}
    result.update({name: total / REPEATS for name, total in simulation.seconds.items()})
    if simulation.state.grid.comm.rank == 0:
        print(json.dumps(result))
    simulation.destroy()


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
        """Counted from the exchanges of `grid`, `boundary`, `project` and `transform`."""
        nx, ny, nz = box
        _, rows, layers = process_grid(box, ranks)
        block = nx * ny * nz / ranks
        faces = (rows > 1) * nx * nz / layers + (layers > 1) * nx * ny / rows
        split = [parts for parts in (rows, layers) if parts > 1]
        # Both ways: u, v, w, T and p in GHOSTS layers, the solve's one; one way: the low faces.
        layers_sent = 2 * (5 * GHOSTS + 1) + 1
        groups = split if len(split) == 2 else [ranks] * len(split)
        transposed = sum(2 * block * (1 - 1 / group) for group in groups)
        messages = len(split) * 2 * 4 + len(split) + sum(2 * (group - 1) for group in groups)
        return cls(rows, layers, block, 8 * (layers_sent * faces + transposed), messages)

    def efficiency(self, rate: float, bandwidth: float) -> float:
        """Share of the time that is not spent exchanging."""
        work = self.cells / rate
        return work / (work + self.bytes / bandwidth + self.messages * LATENCY)
