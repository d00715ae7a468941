"""Scenes and circumstances meant to break a run: each has one right way to end.

Every case runs on two ranks and has to end by itself within ten seconds of its failure, with the
exit code below and one error line that names what is listed, and leave every named file whole.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from runs.stress.compare import broken_files
from runs.stress.launch import Job, Lasting, finish, solve, wait_for
from runs.stress.result import Result
from solver.files import checkpoint_paths

BASE = """
[domain]
cells = [12, 12, 16]
[time]
end = 0.04
frame = 0.01
dt_max = 2e-3
[initial]
noise = 0.3
T = "5 + 50*exp(-((x-0.5)**2+(y-0.5)**2)/0.02)"
[output]
precision = "float64"
"""
FIRE = ("fuel.particles=500", "fuel.ignited=500", "fuel.mass=1e-3", "fuel.burn_rate=0.04",
        "fuel.gas=0.5", "fuel.heat=3.0")


@dataclass(frozen=True)
class Case:
    """overrides of BASE, the exit code and the words of the message; `prepare` gets OUT first."""

    name: str
    overrides: tuple[str, ...]
    code: int
    words: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    prepare: Callable[[Path], None] = lambda out: None


def _spoil_checkpoint(out: Path) -> None:
    newest = checkpoint_paths(out)[-1]
    data = bytearray(newest.read_bytes())
    data[len(data) // 2] ^= 0xff
    newest.write_bytes(data)


def _foreign_checkpoint(out: Path) -> None:
    checkpoint_paths(out)[-1].write_bytes(b"no HDF5 file")


CASES = (
    Case("hurricane: 10⁴ box lengths per second", ("initial.noise=1e4", "time.end=2e-6",
                                                   "time.frame=1e-6"), 0),
    Case("still air", ("initial.noise=0.0", 'initial.T="5"'), 0),
    Case("every fuel particle at one point", (*FIRE, "detonation.radius=0.0"), 0),
    Case("all the fuel burns in a thousandth of a second", (*FIRE, "fuel.burn_rate=1.0"), 0),
    Case("all the fuel burns in 10⁻¹² s", (*FIRE, "fuel.burn_rate=1e9"), 1, ("collapsed", "fix")),
    Case("fire a thousand times as hot as the scale of cooling",
         (*FIRE, "fuel.heat=3e6", "fluid.cooling=1e6"), 0),
    Case("heat exchange 10⁹ times too fast", (*FIRE, "fuel.heat_transfer=2e14",
                                              'fuel.exchange="two_way"'), 0),
    Case("drag 10⁹ times too strong", (*FIRE, "fuel.drag=1e9"), 0),
    Case("cells 1 : 1000", ("domain.size=[1.0, 0.001, 1.0]", "time.end=1e-4",
                            "time.frame=5e-5"), 0),
    Case("particle cap reached", (*FIRE, "fuel.rate=1e6", "fuel.cap=600"), 0),
    Case("a value that is no number at the start", ('initial.u="sqrt(0.5-z)"',), 2,
         ("not finite", "rank 1", "fix")),
    Case("a force that is no number on one rank", (
        'fluid.force=["sqrt(0.5-z)", "0", "0"]',), 1, ("stage force", "step 0", "rank 1")),
    Case("a force that turns into no number later", (
        'fluid.force=["sqrt(0.015-t)", "0", "0"]',), 1, ("stage force", "step")),
    Case("a force that overflows", ('fluid.force=["1e308*x", "1e308", "0"]',), 1,
         ("stage", "step 0")),
    Case("gas so fast that no step is short enough", (*FIRE, "fuel.gas=1e20"), 1, ("step",)),
    Case("more memory than the machine has", ("domain.cells=[4096, 4096, 4096]",), 2,
         ("memory", "fix")),
    Case("more ranks than cells", ("domain.cells=[4, 1, 2]",), 2, ("cells", "fix")),
    Case("a folder that holds a run", (), 2, ("holds a run", "--overwrite"), ("again",)),
    Case("a newest checkpoint with one changed byte", (), 0, (), ("restart",), _spoil_checkpoint),
    Case("a newest checkpoint that is no HDF5 file", (), 0, (), ("restart",), _foreign_checkpoint),
    Case("a restart on another grid", ("domain.cells=[8, 8, 8]",), 2,
         ("domain.cells", "fix"), ("restart",)),
)


def main(out: Path, share: float) -> list[Result]:
    """Every case; `share` below 1 takes the first, and so on."""
    cases = CASES[:max(3, round(len(CASES) * share))]
    result = Result("scenes and circumstances meant to break a run on 2 ranks (overflow, no number "
                    "on one rank, collapse of dt, damaged or foreign files, too large, ...)",
                    "the documented exit code; one error line that names stage, step, rank or "
                    "file; ended within 10 s; files whole", len(cases))
    scene, started = out / "scene.toml", out / "started"
    out.mkdir(parents=True)
    scene.write_text(BASE, encoding="utf-8")
    for number, case in enumerate(cases):
        mine, log = out / f"{number:02d}", out / f"{number:02d}.log"
        options = ["--set=" + override for override in case.overrides]
        if case.options:
            finish(solve(2, scene, mine, "--until", "0.02", log=started.with_suffix(".log")))
            if case.options != ("again",):
                options.append("--restart")
            case.prepare(mine)
        problem = judge(case, solve(2, scene, mine, *options, log=log), mine)
        if problem:
            result.failures.append(f"{case.name}: {problem} ({log})")
    return [result]


def judge(case: Case, job: Job, out: Path) -> str:
    """What is wrong with how it ended."""
    wait_for(lambda: "error: " in job.output() or not job.running, 120)
    failed = time.monotonic()
    wait_for(lambda: len(job.pids()) < 1 or not job.running, 10)
    try:
        code = job.end(max(0.1, 10 - (time.monotonic() - failed)) if case.code else 120)
    except Lasting as lasting:
        return f"after its failure: {lasting}"
    said = job.output()
    problems = [f"exit code {code}"] if code != case.code else []
    errors = [line for line in said.splitlines() if line.startswith("error:")]
    if len(errors) != (case.code != 0):
        problems.append(f"{len(errors)} error lines")
    problems += [f"{word!r} is not in the message" for word in case.words
                 if not any(word in line for line in errors)]
    problems += ["a traceback"] * ("Traceback" in said)
    return "; ".join(problems + broken_files(out))
