"""When does a run stop before its end, and what does its exit code say?

    0    done; with --until, that time was reached
    1    failed: the flow is not finite, the time step collapsed, a solver diverged, an exception
    2    bad input: nothing was written
    3    the disk: a file could not be written; what was finished before is whole
    85   stopped early at a checkpoint, by signal, wall time or stop file: continue with --restart
    137  (of mpirun) a rank was killed: continue with --restart

Asked for by                           does
    USR1, TERM, XCPU, INT              checkpoint, stop            (a second INT ends at once)
    USR2                               checkpoint, go on
    OUT/stop, any file of that name    checkpoint, stop            (it is removed)
    --walltime T                       checkpoint, stop before T, by the margin
A signal to one rank is enough. It acts at the end of the step: Python sees it when PETSc returns.
mpirun passes USR1 and USR2 on; after TERM it kills its ranks within two seconds, unless it is
started with `--mca odls_base_sigkill_timeout 60` (and then takes that long to exit).
"""

import re
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

DONE, FAILED, BAD_INPUT, DISK, STOPPED = 0, 1, 2, 3, 85

GO_ON, SAVE, STOP = 0, 1, 2
SIGNALS = {signal.SIGUSR2: SAVE, signal.SIGUSR1: STOP, signal.SIGTERM: STOP, signal.SIGXCPU: STOP,
           signal.SIGINT: STOP}
REASONS = ("", "due", "signal", "wall time", "stop file", "until")
STOP_FILE = "stop"
LEAST_MARGIN = 60.0   # s, of wall time


@dataclass
class Session:
    """What the command line asks of this session, and what it has been asked since.

    restart   continue from the newest good checkpoint
    until     stop when this simulated time is reached, s
    walltime  the job's limit, s since `started` (perf_counter at launch)
    margin    stop this much before it; None: 60 s, or twice the longest checkpoint or step
    due       the scene asks for a checkpoint now (rank 0's clock decides)
    """

    started: float
    restart: bool = False
    until: float | None = None
    walltime: float | None = None
    margin: float | None = None
    longest: float = 0.0
    due: bool = False
    pending: int = GO_ON
    _before: dict[int, Any] = field(default_factory=dict)

    def listen(self) -> None:
        """Take the signals over."""
        for number in SIGNALS:
            self._before[number] = signal.signal(number, self._receive)

    def unlisten(self) -> None:
        """Give them back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before.clear()

    def _receive(self, number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGINT and self.pending == STOP:
            raise KeyboardInterrupt
        self.pending = max(self.pending, SIGNALS[signal.Signals(number)])

    def took(self, seconds: float) -> None:
        """A checkpoint or a step took so long: the margin has to hold two of the longest."""
        self.longest = max(self.longest, seconds)

    def ask(self, out: Path, simulated: float, comm: Any) -> tuple[int, str]:
        """GO_ON, SAVE or STOP, the same on every rank, and why; every rank must call it."""
        mine = np.array([self.pending, REASONS.index("signal") if self.pending else 0])
        if comm.rank == 0:
            for action, reason in self._conditions(out, simulated):
                if action > mine[0]:
                    mine[:] = action, REASONS.index(reason)
        self.pending = GO_ON if self.pending == SAVE else self.pending
        code = comm.allreduce(int(mine[0]) * len(REASONS) + int(mine[1]), op=max)
        action, reason = divmod(code, len(REASONS))
        return action, REASONS[reason]

    def _conditions(self, out: Path, simulated: float) -> list[tuple[int, str]]:
        """What rank 0 looks at for all."""
        found = [(SAVE, "due")] if self.due else []
        if self.until is not None and simulated >= self.until * (1 - 1e-12):
            found.append((STOP, "until"))
        if self.walltime is not None:
            margin = max(LEAST_MARGIN, 2 * self.longest) if self.margin is None else self.margin
            if time.perf_counter() - self.started >= self.walltime - margin:
                found.append((STOP, "wall time"))
        if (out / STOP_FILE).exists():
            (out / STOP_FILE).unlink()
            found.append((STOP, "stop file"))
        return found


def seconds_of(text: str) -> float:
    """Seconds in "3h50m", "90m", "45s", "3:50:00" or "5400"; raises ValueError."""
    if re.fullmatch(r"\d+(:\d{1,2}){1,2}", text):
        parts = [float(part) for part in text.split(":")]
        parts += [0.0] * (3 - len(parts))     # H:MM, as in a job script, or H:MM:SS
    else:
        match = re.fullmatch(r"(?:(\d+(?:\.\d+)?)d)?(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m)?"
                             r"(?:(\d+(?:\.\d+)?)s?)?", text)
        if not match or not text:
            raise ValueError(f"{text!r} is no duration; fix: write it as in 3h50m, 3:50:00 or 5400")
        days, *parts = [float(part or 0) for part in match.groups()]
        parts[0] += 24 * days
    return 3600 * parts[0] + 60 * parts[1] + parts[2]
