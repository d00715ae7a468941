"""Does a long run grow? Resident memory and open files of every rank from step 500 to step 5000.

Fuel is emitted, burns, makes soot and disappears at the same rates throughout, a body flies, frames
are written and checkpoints too, so that whatever a step, a frame or a checkpoint leaves behind adds
up some thousand times.
"""

import json
import os
import time
from pathlib import Path

from runs.stress.launch import Job, finish, solve
from runs.stress.result import Result

RANKS = 2
FROM, FRAME, GROWTH = 500, 100, 0.02   # steps; status.json tells each frame
Sample = list[tuple[int, int]]   # of each rank: bytes of memory, open files
PAGE = os.sysconf("SC_PAGE_SIZE")
SCENE = """
[domain]
cells = [20, 20, 20]
[time]
end = {end}
frame = 0.02
integrator = "rk2"
dt_max = 2e-4
[fluid]
cooling = 500.0
vorticity_confinement = 0.1
buoyancy = 0.01
[initial]
noise = 0.2
[detonation]
position = [0.5, 0.4, 0.5]
fill = "ball"
[fuel]
particles = 1000
ignited = 1000
mass = 1e-5
burn_rate = 4e-4
gas = 0.5
heat = 3.0
rate = 4e4
cap = 1000000
[soot]
threshold = 4e-6
burn_rate = 4e-4
[[body]]
name = "ball"
shape = "sphere"
radius = 0.08
place = [0.5, 0.7, 0.5]
density = 10.0
detail = 2
[output]
checkpoint_every = 2.0
"""


def main(out: Path, share: float) -> list[Result]:
    """5000 steps (times `share`, but at least up to twice step 500)."""
    steps = max(2 * FROM, round(5000 * share))
    out.mkdir(parents=True)
    scene, fragments, log = out / "scene.toml", out / "fragments.h5", out / "run.log"
    scene.write_text(SCENE.format(end=(steps + FRAME) * 2e-4), encoding="utf-8")   # one frame more
    if finish(Job(0, ("-m", "partition", str(scene), "-o", str(fragments)), out / "cut.log")):
        raise RuntimeError(f"no fragments: {out / 'cut.log'}")
    job = solve(RANKS, scene, out / "run", "--fragments", str(fragments), log=log)
    samples: dict[int, list[Sample]] = {}
    while job.running:
        step = step_of(out / "run" / "status.json")
        sample = [(resident(pid), open_files(pid)) for pid in job.pids()]
        if len(sample) == RANKS and all(memory > 0 for memory, _ in sample):
            samples.setdefault(step, []).append(sample)
        time.sleep(0.1)
    return [judge(samples, steps, finish(job), log)]


def judge(samples: dict[int, list[Sample]], steps: int, code: int, log: Path) -> Result:
    """Compare each rank at the end with itself at step 500."""
    result = Result(f"a soak of {steps} steps on {RANKS} ranks: fire, soot, a body, frames, "
                    "checkpoints", f"at step {steps} every rank's resident memory is within 2 % of "
                    f"that at step {FROM}, and as many files are open", RANKS)
    if code or FROM not in samples or steps not in samples:
        result.failures = [f"exit code {code}, sampled at {sorted(samples)} ({log})"] * RANKS
        return result
    first, last = _over(samples[FROM]), _over(samples[steps])
    for rank, ((memory, files), (memory_then, files_then)) in enumerate(zip(last, first,
                                                                            strict=True)):
        if abs(memory / memory_then - 1) > GROWTH or files != files_then:
            result.failures.append(f"rank {rank}: {memory_then} to {memory} bytes, {files_then} to "
                                   f"{files} files ({log})")
    changes = ", ".join(f"{100 * (now[0] / then[0] - 1):+.2f} %"
                        for then, now in zip(first, last, strict=True))
    result.found = (f"memory {changes} (of {first[0][0] / 1e6:.0f} MB); "
                    f"{', '.join(str(files) for _, files in last)} files open")
    return result


def _over(samples: list[Sample]) -> Sample:
    """Of each rank, the most memory and the fewest files: one may be in the making."""
    return [(max(memory for memory, _ in of_rank), min(files for _, files in of_rank))
            for of_rank in zip(*samples, strict=True)]


def step_of(status: Path) -> int:
    """The step that a run's status.json tells."""
    try:
        return int(json.loads(status.read_text(encoding="utf-8"))["step"])
    except (OSError, ValueError, KeyError):
        return 0


def resident(pid: int) -> int:
    """Bytes of memory that a process has."""
    try:
        return PAGE * int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return 0


def open_files(pid: int) -> int:
    """Files, sockets and pipes that a process holds open."""
    try:
        return len(os.listdir(f"/proc/{pid}/fd"))
    except OSError:
        return 0
