"""What a run says: lines for people, lines for programs, and its state in one small file.

    run.log        one line per step
    run.log.jsonl  the same numbers, one JSON object per step
    status.json    running, stopped, done or failed; replaced as a whole, so never half written
Only rank 0 writes. A session that continues a run writes on where its checkpoint stands; a log that
cannot be written (a full disk) is said once and ends no run.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any

from solver.files_whole import replacing
from solver.monitor import Report


class Journal:
    """The log files of one run, and the lines on the terminal."""

    def __init__(self, directory: Path, active: bool, per_step: bool, append: bool = False):
        self.directory = directory
        self.active = active
        self.per_step = per_step
        self.broken = False
        self.files: list[IO[str]] = []
        if active:
            mode = "a" if append else "w"
            self.files = [open(directory / name, mode, encoding="utf-8")
                          for name in ("run.log", "run.log.jsonl")]

    def rewind(self, step: int) -> None:
        """Forget the objects of steps after `step`: they will be made again."""
        if self.active:
            path = self.directory / "run.log.jsonl"
            lines = path.read_text(encoding="utf-8").splitlines()
            kept = [line for line in lines if _step_of(line) <= step]
            try:
                with replacing(path) as temporary:
                    temporary.write_text("".join(line + "\n" for line in kept), encoding="utf-8")
            except OSError as error:
                self._complain(error)
            self.files[1].close()
            self.files[1] = open(path, "a", encoding="utf-8")

    def say(self, text: str) -> None:
        """A line on the terminal and in run.log."""
        if self.active:
            print(text, flush=True)
            self._write(0, text)

    def step(self, state: Any, reason: str, report: Report, seconds: float) -> None:
        """One step: dt and its reason, iterations, divergence error, time."""
        if not self.active:
            return
        line = (f"step {state.step:6d}  t {state.time:.6e}  dt {state.dt:.3e} ({reason})  "
                f"iterations {state.iterations}  divergence {report.divergence:.1e}")
        if state.swarm is not None:
            line += f"  fuel {report.fuel} ({report.burning} lit)  soot {report.soot}"
        line += f"  {1e3 * seconds:.2f} ms"
        self._write(0, line)
        if self.per_step:
            print(line, flush=True)
        self._write(1, json.dumps({
            "step": state.step, "time": state.time, "dt": state.dt, "reason": reason,
            "iterations": state.iterations, **asdict(report), "seconds": seconds}))

    def status(self, condition: str, **more: Any) -> None:
        """Replace status.json."""
        if not self.active:
            return
        try:
            self.flush()
            with replacing(self.directory / "status.json") as temporary:
                temporary.write_text(json.dumps({"state": condition, **more}, indent=1) + "\n",
                                     encoding="utf-8")
        except OSError as error:
            self._complain(error)

    def flush(self) -> None:
        """Let the files hold all that was said: a checkpoint that counts on it follows."""
        for file in self.files:
            try:
                file.flush()
            except OSError as error:
                self._complain(error)

    def close(self) -> None:
        """Close the files."""
        for file in self.files:
            try:
                file.close()
            except OSError as error:
                self._complain(error)

    def _write(self, index: int, line: str) -> None:
        if self.files:
            try:
                self.files[index].write(line + "\n")
            except OSError as error:
                self._complain(error)

    def _complain(self, error: OSError) -> None:
        if not self.broken:
            print(f"warning: {self.directory}: the log cannot be written ({error.strerror})",
                  file=sys.stderr, flush=True)
        self.broken = True


def _step_of(line: str) -> float:
    try:
        return float(json.loads(line)["step"])
    except (ValueError, KeyError, TypeError):
        return float("inf")   # the half line of a killed run
