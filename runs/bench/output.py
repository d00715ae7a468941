"""What does a snapshot cost, beside the run and beside the least that HDF5 can do?

The yardstick gathers the same arrays on rank 0 and writes each with one `create_dataset`: no
attributes, no compression, no checksum, no other name while it is being written. Neither waits for
the disk, as in a run between checkpoints; "to disk" is with `fsync` for both, and for ours with the
checksum, which a run computes in a thread meanwhile. Both are timed in turn, so that other work on
the machine slows both; the medians are compared. The scene is the window after one frame, when its
particles burn; so many `frames` more say what a frame of the run itself takes.

    [mpirun -n 2] python -m runs bench output [frames=4] [repeats=30] [out=DIR] [key=value ...]

`key=value` overrides the scene, as in domain.cells=[128,120,144]. The table goes to
DIR/output_N_ranks.csv.
"""

import csv
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from mpi4py import MPI

from partition.build import build
from solver import scene as scenes
from solver.files_whole import sync
from solver.files_write import Block
from solver.scene import Scene
from solver.snapshot import Snapshot
from solver.step import Simulation

COMM = MPI.COMM_WORLD
WINDOW = Path(__file__).parent.parent / "scenes" / "window.toml"
ALL_FIELDS = 'output.fields=["u", "v", "w", "p", "T", "phi"]'
VARIANTS = {"as the scene says": [], "not compressed": ['output.compression="none"'],
            "all fields": [ALL_FIELDS],
            "all fields, not compressed": [ALL_FIELDS, 'output.compression="none"']}
OPTIONS: dict[str, Any] = {"frames": 4, "repeats": 30, "out": "out/bench"}
Row = dict[str, Any]


def main(argv: list[str]) -> None:
    """Measure every variant, print the table and write it."""
    options, overrides = dict(OPTIONS), []
    for argument in argv:
        key, _, value = argument.partition("=")
        if key in options:
            options[key] = type(options[key])(value)
        else:
            overrides.append(argument)
    rows = measure(scenes.load(WINDOW, overrides), options["frames"], options["repeats"],
                   {name: scenes.load(WINDOW, overrides + more)
                    for name, more in VARIANTS.items()})
    if COMM.rank == 0:
        path = Path(options["out"]) / f"output_{COMM.size}_ranks.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
        for row in rows:
            print("  ".join(f"{key} {value}" for key, value in row.items()))
        print(f"written to {path}")


def measure(scene: Scene, frames: int, repeats: int, variants: Mapping[str, Scene]) -> list[Row]:
    """One row per variant; the run's own time per frame is that of `frames` frames."""
    pieces = build(scene) if scene.body else None
    simulation = Simulation(scene, COMM, pieces)
    frame = scene.time.frame
    for _ in simulation.run_to(frame):
        pass   # what is slow only once
    start = time.perf_counter()
    for _ in simulation.run_to((frames + 1) * frame):
        pass
    per_frame = (time.perf_counter() - start) / frames
    rows = []
    for title, variant in variants.items():
        with tempfile.TemporaryDirectory() as name:
            rows.append(_row(title, variant, simulation, Path(COMM.bcast(name)), repeats,
                             per_frame))
            COMM.Barrier()
    simulation.destroy()
    return rows


def _row(title: str, scene: Scene, simulation: Simulation, folder: Path, repeats: int,
         per_frame: float) -> Row:
    state, output = simulation.state, Snapshot(scene, simulation.state, folder)
    times = []
    for repeat in range(repeats + 2):
        yardstick = folder / f"raw_{repeat}.h5"
        times.append([_clock(lambda: output.write(state, repeat)), _clock(output.sync),
                      _clock(lambda: raw(yardstick, output.blocks(state), output.writer.precision)),
                      _clock(lambda: sync(yardstick) if COMM.rank == 0 else None)])
    mine, after, bare, after_bare = (1e3 * statistics.median(column[2:])
                                     for column in zip(*times, strict=True))
    sizes = [os.path.getsize(path) / 1e6 for path in (
        folder / "snapshots" / f"snap_{repeats:06d}.h5", folder / f"raw_{repeats}.h5")]
    COMM.Barrier()
    return {"snapshot": title, "ranks": COMM.size, "ms": round(mine, 2), "raw ms": round(bare, 2),
            "ratio": round(mine / bare, 2), "to disk ms": round(mine + after, 2),
            "raw to disk ms": round(bare + after_bare, 2),
            "ratio to disk": round((mine + after) / (bare + after_bare), 2),
            "MB": round(sizes[0], 3), "raw MB": round(sizes[1], 3),
            "share of a frame": round(mine / (1e3 * per_frame + mine), 3)}


def _clock(work: Callable[[], Any]) -> float:
    """Seconds of it, on the slowest rank."""
    COMM.Barrier()
    start = time.perf_counter()
    work()
    COMM.Barrier()
    return time.perf_counter() - start


def raw(path: Path, blocks: Mapping[str, Block], precision: np.dtype[Any]) -> None:
    """The same arrays, gathered and written with nothing else."""
    whole = {}
    for name, block in blocks.items():
        values = block.values
        if values.dtype.kind == "f":
            values = values.astype(precision, copy=False)
        parts = COMM.gather((values, block.offset))
        if parts is not None:
            whole[name] = np.empty(block.shape, values.dtype)
            for part, offset in parts:
                region = tuple(slice(o, o + n) for o, n in zip(offset, part.shape, strict=True))
                whole[name][region] = part
    if COMM.rank == 0:
        with h5py.File(path, "w") as file:
            for name, array in whole.items():
                file.create_dataset(name, data=array)
