"""The run that is killed, signalled and starved of disk: fire, soot and a pane that breaks.

It is made once as it should be, without disturbance, to be compared with afterwards.
"""

import time
from dataclasses import dataclass
from pathlib import Path

from runs.stress.launch import Job, finish, solve, wait_for
from solver.files import snapshot_frames

RANKS = 2
FIRE = """
[domain]
cells = [16, 14, 12]
[time]
end = 0.06
frame = 0.01
integrator = "rk2"
dt_max = 2e-4
[initial]
noise = 0.3
[fuel]
particles = 300
ignited = 100
mass = 1e-3
burn_rate = 0.04
gas = 0.5
heat = 3.0
rate = 500.0
[output]
precision = "float64"
checkpoint_every = 0.05
"""
SCENE = FIRE.replace("rate = 500.0", "rate = 500.0\nheat_transfer = 5e4") + """
[soot]
threshold = 4e-4
burn_rate = 1e-2
min_mass = 1e-8
[[body]]
name = "pane"
shape = "pane"
size = [0.4, 0.4, 0.02]
place = [0.5, 0.5, 0.7]
areal_density = 2.0
points = 30
fracture = { pieces = 4 }
deform_until = { time = 0.03 }
"""


@dataclass
class Blast:
    """scene, fragments  files;  whole: folder of the undisturbed run;  starting, stepping: s of
    it before and after the first snapshot"""

    scene: Path
    fragments: Path
    whole: Path
    starting: float = 0.0
    stepping: float = 0.0

    def solve(self, out: Path, *options: str, log: Path) -> Job:
        """Start it into another folder."""
        return solve(RANKS, self.scene, out, "--fragments", str(self.fragments), *options, log=log)


def undisturbed(out: Path) -> Blast:
    """Write the scene into a new folder, cut the pane, and run it."""
    out.mkdir(parents=True)
    blast = Blast(out / "scene.toml", out / "fragments.h5", out / "whole")
    blast.scene.write_text(SCENE, encoding="utf-8")
    cut = Job(0, ("-m", "partition", str(blast.scene), "-o", str(blast.fragments)), out / "cut.log")
    if finish(cut):
        raise RuntimeError(f"no fragments: {cut.log}")
    job = blast.solve(blast.whole, log=out / "whole.log")
    wait_for(lambda: bool(snapshot_frames(blast.whole)) or not job.running, 120)
    first = time.monotonic()
    if finish(job):
        raise RuntimeError(f"the undisturbed run fails: {job.log}")
    blast.starting, blast.stepping = first - job.started, time.monotonic() - first
    return blast
