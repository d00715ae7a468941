"""Damaged scenes: one clear error or a run, never a traceback, a hang, or a word to the system.

Every scene of the project is damaged (`fuzz`) and given to the solver, every fifth to partition and
every fifth to the renderer. Each must end in time with a documented exit code, print no traceback,
say at most one error, and write, move, remove or start nothing outside its folder (`watched`).
"""

import os
import tomllib
from pathlib import Path

import numpy as np

from runs.stress import blast, fuzz
from runs.stress.launch import Job, Lasting
from runs.stress.result import Result

ROOT = Path(__file__).resolve().parents[2]
CODES = {0, 1, 2, 3, 85}
LIMIT = 120.0     # s
CLOCK = ("--walltime", "4s", "--walltime-margin", "0s")   # a valid scene may be a long one
FAULTS = ("Traceback", "Segmentation", "Caught signal")


def main(out: Path, share: float) -> list[Result]:
    """200 damaged scenes (times `share`)."""
    times, random = max(10, round(200 * share)), np.random.default_rng(7)
    texts = valid_scenes()
    result = Result("damaged scenes: mistakes in the text, junk values, hostile formulas and paths",
                    "ends in time with a documented exit code; one error line, no traceback; "
                    "nothing written, moved, removed or started outside OUT", times)
    codes: dict[int, int] = {}
    for number in range(times):
        text = texts[number % len(texts)]
        folder = out / f"{number:03d}"
        folder.mkdir(parents=True)
        (folder / "scene.toml").write_bytes(
            fuzz.damaged(text, tomllib.loads(text), random))
        problem, code = attempt(folder, ("solver", "solver", "solver", "partition",
                                         "render")[number // len(texts) % 5])
        codes[code] = codes.get(code, 0) + 1
        if problem:
            result.failures.append(f"{folder / 'scene.toml'}: {problem}")
    result.found = "exit codes " + ", ".join(f"{code}: {count} ×"
                                             for code, count in sorted(codes.items()))
    return [result]


def valid_scenes() -> list[str]:
    """The scenes to damage."""
    paths = [*(ROOT / "runs" / "scenes").glob("*.toml"), *(ROOT / "runs" / "exact").glob("*.toml")]
    texts = [path.read_text(encoding="utf-8") for path in sorted(paths)
             if "answer" not in path.name]
    return [*texts, *[blast.SCENE] * 4]


def attempt(folder: Path, program: str) -> tuple[str, int]:
    """Run a program on folder/scene.toml; what is wrong with how it ended, and its exit code."""
    harm, log = folder / "harm", folder / "log"
    out = folder / "out"
    out.mkdir()
    scene = str(folder / "scene.toml")
    arguments = {"solver": ("solver", scene, "-o", str(out), *CLOCK),
                 "partition": ("partition", scene, "-o", str(out / "fragments.h5")),
                 "render": ("render", str(out), "--scene", scene, "-o", str(out / "frames"))}
    before = listing(folder)
    job = Job(0, ("-m", "runs.stress.watched", str(harm), str(out), *arguments[program]), log)
    try:
        job.pids()
        code = job.end(LIMIT)
    except Lasting as lasting:
        return str(lasting), -1
    said = job.output()
    problems = [fault for fault in FAULTS if fault in said]
    if code not in CODES:
        problems.append(f"exit code {code}")
    if sum(line.startswith(("error:", "python -m")) for line in said.splitlines()) > 1:
        problems.append("more than one error")
    if code and code != 85 and "error:" not in said:
        problems.append("no error is told")
    problems += harm.read_text(encoding="utf-8").splitlines()
    problems += [f"made {name}" for name in listing(folder) - before
                 if name not in ("harm", "log") and not name.startswith("out")]
    if (ROOT / fuzz.TRAP).exists() or Path(fuzz.TRAP).exists():
        problems.append("a text of the scene was executed")
    return "; ".join(problems), code


def listing(folder: Path) -> set[str]:
    """Every path below a folder."""
    return {os.path.relpath(os.path.join(base, name), folder)
            for base, folders, files in os.walk(folder) for name in (*folders, *files)}
