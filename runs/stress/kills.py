"""kill -9 at a random moment: is what was finished whole, and does the run go on as if unharmed?

One rank, mpirun, or all of them are killed, four times in five at any moment from the first
snapshot to the end, else while the program starts; then every file that has its name is opened and
compared with its checksum, and --restart has to end in the snapshots of the run that nobody killed,
bit for bit.
"""

import time
from collections import Counter
from pathlib import Path

import numpy as np

from runs.stress.blast import RANKS, Blast, undisturbed
from runs.stress.compare import broken_files, count_files, difference
from runs.stress.launch import GONE, KILLABLE, Job, Lasting, finish, wait_for
from runs.stress.result import Result
from solver.files import snapshot_frames


def main(out: Path, share: float) -> list[Result]:
    """50 kills (times `share`)."""
    times, random = max(3, round(50 * share)), np.random.default_rng(12)
    blast = undisturbed(out)
    result = Result("kill -9 of one rank, of mpirun, of all, at random moments, then `--restart`",
                    "every named file opens and has its checksum; all ranks end within 10 s; the "
                    "frames are bitwise those of the run never stopped", times)
    caught: Counter[str] = Counter()
    files, slowest = 0, 0.0
    for number in range(times):
        victim, mine = KILLABLE[number % len(KILLABLE)], out / f"{number:02d}"
        log, problem = out / f"{number:02d}.log", ""
        job = blast.solve(mine, "--restart", log=log)
        wait_for_moment(job, blast, mine, number % 5 == 0, random)
        caught[victim] += job.running
        job.kill(victim, random)
        killed = time.monotonic()
        try:
            job.end(GONE)
            slowest = max(slowest, time.monotonic() - killed)
        except Lasting as lasting:
            problem = f"after the kill: {lasting}"
        files += count_files(mine)
        problem = problem or "; ".join(broken_files(mine))
        if not problem and (code := finish(blast.solve(mine, "--restart", log=log))):
            problem = f"the restart ended with exit code {code}"
        problem = problem or difference(mine, blast.whole)
        if problem:
            result.failures.append(f"{number}, {victim}: {problem} ({log})")
    result.found = (", ".join(f"{count} × {victim}" for victim, count in sorted(caught.items()))
                    + f" caught running; {files} files verified; slowest end {slowest:.1f} s")
    return [result]


def wait_for_moment(job: Job, blast: Blast, out: Path, at_start: bool,
                    random: np.random.Generator) -> None:
    """A random moment while it starts, or else after its first snapshot."""
    wait_for(lambda: len(job.pids()) == RANKS or not job.running, 60)
    if not at_start:
        wait_for(lambda: bool(snapshot_frames(out)) or not job.running, 120)
    duration = blast.starting if at_start else blast.stepping
    wait_for(lambda: not job.running, 0.9 * duration * random.random())
