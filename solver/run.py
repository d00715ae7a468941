"""A run: a scene advanced from frame to frame into a folder of snapshots."""

import math
import shutil
import time
from pathlib import Path

from mpi4py import MPI

from partition.fragments import Fragments
from solver.files import FileError
from solver.journal import Journal
from solver.scene import Scene, save
from solver.snapshot import Snapshot
from solver.step import Simulation

OWN_FILES = ("snapshots", "status.json", "run.log", "run.log.jsonl")


def prepare_folder(out: Path, scene: Scene, fragments: Path | None, overwrite: bool) -> None:
    """Make OUT, with a copy of the scene and of the fragments; refuses one that holds a run."""
    if (out / "status.json").exists() and not overwrite:
        raise FileError(f"{out}: holds a run already; fix: choose another folder with -o, or add "
                        "--overwrite")
    out.mkdir(parents=True, exist_ok=True)
    for name in OWN_FILES:
        path = out / name
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    save(scene, out / "scene.toml")
    if fragments is not None and fragments.resolve() != (out / "fragments.h5").resolve():
        shutil.copyfile(fragments, out / "fragments.h5")


def run(scene: Scene, fragments: Fragments | None, out: Path, comm: MPI.Comm, started: float,
        per_step: bool = False) -> None:
    """Simulate the scene into OUT (made by `prepare_folder`); `started`: perf_counter at launch."""
    journal = Journal(out, comm.rank == 0, per_step)
    simulation = Simulation(scene, comm, fragments)
    snapshot = Snapshot(scene, simulation.state, out)
    setup = time.perf_counter() - started
    try:
        _frames(simulation, snapshot, journal, setup)
    except Exception as error:
        journal.status("failed", message=str(error), step=simulation.state.step,
                       time=simulation.state.time)
        raise
    finally:
        simulation.destroy()
        journal.close()


def _frames(simulation: Simulation, snapshot: Snapshot, journal: Journal, setup: float) -> None:
    """Frame 0 is the start; frame n stands at n × time.frame exactly, the last at time.end."""
    state, settings = simulation.state, simulation.scene.time
    frames = math.ceil(settings.end / settings.frame - 1e-9)
    _write(snapshot, simulation, 0)
    journal.status("running", frame=0, frames=frames, time=0.0)
    begin, written = time.perf_counter(), 0.0
    for frame in range(1, frames + 1):
        _advance_to(min(frame * settings.frame, settings.end), simulation, journal)
        state.frame = frame
        written += _write(snapshot, simulation, frame)
        spent = time.perf_counter() - begin
        journal.say(f"frame {frame:4d} of {frames}  t {state.time:.4e}  step {state.step:6d}  "
                    f"dt {state.dt:.2e} ({simulation.reason})  {spent:7.1f} s, "
                    f"{spent / frame * (frames - frame):.0f} s to go")
        journal.status("running", frame=frame, frames=frames, time=state.time, step=state.step)
    _close(simulation, journal, frames, setup, time.perf_counter() - begin, written)


def _advance_to(target: float, simulation: Simulation, journal: Journal) -> None:
    clock = time.perf_counter()
    for report in simulation.run_to(target):
        now = time.perf_counter()
        journal.step(simulation.state, simulation.reason, report, now - clock)
        clock = now


def _write(snapshot: Snapshot, simulation: Simulation, frame: int) -> float:
    start = time.perf_counter()
    snapshot.write(simulation.state, frame)
    return time.perf_counter() - start


def _close(simulation: Simulation, journal: Journal, frames: int, setup: float, spent: float,
           written: float) -> None:
    """The account at the end: where the time went, and the budgets."""
    state, report = simulation.state, simulation.report
    steps = max(state.step, 1)
    journal.say(f"set-up (imports, kernels, first pressure solve) {setup:.2f} s")
    journal.say(f"{state.step} steps, {steps / frames:.1f} per frame; "
                f"{1e3 * (spent - written) / steps:.3f} ms per step, {spent / frames:.3f} s per "
                f"frame, of which {written / frames:.3f} s writing")
    for name, seconds in sorted(simulation.seconds.items(), key=lambda item: -item[1]):
        journal.say(f"  {name:<12} {1e3 * seconds / steps:8.3f} ms per step")
    if state.swarm is not None:
        journal.say(f"burnt mass {report.burnt:.12g}, gas {report.gas:.12g}, heat "
                    f"{report.heat:.12g}; fuel {report.fuel}, soot {report.soot}")
    journal.status("done", frame=frames, frames=frames, time=state.time, step=state.step,
                   seconds=spent, setup_seconds=setup,
                   milliseconds_per_step=1e3 * (spent - written) / steps)
