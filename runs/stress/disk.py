"""A disk that fills up: a tmpfs of a few hundred kB, made larger afterwards (needs root)."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from runs.stress.blast import Blast, undisturbed
from runs.stress.compare import broken_files, count_files, difference
from runs.stress.launch import finish
from runs.stress.result import Result

SIZES = (200, 400, 600, 800, 1000, 1200, 1500, 2000)     # kB; the run takes about 2500
DISK = 3


def main(out: Path, share: float) -> list[Result]:
    """A run on each disk (the first of them for a `share` below 1)."""
    sizes = SIZES[:max(2, round(len(SIZES) * share))]
    result = Result("a full disk: a tmpfs of " + ", ".join(map(str, sizes)) + " kB; then a larger "
                    "one and `--restart`", "exit code 3, one error line; earlier files whole; the "
                    "frames are bitwise those of the run never stopped", len(sizes))
    if os.geteuid() != 0:
        result.tried, result.found = 0, "needs root, to mount a tmpfs"
        return [result]
    blast, files = undisturbed(out), 0
    for size in sizes:
        with tmpfs(out / f"{size:04d}", size) as mounted:
            problem = judge(blast, mounted, out / f"{size:04d}.log")
            files += count_files(mounted / "run")
        if problem:
            result.failures.append(f"{size} kB: {problem} ({out / f'{size:04d}.log'})")
    result.found = f"{files} files verified"
    return [result]


def judge(blast: Blast, mounted: Path, log: Path) -> str:
    """Run until it is full, make room, go on."""
    out = mounted / "run"
    job = blast.solve(out, log=log)
    code = finish(job)
    errors = [line for line in job.output().splitlines() if line.startswith("error:")]
    if code != DISK or len(errors) != 1 or "Traceback" in job.output():
        return f"exit code {code}, {len(errors)} error lines"
    if problem := "; ".join(broken_files(out)):
        return problem
    subprocess.run(["mount", "-o", "remount,size=64m", str(mounted)], check=True)
    if code := finish(blast.solve(out, "--restart", log=log)):
        return f"the restart ended with exit code {code}"
    return difference(out, blast.whole)


@contextmanager
def tmpfs(path: Path, size: int) -> Iterator[Path]:
    """A disk of `size` kB."""
    path.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "brisance-stress", str(path)],
                   check=True)
    try:
        yield path
    finally:
        subprocess.run(["umount", "-l", str(path)], check=True)
