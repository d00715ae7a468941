"""The whole state of a run, so that it can go on as if it had never stopped.

A checkpoint holds, in double precision: every field with the ghost layers around the box (air that
flows in through an open face depends on the velocity of a substep that is over), the particles with
their order in memory (sums depend on it), the bodies, the clock, dt, the counters behind ids and
random numbers, the running totals of every rank, and the scene.

    /                       format, complete, time [s], step, frame, dt [s], ranks, made, settled,
                            implicit_steps
    /fields/NAME            (nz + 4, ny + 4, nx + 4), indexed [k, j, i], 2 ghost layers on each side
    /particles/NAME         one row per particle, rank by rank;  /particles_of_rank: how many each
    /bodies/NAME            one row per piece or vertex;  /totals/NAME: one number per rank
    /scene                  the scene as JSON, in bytes

On as many ranks as wrote it, it continues bit for bit. On another number, particles are dealt out
in the order of their ids, and results agree to the tolerance of the pressure solve.
Random numbers need no state: they are functions of seed, stream and id (`hashing`).
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from solver.files import (CHECKPOINT, FileError, checkpoint_path, checkpoint_paths, open_file,
                          read_array)
from solver.files_checksum import check
from solver.files_write import Block, SnapshotWriter
from solver.grid import AXES, Field, Grid
from solver.kernel import GHOSTS
from solver.scene import Scene
from solver.state import State
from solver.step import Simulation
from solver.swarm import PARTICLE, Swarm, owners
from solver.vertices import HELD

FIELDS = ("u", "v", "w", "p", "T", "phi")
CLOCK = ("time", "step", "frame", "dt", "implicit_steps")
BODIES = ("vertices", "area", "weight", "lever", "mass", "rest_centre", "inertia",
          "inverse_inertia", "law", "position", "orientation", "velocity", "spin")
FIXED = ("seed", "domain", "initial", "detonation", "body")   # of the scene, for a restart


class Checkpoints:
    """Writes the state of a simulation, and puts one back."""

    def __init__(self, simulation: Simulation, directory: Path, keep: int):
        self.simulation, self.directory, self.keep = simulation, directory, keep
        self.state, self.scene = simulation.state, simulation.scene
        self.comm = simulation.state.grid.comm
        self.writer = SnapshotWriter(directory, self.comm, "float64", "none")

    def write(self, path: Path | None = None) -> Path:
        """Save the state, by default as the checkpoint of its step, of which only the newest
        `keep` remain; every rank must call it. Raises `WriteError`."""
        state = self.state
        blocks = {f"fields/{name}": ghosted_block(state.grid, field)
                  for name, field in fields(state).items()}
        root = {name: getattr(state, name) for name in CLOCK} | {"ranks": self.comm.size}
        text = np.frombuffer(scene_text(self.scene).encode(), np.uint8)
        blocks["scene"] = self.writer.replicated(text)
        for name, total in sorted(state.totals.items()):
            blocks[f"totals/{name}"] = self.writer.rows(np.array([total]))
        if state.swarm is not None:
            points = state.swarm.points
            root |= {"made": self.simulation.stages["emit"][1].made,
                     "settled": state.swarm.settled}
            blocks["particles_of_rank"] = self.writer.rows(np.array([len(points)], np.int64))
            blocks.update(self.writer.table({f"particles/{name}": points[name]
                                             for name in PARTICLE.names or ()}))
        if state.bodies is not None:
            for name in BODIES:
                blocks[f"bodies/{name}"] = self.writer.replicated(getattr(state.bodies, name))
        made = path or checkpoint_path(self.directory, state.step)
        self.writer.write_file(made, blocks, {"format": CHECKPOINT, **root})
        if path is None and self.comm.rank == 0:
            for old in checkpoint_paths(self.directory)[:-self.keep]:
                old.unlink()
        return made

    def restore(self, path: Path) -> None:
        """Make the state that of a good checkpoint of this scene; raises `FileError`."""
        state = self.state
        with open_file(path, CHECKPOINT) as file:
            for name in CLOCK:
                setattr(state, name, file.attrs[name].item())
            if not has_pressures(file, state):
                state.implicit_steps = 0
            for name, field in fields(state).items():
                _fill(field, file, f"fields/{name}", ghosted_region(state.grid))
            same = int(file.attrs["ranks"]) == self.comm.size
            for name in state.totals:
                values = read_array(file, f"totals/{name}")
                state.totals[name] = float(values[self.comm.rank] if same else
                                           values.sum() * (self.comm.rank == 0))
            if state.swarm is not None:
                self.simulation.stages["emit"][1].made = int(file.attrs["made"])
                replace(state.swarm, particles(file, state.grid, same))
                state.swarm.settled = int(file.attrs["settled"])
            if state.bodies is not None:
                for name in BODIES:
                    _fill(getattr(state.bodies, name), file, f"bodies/{name}")
                resume_deformation(state)
        self.simulation.report = self.simulation.monitor(state)   # it bounds the next dt


def fields(state: State) -> dict[str, Field]:
    """The fields that the next step depends on, by name."""
    known = {name: getattr(state, name) for name in FIELDS}
    if state.implicit_steps:
        known |= {f"p_{number}": field for number, field in enumerate(state.pressures)}
    return {name: field for name, field in known.items() if field is not None}


def has_pressures(file: Any, state: State) -> bool:
    """Whether a file holds the pressures of substeps that this run makes, too: viscosity may be
    treated otherwise than when it was written."""
    number = sum(name.startswith("p_") for name in file["fields"])
    return state.pressures is not None and number == len(state.pressures)


def _fill(target: np.ndarray[Any, Any], file: Any, name: str,
          region: tuple[slice, ...] = ()) -> None:
    """Put what a file holds into an array of its shape; raises ValueError for another shape."""
    values = read_array(file, name, region)
    if values.shape != target.shape or values.dtype.kind not in "fiu":
        raise ValueError(f"{name} holds {values.dtype} of shape {values.shape}, not {target.shape}")
    target[...] = values


def ghosted_region(grid: Grid) -> tuple[slice, ...]:
    """Where this rank's field with all its ghosts lies in the ghosted field of the whole box."""
    region = [slice(0)] * 3
    for a in range(3):
        region[AXES[a]] = slice(grid.start[a], grid.start[a] + grid.count[a] + 2 * GHOSTS)
    return tuple(region)


def ghosted_block(grid: Grid, field: Field) -> Block:
    """This rank's cells, with the ghosts that lie outside the box."""
    region, offset, shape = [slice(0)] * 3, [0] * 3, [0] * 3
    for a in range(3):
        first = 0 if grid.at_low_end(a) else GHOSTS
        last = grid.count[a] + (2 * GHOSTS if grid.at_high_end(a) else GHOSTS)
        region[AXES[a]] = slice(first, last)
        offset[AXES[a]] = grid.start[a] + first
        shape[AXES[a]] = grid.cells[a] + 2 * GHOSTS
    return Block(field[tuple(region)], tuple(offset), tuple(shape))


def replace(swarm: Swarm, records: np.ndarray[Any, Any]) -> None:
    """Make these the particles of this rank, in this order."""
    swarm.points["mass"] = -1.0
    swarm.settle()
    swarm.append(records)


def particles(file: Any, grid: Grid, same_ranks: bool) -> np.ndarray[Any, Any]:
    """The particles of this rank: as it held them, or else, by id, those in its cells."""
    stop = np.cumsum(read_array(file, "particles_of_rank"))
    rows = slice(0, int(stop[-1]))
    if same_ranks:
        rows = slice(int(stop[grid.comm.rank - 1]) if grid.comm.rank else 0,
                     int(stop[grid.comm.rank]))
    records = np.zeros(len(range(*rows.indices(int(stop[-1])))), PARTICLE)
    for name in PARTICLE.names or ():
        _fill(records[name], file, f"particles/{name}", (rows,))
    if same_ranks:
        return records
    records = records[np.argsort(records["id"], kind="stable")]
    return records[owners(grid, records["position"]) == grid.comm.rank]


def resume_deformation(state: State) -> None:
    """The bodies that are soft still, in the shape that they have now."""
    bodies = state.bodies
    if bodies.deformation is None:
        return
    soft = [body for body in bodies.deformation.soft if bodies.law[body.pieces[0]] & HELD]
    for body in soft:
        body.points[body.point_of] = bodies.vertices[body.vertices]
    bodies.deformation.soft = soft


def scene_text(scene: Scene) -> str:
    """The scene as JSON; `inf` stays itself."""
    return json.dumps(scene.model_dump(exclude={"render", "output"}), sort_keys=True)


def newest(directory: Path, say: Any) -> Path | None:
    """The newest good checkpoint of a run; each damaged one is said and put aside."""
    for path in reversed(checkpoint_paths(directory)):
        problem = check(path, CHECKPOINT)
        if not problem:
            return path
        aside = path.rename(path.with_name(path.name + ".damaged"))
        say(f"skipped: {problem}; now {aside.name}")
    return None


def differences(path: Path, scene: Scene) -> list[str]:
    """What the scene now says otherwise than when the checkpoint was written, as key: then → now.
    Raises `FileError` where the state would not fit it."""
    with open_file(path, CHECKPOINT) as file:
        then = json.loads(bytes(read_array(file, "scene")).decode())
    now = json.loads(scene_text(scene))
    changed = list(_changes(then, now, ""))
    for key, before, after in changed:
        if key.split(".")[0] in FIXED or key in ("fuel", "soot") or "temperature" in key.split("."):
            raise FileError(f"{path}: was written with {key} = {before!r}, the scene has "
                            f"{after!r}; fix: start anew with --overwrite, or restore that value")
    return [f"{key}: {before!r} → {after!r}" for key, before, after in changed]


def _changes(then: Any, now: Any, key: str) -> Any:
    if isinstance(then, dict) and isinstance(now, dict):
        for name in sorted(then.keys() | now.keys()):
            yield from _changes(then.get(name), now.get(name), f"{key}.{name}".lstrip("."))
    elif then != now:
        yield key, then, now
