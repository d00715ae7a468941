"""What a run says: lines for people, lines for programs, and its state in one small file.

    run.log        one line per step
    run.log.jsonl  the same numbers, one JSON object per step
    status.json    running, done or failed; replaced as a whole, so it is never half written
Only rank 0 writes.
"""

import json
import os
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from solver.monitor import Report


class Journal:
    """The log files of one run, and the lines on the terminal."""

    def __init__(self, directory: Path, active: bool, per_step: bool):
        self.directory = directory
        self.active = active
        self.per_step = per_step
        self.start = time.perf_counter()
        if active:
            self.lines = open(directory / "run.log", "w", encoding="utf-8")
            self.objects = open(directory / "run.log.jsonl", "w", encoding="utf-8")

    def say(self, text: str) -> None:
        """A line on the terminal and in run.log."""
        if self.active:
            print(text, flush=True)
            self.lines.write(text + "\n")

    def step(self, state: Any, reason: str, report: Report, seconds: float) -> None:
        """One step: dt and its reason, iterations, divergence error, time."""
        if not self.active:
            return
        line = (f"step {state.step:6d}  t {state.time:.6e}  dt {state.dt:.3e} ({reason})  "
                f"iterations {state.iterations}  divergence {report.divergence:.1e}")
        if state.swarm is not None:
            line += f"  fuel {report.fuel} ({report.burning} lit)  soot {report.soot}"
        line += f"  {1e3 * seconds:.2f} ms"
        self.lines.write(line + "\n")
        if self.per_step:
            print(line, flush=True)
        self.objects.write(json.dumps({
            "step": state.step, "time": state.time, "dt": state.dt, "reason": reason,
            "iterations": state.iterations, **asdict(report), "seconds": seconds}) + "\n")

    def status(self, condition: str, **more: Any) -> None:
        """Replace status.json."""
        if not self.active:
            return
        self.lines.flush()
        self.objects.flush()
        path = self.directory / "status.json"
        temporary = path.with_name("status.json.tmp")
        temporary.write_text(json.dumps({"state": condition, **more}, indent=1) + "\n",
                             encoding="utf-8")
        os.replace(temporary, path)

    def close(self) -> None:
        """Close the files."""
        if self.active:
            self.lines.close()
            self.objects.close()
