"""Asked to stop or to save, in every documented way: checkpoint, exit code, and the same end."""

import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from runs.stress.blast import RANKS, Blast, undisturbed
from runs.stress.compare import broken_files, difference
from runs.stress.launch import Job, Lasting, finish, send, wait_for
from runs.stress.result import Result
from solver.files import checkpoint_paths, snapshot_frames

STOPPED = 85


@dataclass(frozen=True)
class Way:
    """How to ask, the exit code that must follow, and the options of the run."""

    name: str
    ask: Callable[[Job, Path], None] | None
    code: int = STOPPED
    options: tuple[str, ...] = ()


def _rank(number: signal.Signals) -> Callable[[Job, Path], None]:
    return lambda job, out: send(job.pids()[-1], number)


def _mpirun(number: signal.Signals) -> Callable[[Job, Path], None]:
    return lambda job, out: send(job.process.pid, number)


WAYS = (*(Way(f"{number.name} to one rank", _rank(number)) for number in (
            signal.SIGUSR1, signal.SIGTERM, signal.SIGXCPU, signal.SIGINT)),
        Way("SIGUSR2 to one rank", _rank(signal.SIGUSR2), 0),
        Way("SIGUSR1 to mpirun", _mpirun(signal.SIGUSR1)),
        Way("SIGUSR2 to mpirun", _mpirun(signal.SIGUSR2), 0),
        Way("the stop file", lambda job, out: (out / "stop").touch()),
        Way("--walltime", None, STOPPED, ("--walltime", "1h", "--walltime-margin", "3600s")),
        Way("--until", None, 0, ("--until", "0.035")))


def main(out: Path, share: float) -> list[Result]:
    """Every way (the first of them for a `share` below 1)."""
    ways = WAYS[:max(2, round(len(WAYS) * share))]
    blast = undisturbed(out)
    result = Result("USR1, USR2, TERM, XCPU, INT to one rank, USR1, USR2 to mpirun, stop file, "
                    "`--walltime`, `--until`; then `--restart`", "a checkpoint; exit code 85 (0 "
                    "for USR2 and `--until`); the frames are bitwise those of the run never "
                    "stopped", len(ways))
    for number, way in enumerate(ways):
        problem = judge(blast, way, out / f"{number:02d}", out / f"{number:02d}.log")
        if problem:
            result.failures.append(f"{way.name}: {problem} ({out / f'{number:02d}.log'})")
    return [result]


def judge(blast: Blast, way: Way, out: Path, log: Path) -> str:
    """Ask it, look, and let it go on."""
    job = blast.solve(out, *way.options, log=log)
    wait_for(lambda: len(job.pids()) == RANKS or not job.running, 60)
    if way.ask is not None:
        wait_for(lambda: len(snapshot_frames(out)) > 1 or not job.running, 120)
        before = len(log.read_text(encoding="utf-8").split("checkpoint chk_"))
        way.ask(job, out)
        if way.code == 0:
            wait_for(lambda: len(log.read_text(encoding="utf-8").split("checkpoint chk_")) > before,
                     60)
    try:
        code = job.end(60)
    except Lasting as lasting:
        return str(lasting)
    if code != way.code or not checkpoint_paths(out):
        return f"exit code {code}, {len(checkpoint_paths(out))} checkpoints"
    problem = "; ".join(broken_files(out))
    if not problem and (code := finish(blast.solve(out, "--restart", log=log))):
        problem = f"the restart ended with exit code {code}"
    return problem or difference(out, blast.whole)
