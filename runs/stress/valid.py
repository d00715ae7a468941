"""Random valid scenes on 1 to 4 ranks: does what has to hold for all of them hold for any?

Each is run whole, again with a stop in the middle and a restart, and on another number of ranks.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomli_w

from runs.stress import compare
from runs.stress.generate import valid_scene
from runs.stress.launch import Job, finish, solve
from runs.stress.result import Result
from solver.files import snapshot_frames

TOLERANCE = 1e-6    # of the largest speed, T or φ, between rank counts, after some ten steps
DIVERGENCE = 1e-7   # |∇·u - φ| of the scale of the flow


@dataclass
class Case:
    """A scene, and where its runs go."""

    number: int
    folder: Path

    @property
    def scene(self) -> Path:
        """Its file."""
        return self.folder / "scene.toml"

    def run(self, ranks: int, name: str, *options: str) -> str:
        """Run it into folder/name; what is wrong, or ""."""
        log = self.folder / f"{name}.log"
        pieces = ("--fragments", str(self.folder / "fragments.h5"))
        code = finish(solve(ranks, self.scene, self.folder / name, *pieces, *options, log=log))
        if code == 0 and "Traceback" not in log.read_text(encoding="utf-8"):
            return "; ".join(compare.broken_files(self.folder / name))
        return f"exit code {code} on {ranks} ranks ({log})"


def main(out: Path, share: float) -> list[Result]:
    """40 scenes (times `share`)."""
    times = max(2, round(40 * share))
    results = [
        Result("random valid scenes on 1 to 4 ranks", f"run to their end, finite, ∇·u = φ to "
               f"{DIVERGENCE:g} of the flow, no particle outside the box", times),
        Result("the same, stopped in the middle and continued on as many ranks", "bitwise the "
               "frames of the run that was not stopped", times),
        Result("the same on another number of ranks", f"velocity, T and φ within {TOLERANCE:g} of "
               "their largest value", times)]
    spread = 0.0
    for number in range(times):
        case = Case(number, out / f"{number:02d}")
        case.folder.mkdir(parents=True)
        tree = valid_scene(number)
        case.scene.write_text(tomli_w.dumps(tree), encoding="utf-8")
        ranks = 1 + number % 4
        found = [problem_of_whole(case, ranks, bool(tree.get("body"))), "", ""]
        if not found[0]:
            found[1] = problem_of_stop(case, ranks, str(0.6 * tree["time"]["end"]))
            found[2], difference = problem_of_ranks(case, 1 + (number + 1) % 4)
            spread = max(spread, difference)
        for result, problem in zip(results, found, strict=True):
            if problem or found[0]:
                result.failures.append(f"{case.folder}: {problem or found[0]}")
    results[2].found = f"largest difference {spread:.1g}"
    return results


def problem_of_whole(case: Case, ranks: int, bodies: bool) -> str:
    """Cut it, run it, and look at what came out."""
    if bodies:
        cut = Job(0, ("-m", "partition", str(case.scene), "-o", str(case.folder / "fragments.h5")),
                  case.folder / "cut.log")
        if finish(cut):
            return f"no fragments ({cut.log})"
    whole = case.folder / "whole"
    if problem := case.run(ranks, "whole"):
        return problem
    lines = (whole / "run.log.jsonl").read_text(encoding="utf-8").splitlines()
    worst = max(json.loads(line)["divergence"] for line in lines)
    if worst > DIVERGENCE:
        return f"divergence {worst:.2g}"
    size = valid_scene(case.number)["domain"]["size"]
    for frame in snapshot_frames(whole):
        for name, values in compare.contents(whole, frame).items():
            if values.dtype.kind == "f" and not np.isfinite(values).all():
                return f"frame {frame}: {name} is not finite"
            if name in ("fuel/position", "soot/position") and (
                    (values < 0) | (values > np.array(size))).any():
                return f"frame {frame}: {name} outside the box"
    return ""


def problem_of_stop(case: Case, ranks: int, until: str) -> str:
    """Stop it and go on."""
    return (case.run(ranks, "stopped", "--until", until) or case.run(ranks, "stopped", "--restart")
            or compare.difference(case.folder / "stopped", case.folder / "whole"))


def problem_of_ranks(case: Case, ranks: int) -> tuple[str, float]:
    """Run it on other ranks; also the largest difference of a field from the first run."""
    if problem := case.run(ranks, "other"):
        return problem, 0.0
    worst, where = 0.0, ""
    whole = case.folder / "whole"
    for frame in snapshot_frames(whole):
        ours, others = (compare.contents(run, frame) for run in (case.folder / "other", whole))
        speed = max(float(np.abs(others[name]).max()) for name in "uvw")
        for name in ("u", "v", "w", "T", "phi"):
            if name in others:
                scale = speed if name in "uvw" else float(np.abs(others[name]).max()) or 1.0
                difference = float(np.abs(ours[name] - others[name]).max()) / scale
                if difference > worst:
                    worst, where = difference, f"frame {frame}, {name}"
    return (f"{where} differs by {worst:.2g}" if worst > TOLERANCE else ""), worst
