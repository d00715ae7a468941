"""What does the fire cost that is not shown? The window with its volume and without, side by side.

    python -m runs bench volume [SCENE] [key=value ...]     (default: window time.end=0.2)

"shown" stores the temperature and the particles of every frame and renders fire and smoke; "hidden"
has output.fields = [], output.particles = false and render.volume.visible = false. Both simulate
the same flow. Prints seconds per frame of the simulation, of its writing and of the rendering, the
bytes of a snapshot and the largest memory of a process, and writes results/volume.csv.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from runs import chain

SCENES = Path(__file__).parent.parent / "scenes"
RESULTS = Path(__file__).parent / "results"
HIDDEN = ("output.fields=[]", "output.particles=false", "render.volume.visible=false")
COLUMNS = ("volume", "simulated s/frame", "of it writing", "rendered s/frame", "snapshot MB",
           "solver MB", "render MB")


def main(argv: list[str]) -> int:
    """Run both; returns an exit code."""
    names = [word for word in argv if "=" not in word] or ["window"]
    changes = [word for word in argv if "=" in word] or ["time.end=0.2"]
    rows = [measure(SCENES / f"{names[0]}.toml", kind, [*changes, *more])
            for kind, more in (("shown", ()), ("hidden", HIDDEN))]
    lines = [",".join(COLUMNS)] + [",".join([row[0], *(f"{x:.3g}" for x in row[1:])])
                                   for row in rows]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "volume.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))
    return 0


def measure(scene: Path, kind: str, changes: list[str]) -> tuple[Any, ...]:
    """A row of the table: one run from nothing, in a folder that is thrown away."""
    sets = [part for change in changes for part in ("--set", change)]
    mpirun = ("mpirun", "--oversubscribe", "-n", str(chain.default_ranks()))
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        pieces = str(out / "fragments.h5")
        run((sys.executable, "-m", "partition", str(scene), *sets, "-o", pieces))
        _, solver = run((*mpirun, sys.executable, "-m", "solver", str(scene), *sets, "-o", folder,
                         "--fragments", pieces))
        film = (*mpirun, sys.executable, "-m", "render", folder, "--scene", str(scene), *sets)
        first, _ = run((*film, "--frames", "0", "-o", str(out / "warm")))
        seconds, render = run(film)
        status = json.loads((out / "status.json").read_text(encoding="utf-8"))
        snapshots = [path.stat().st_size for path in (out / "snapshots").glob("*.h5")]
        frames = len(snapshots)
        return (kind, status["seconds"] / frames, status["writing_seconds"] / frames,
                (seconds - first) / (frames - 1), sum(snapshots) / frames / 1e6, solver, render)


def run(command: tuple[str, ...]) -> tuple[float, float]:
    """Seconds that a command took, and the largest memory of one of its processes, MB."""
    script = ("import resource, subprocess, sys\n"
              "code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode\n"
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\nsys.exit(code)")
    environment = os.environ | {name: "1" for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS")}
    if os.geteuid() == 0:
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    start = time.perf_counter()
    done = subprocess.run((sys.executable, "-c", script, *command), check=True, text=True,
                          stdout=subprocess.PIPE, env=environment)
    return time.perf_counter() - start, float(done.stdout) / 1024
