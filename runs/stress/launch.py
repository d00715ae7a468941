"""The solver as a user starts it, on some ranks, and as nobody would end it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from runs.ranks import environment, mpirun

KILLABLE = ("one rank", "mpirun", "all")
GONE = 10.0      # s in which every rank has to end after a failure


class Lasting(Exception):
    """Processes that should have ended and have not."""


@dataclass
class Job:
    """A command on `ranks` ranks (0: without mpirun), its output in `log`."""

    ranks: int
    arguments: tuple[str, ...]
    log: Path
    seen: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        launcher = (*mpirun(self.ranks), "--mca", "mpi_yield_when_idle", "1") if self.ranks else ()
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with open(self.log, "ab") as output:
            self.process = subprocess.Popen(
                (*launcher, sys.executable, *self.arguments), stdin=subprocess.DEVNULL,
                stdout=output, stderr=subprocess.STDOUT, env=environment())
        self.started = time.monotonic()

    @property
    def running(self) -> bool:
        """Whether mpirun (or the one process) runs."""
        return self.process.poll() is None

    def pids(self) -> list[int]:
        """The processes of the ranks that are there now."""
        found = children(self.process.pid) if self.ranks else [self.process.pid]
        self.seen.update(found)
        return found

    def kill(self, victim: str, random: np.random.Generator) -> None:
        """End one of KILLABLE with SIGKILL."""
        ranks = self.pids()
        doomed = {"mpirun": [self.process.pid], "all": [self.process.pid, *ranks],
                  "one rank": [int(random.choice(ranks))] if ranks else []}[victim]
        for pid in doomed:
            send(pid, signal.SIGKILL)

    def end(self, limit: float) -> int:
        """The exit code; raises `Lasting` where something still runs after `limit` seconds, and
        ends that."""
        try:
            code = self.process.wait(limit)
        except subprocess.TimeoutExpired:
            code = None
        rest = [pid for pid in self.seen if alive(pid)]
        stop = time.monotonic() + GONE
        while code is not None and rest and time.monotonic() < stop:
            time.sleep(0.02)
            rest = [pid for pid in rest if alive(pid)]
        if code is None or rest:
            for pid in (self.process.pid, *self.seen):
                send(pid, signal.SIGKILL)
            self.process.wait()
            raise Lasting(f"{len(rest)} ranks" if code is not None
                          else f"still running after {limit:.0f} s")
        return code

    def output(self) -> str:
        """What it has printed."""
        return self.log.read_text(encoding="utf-8", errors="replace")


def solve(ranks: int, scene: Path, out: Path, *options: str, log: Path) -> Job:
    """Start the solver."""
    return Job(ranks, ("-m", "solver", str(scene), "-o", str(out), *options), log)


def finish(job: Job, limit: float = 900.0) -> int:
    """Wait for a job to end by itself; its exit code, -1 where it had to be ended."""
    wait_for(lambda: bool(job.pids()) or not job.running, 30)
    try:
        return job.end(limit)
    except Lasting:
        return -1


def wait_for(condition: Callable[[], bool], limit: float) -> bool:
    """Whether a condition came true within `limit` seconds."""
    stop = time.monotonic() + limit
    while not condition():
        if time.monotonic() > stop:
            return False
        time.sleep(0.01)
    return True


def children(pid: int) -> list[int]:
    """The processes that a process has started."""
    try:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii")
    except OSError:
        return []
    return [int(word) for word in text.split()]


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and was not asked for its exit code does not."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] not in "ZX"


def send(pid: int, number: signal.Signals) -> None:
    """A signal to a process that may be gone."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        pass
