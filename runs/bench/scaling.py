"""Ranks against one: strong and weak scaling, and what the exchanged bytes say about many ranks.

    python -m runs bench scaling [cells]     (default 128; runs mpirun with 1 and 2 ranks)

The model: per substep a rank exchanges GHOSTS layers of u, v, w and T with its neighbours, and its
whole block in every transpose of the pressure solve (two where only one axis is split, else four).
"""

import json
import os
import subprocess
import sys
from typing import Any

from runs.bench import speed
from solver.grid import process_grid
from solver.kernel import GHOSTS

RATE = 10e9   # bytes per second and rank, of a good network
CELLS = 4e6   # cell-substeps per second and rank (default scheme), as measured by `speed`


def main(argv: list[str]) -> None:
    """Print the tables; with `worker` this is one of the ranks."""
    if argv[:1] == ["worker"]:
        print_worker([int(n) for n in argv[1:4]])
        return
    n = int(argv[0]) if argv else 128
    one = launch(1, (n, n, n))
    for label, cells in (("strong", (n, n, n)), ("weak", (n, n, 2 * n))):
        two = launch(2, cells)
        work = cells[2] / n
        print(f"{label:<7} {cells}: 1 rank {work * one['step']:.4f} s per step, 2 ranks "
              f"{two['step']:.4f} s: {work * one['step'] / two['step']:.2f} times faster; pressure "
              f"{work * one['solve'] / two['solve']:.2f} times")
    print("\nmodel for 1024³ cells: share of a substep spent exchanging")
    for ranks in (2, 64, 4096):
        print(f"  {ranks:5d} ranks  {100 * model((1024,) * 3, ranks):5.1f} %")


def launch(ranks: int, cells: tuple[int, int, int]) -> dict[str, float]:
    """Seconds per step and per solve, from a fresh mpirun."""
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1",
                       NUMEXPR_NUM_THREADS="1")
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), sys.executable, "-c", "import sys; from runs.bench import "
         "scaling; scaling.main(sys.argv[1:])", "worker", *map(str, cells)],
        env=environment, capture_output=True, text=True, check=True, timeout=600)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def print_worker(cells: list[int]) -> None:
    """Measure on all ranks; rank 0 prints."""
    simulation = speed.make(cells, [])
    seconds = speed.in_turn(10, step=lambda: simulation.advance(1e3),
                            solve=speed.solve_job(simulation))
    result: dict[str, Any] = {name: sorted(values)[len(values) // 2]
                              for name, values in seconds.items()}
    if simulation.state.grid.comm.rank == 0:
        print(json.dumps(result))
    simulation.destroy()


def model(cells: tuple[int, int, int], ranks: int) -> float:
    """Share of the time of a substep that a rank spends exchanging at `RATE`."""
    nx, ny, nz = cells
    _, rows, layers = process_grid(cells, ranks)
    block = nx * ny * nz / ranks
    faces = (rows > 1) * 2 * nx * nz / layers + (layers > 1) * 2 * nx * ny / rows
    halos = 8 * faces * (4 * GHOSTS + 2)   # u, v, w, T; the pressure and its solve
    hops = 2 * ((rows > 1) + (layers > 1))
    exchanged = (halos + 8 * block * hops) / RATE
    return float(exchanged / (exchanged + block / (3 * CELLS)))
