"""A run: a scene advanced from frame to frame into a folder of snapshots, in one session or more.

Frame n stands at n × time.frame exactly, the last at time.end. A session ends at the end of the
run, or early at a checkpoint (`session`), from which the next one goes on. When something fails on
all ranks the state is saved in OUT/failed.h5; when on one rank only, the others are waiting for it
somewhere and are ended.
"""

import math
import shutil
import sys
import time
import traceback
from contextlib import suppress
from pathlib import Path

import numpy as np
from mpi4py import MPI

from solver.checkpoint import FIELDS, Checkpoints, differences, newest
from solver.files import FileError, WriteError, checkpoint_paths, snapshot_frames
from solver.files_whole import replacing
from solver.grid import INNER
from solver.journal import Journal
from solver.scene import Scene, SceneError, save
from solver.session import DISK, DONE, FAILED, GO_ON, STOP, STOPPED, Session
from solver.snapshot import Snapshot
from solver.state import State
from solver.step import Simulation, StepError

OWN_FILES = ("snapshots", "checkpoints", "status.json", "run.log", "run.log.jsonl", "failed.h5",
             "stop")
EXPECTED = StepError, SceneError, FileError, OSError   # that need no traceback
PATIENCE = 4.0   # s, for the other ranks to fail as well


class RunFailed(Exception):
    """A run that ended in failure on all ranks; `code` is the exit code."""

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code


def prepare_folder(out: Path, scene: Scene, fragments: Path | None, overwrite: bool,
                   restart: bool = False) -> Path | None:
    """Make OUT, with a copy of the scene and of the fragments; refuses one that holds a run, unless
    that is to be replaced, or continued: then returns the checkpoint to continue from, if any."""
    found = None
    if restart:
        found = newest(out, print)
        if found is not None:
            for change in differences(found, scene):
                print(f"the scene has changed: {change}", flush=True)
        print(f"continues from {found}" if found else f"{out}: no checkpoint to continue from: "
              "starts at the beginning", flush=True)
    elif not overwrite and ((out / "status.json").exists() or snapshot_frames(out)
                            or checkpoint_paths(out)):
        raise FileError(f"{out}: holds a run already; fix: choose another folder with -o, or add "
                        "--restart or --overwrite")
    out.mkdir(parents=True, exist_ok=True)
    for unfinished in out.glob("*/*.h5.tmp"):
        unfinished.unlink()
    for name in () if restart else OWN_FILES:
        path = out / name
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    with replacing(out / "scene.toml") as path:
        save(scene, path)
    pieces = out / "fragments.h5"
    if fragments is not None and fragments.resolve() != pieces.resolve():
        with replacing(pieces) as path:
            shutil.copyfile(fragments, path)
    return found


def run(simulation: Simulation, out: Path, session: Session, checkpoint: Path | None = None,
        per_step: bool = False) -> int:
    """Simulate into OUT (made by `prepare_folder`), from a checkpoint if one is given; returns DONE
    or STOPPED, or raises `RunFailed`."""
    alarm = simulation.state.grid.comm.Dup()   # to find out whether the others have failed too
    session.listen()
    run_ = None
    try:
        run_ = Run(simulation, out, session, per_step)
        return run_.frames(checkpoint)
    except Exception as error:
        raise failure(error, run_, out, alarm) from error
    finally:
        session.unlisten()
        if run_ is not None:
            run_.journal.close()
        alarm.Free()


class Run:
    """One session of a run."""

    def __init__(self, simulation: Simulation, out: Path, session: Session, per_step: bool):
        self.simulation, self.out, self.session = simulation, out, session
        self.state, self.scene = simulation.state, simulation.scene
        scene, self.comm = self.scene, self.state.grid.comm
        self.journal = Journal(out, self.comm.rank == 0, per_step, session.restart)
        self.snapshot = Snapshot(scene, self.state, out)
        self.checkpoints = Checkpoints(simulation, out, scene.output.checkpoint_keep)
        self.setup = time.perf_counter() - session.started
        self.total = math.ceil(scene.time.end / scene.time.frame - 1e-9)
        self.begin = self.saved = time.perf_counter()
        self.written = 0.0

    def frames(self, checkpoint: Path | None) -> int:
        """From the start or a checkpoint to the end, or until asked to stop."""
        state, settings = self.state, self.scene.time
        if checkpoint is not None:
            self.checkpoints.restore(checkpoint)
            self.journal.rewind(state.step)
            self.journal.say(f"continues at step {state.step}, t = {state.time:.6g}")
        else:
            self.journal.rewind(0)
            self._store(0)
        first = state.frame
        first_step = state.step
        self._status("running")
        while state.time < settings.end:
            partial = state.time < state.frame * settings.frame * (1 - 1e-9)   # time.end was moved
            frame = state.frame + (not partial)
            reason = self._advance_to(min(frame * settings.frame, settings.end))
            if reason:
                return self._stop(reason)
            self._store(frame)
            self._tell(first)
            if reason := self._asked():
                return self._stop(reason)
        self._save()
        self._account(state.step - first_step, self.total - first)
        return DONE

    def _advance_to(self, target: float) -> str:
        """Reach a frame; returns why the session is to stop before it, or ""."""
        clock = time.perf_counter()
        for report in self.simulation.run_to(target):
            now = time.perf_counter()
            self.session.took(now - clock)
            self.journal.step(self.state, self.simulation.reason, report, now - clock)
            if self.state.time < target and (reason := self._asked()):
                return reason
            clock = time.perf_counter()
        return ""

    def _asked(self) -> str:
        """Do what signals, clock and stop file ask; returns why to stop, or ""."""
        every = self.scene.output.checkpoint_every
        self.session.due = 0 < every <= time.perf_counter() - self.saved
        action, reason = self.session.ask(self.out, self.state.time, self.comm)
        if action != GO_ON:
            self._save()
        return reason if action == STOP else ""

    def _save(self) -> None:
        """A checkpoint."""
        start = time.perf_counter()
        self.snapshot.sync()
        self.journal.flush()
        path = self.checkpoints.write()
        self.saved = time.perf_counter()
        self.session.took(self.saved - start)
        self.written += self.saved - start
        self.journal.say(f"checkpoint {path.name} at t {self.state.time:.4e} in "
                         f"{self.saved - start:.2f} s")

    def _store(self, frame: int) -> None:
        """A snapshot."""
        start = time.perf_counter()
        self.state.frame = frame
        self.snapshot.write(self.state, frame)
        self.written += time.perf_counter() - start

    def _stop(self, reason: str) -> int:
        self.journal.say(f"stops: {reason}; go on with --restart")
        self._status("stopped", reason=reason)
        return DONE if reason == "until" else STOPPED

    def _status(self, condition: str, **more: float | str) -> None:
        state = self.state
        self.journal.status(condition, frame=state.frame, frames=self.total, time=state.time,
                            step=state.step, **more)

    def _tell(self, first: int) -> None:
        """One line per frame."""
        state, spent = self.state, time.perf_counter() - self.begin
        left = spent / max(state.frame - first, 1) * (self.total - state.frame)
        self.journal.say(f"frame {state.frame:4d} of {self.total}  t {state.time:.4e}  step "
                         f"{state.step:6d}  dt {state.dt:.2e} ({self.simulation.reason})  "
                         f"{spent:7.1f} s, {left:.0f} s to go")
        self._status("running")

    def _account(self, steps: int, frames: int) -> None:
        """The account at the end of what this session did: where the time went, and the budgets."""
        state, report, say = self.state, self.simulation.report, self.journal.say
        steps, frames = max(steps, 1), max(frames, 1)
        spent = time.perf_counter() - self.begin
        own = 1e3 * (spent - self.written) / steps
        say(f"set-up (imports, kernels, first pressure solve) {self.setup:.2f} s")
        say(f"{steps} steps, {steps / frames:.1f} per frame; {own:.3f} ms per step, "
            f"{spent / frames:.3f} s per frame, of which {self.written / frames:.3f} s writing")
        for name, seconds in sorted(self.simulation.seconds.items(), key=lambda item: -item[1]):
            say(f"  {name:<12} {1e3 * seconds / steps:8.3f} ms per step")
        if state.swarm is not None:
            say(f"burnt mass {report.burnt:.12g}, gas {report.gas:.12g}, heat "
                f"{report.heat:.12g}; fuel {report.fuel}, soot {report.soot}")
        self._status("done", seconds=spent, setup_seconds=self.setup, writing_seconds=self.written,
                     milliseconds_per_step=own)


def failure(error: Exception, run_: Run | None, out: Path, alarm: MPI.Comm) -> Exception:
    """Say what has failed and save what can be saved. Returns the exception to leave with, where
    all ranks have failed; otherwise ends all ranks, here and now."""
    code = DISK if isinstance(error, OSError | WriteError) else FAILED
    message = str(error) or type(error).__name__
    together, message = in_common(message, alarm)
    if together:
        if run_ is not None:
            message += unsound(run_.state)
            if code == FAILED:
                message += _save_wreck(run_)
    if alarm.rank == 0 or not together:
        _tell_failure(run_, out, message)
        if not isinstance(error, EXPECTED):
            traceback.print_exception(error)
    if not together:
        print(f"error: {message}", file=sys.stderr, flush=True)
        alarm.Abort(code)
    return error if isinstance(error, SceneError) else RunFailed(message, code)


def _tell_failure(run_: Run | None, out: Path, message: str) -> None:
    """Put it into status.json, as far as the disk lets us."""
    state = {"step": run_.state.step, "time": run_.state.time} if run_ is not None else {}
    with suppress(OSError):
        journal = run_.journal if run_ is not None else Journal(out, True, False, True)
        journal.active = True
        journal.status("failed", message=message, **state)


def in_common(message: str, alarm: MPI.Comm) -> tuple[bool, str]:
    """Whether all ranks have failed, and what to say: what all of them say, or who says what."""
    if not everybody(alarm):
        return False, f"rank {alarm.rank} of {alarm.size}: {message}"
    messages = alarm.allgather(message)
    if len(set(messages)) > 1:
        message = "; ".join(f"rank {rank}: {text}" for rank, text in enumerate(messages))
    return True, message


def everybody(alarm: MPI.Comm) -> bool:
    """Whether all ranks come here within a few seconds."""
    request = alarm.Ibarrier()
    start = time.monotonic()
    while not request.Test():
        if time.monotonic() - start > PATIENCE:
            return False
        time.sleep(0.01)
    return True


def _save_wreck(run_: Run) -> str:
    """Keep the state as it is, for a look; a restart takes the last checkpoint, not this."""
    try:
        path = run_.checkpoints.write(run_.out / "failed.h5")
    except Exception as error:   # it comes on top of the failure that matters
        return f" (the state could not be saved: {error})"
    return f" (the state is in {path})"


def unsound(state: State) -> str:
    """Where the first value that is not finite stands, or ""; every rank must call it."""
    found = []
    for name in FIELDS:
        field = getattr(state, name, None)
        if field is not None and not np.isfinite(field[INNER]).all():
            k, j, i = (int(n) for n in np.argwhere(~np.isfinite(field[INNER]))[0])
            x, y, z = state.grid.start
            found.append(f"{name}[{k + z}, {j + y}, {i + x}] = {field[INNER][k, j, i]} on rank "
                         f"{state.grid.comm.rank}")
    first = [text for texts in state.grid.comm.allgather(found[:1]) for text in texts]
    return f" ({first[0]})" if first else ""
