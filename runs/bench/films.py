"""What do the films of the gallery cost, and what does fire cost that is not shown?

    python -m runs bench films cost [NAME ...]     seconds per simulated and per rendered frame
    python -m runs bench films volume              the window with its volume and without

cost    simulates the whole film and renders some eight frames of it, evenly spread, on one core;
        seconds are those of the processor, so that a busy machine measures the same, and without
        the start of the programs: what more frames take than few.
volume  "shown" stores temperature and particles and renders fire and smoke, "hidden" has
        output.fields = [], output.particles = false and render.volume.visible = false; both
        simulate the same flow, until t = 0.2. Memory is the largest that a program had.

Writes results/films_cost.csv and results/films_volume.csv.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from runs import films
from runs.bench import chart
from runs.ranks import environment
from solver import scene as scenes
from solver.files import snapshot_frames

RESULTS = Path(__file__).parent / "results"
HIDDEN = ("output.fields=[]", "output.particles=false", "render.volume.visible=false")
COLUMNS = ("film", "frames", "steps", "simulated s/frame", "of it writing", "rendered s/frame",
           "snapshot MB", "solver MB", "render MB")
RENDERED = 8


def main(argv: list[str]) -> int:
    """Run one of the two; returns an exit code."""
    names = argv[1:] or films.NAMES
    if argv[:1] == ["volume"]:
        short = ("time.end=0.2",)
        rows = [measure("window", "shown", short), measure("window", "hidden", short + HIDDEN)]
    elif argv[:1] == ["cost"] and set(names) <= set(films.NAMES):
        rows = [measure(name, name, ()) for name in names]
    else:
        print("bench films: fix: volume, or cost and some of " + ", ".join(films.NAMES))
        return 2
    write(RESULTS / f"films_{argv[0]}.csv", rows, f"python -m runs bench films {argv[0]}")
    return 0


def write(path: Path, rows: list[list[str]], command: str) -> None:
    """Print the rows and put them in place of their like in the table."""
    known = []
    if path.is_file():
        lines = path.read_text("utf-8").splitlines()[2:]   # after the command and the heading
        known = [line.split(",") for line in lines]
    rows = list({row[0]: row for row in [*known, *rows]}.values())
    path.parent.mkdir(exist_ok=True)
    chart.write_csv(path, ",".join(COLUMNS), rows, command)
    print(path.read_text("utf-8"))


def measure(name: str, label: str, changes: Sequence[str]) -> list[str]:
    """A row: one run from nothing, in a folder that is thrown away."""
    path = films.SCENES / f"{name}.toml"
    scene = scenes.load(path, changes)
    chosen = [part for change in changes for part in ("--set", change)]
    python = (sys.executable, "-m")
    with tempfile.TemporaryDirectory() as folder:
        out, short = Path(folder) / "film", Path(folder) / "start"
        pieces = str(Path(folder) / "fragments.h5")
        run((*python, "partition", str(path), *chosen, "-o", pieces))
        solver = (*python, "solver", str(path), *chosen, "--fragments", pieces)
        start, _ = run((*solver, "--set", f"time.end={scene.time.frame}", "-o", str(short)))
        whole, memory = run((*solver, "-o", str(out)))
        status = json.loads((out / "status.json").read_text(encoding="utf-8"))
        count = len(snapshot_frames(out))
        simulated = (whole - start) / (count - 2)
        written = simulated * status["writing_seconds"] / status["seconds"]
        stored = sum(p.stat().st_size for p in (out / "snapshots").glob("*.h5")) / count / 1e6
        rendered, pictures = 0.0, 0.0
        if scene.render is not None:
            film = (*python, "render", str(out), "--scene", str(path), *chosen)
            rendered, pictures = rendering(film, out, count)
    numbers = (simulated, written, rendered, stored, memory, pictures)
    return [label, str(count), str(status["step"]), *(f"{x:.3g}" for x in numbers)]


def rendering(film: Sequence[str], out: Path, count: int) -> tuple[float, float]:
    """Seconds per frame, from what more frames take than one; and memory, MB."""
    step = max(1, count // RENDERED)
    few, _ = run((*film, "--frames", "0", "-o", str(out / "few")))
    many, memory = run((*film, "--frames", f"::{step}", "-o", str(out / "many")))
    return (many - few) / (len(range(0, count, step)) - 1), memory


def run(command: Sequence[str]) -> tuple[float, float]:
    """Seconds of the processor that a command took, and its largest memory, MB."""
    script = ("import resource, subprocess, sys\n"
              "code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode\n"
              "used = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
              "print(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)\nsys.exit(code)")
    done = subprocess.run((sys.executable, "-c", script, *command), check=True, text=True,
                          stdout=subprocess.PIPE, env=environment())
    seconds, memory = done.stdout.split()
    return float(seconds), float(memory)
