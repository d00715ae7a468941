"""How long a step of the flow takes, stage by stage, measured against a bare fast transform.

    python -m runs bench speed [steps] [preconditioners] [memory] [cells ...] [key=value ...]

The yardstick is scipy's dctn + idctn pair on the same number of cells, on one core, timed in turn
with what it is compared to, so that other work on the machine slows both. Times and ratios are
medians.

    steps            every scheme at 128³ and the default at 32³ and 64³ (or at the cells given):
                     results/speed_steps.csv and .png
    preconditioners  the pressure by each preconditioner at 64³ and 128³ (`runs.bench.pressure`)
    memory           float64 per cell at 128³, and what 1000 steps leave behind:
                     results/speed_memory.csv
"""

import os
import resource
import statistics
from pathlib import Path
from typing import Any

from mpi4py import MPI

from runs.bench import chart, pressure
from runs.bench.clock import in_turn, solve_job, transform_pair
from solver import scene as scenes
from solver.pressure import PressureSolver
from solver.step import Simulation

RESULTS = Path(__file__).parent / "results"
VORTEX: dict[str, Any] = {
    "domain": {"boundary": "wall"}, "time": {"end": 1e3, "frame": 1e3, "dt_max": 1e-3},
    "fluid": {"reynolds": 1600.0},
    "initial": {"u": "sin(2*pi*x)*cos(2*pi*y)", "v": "-cos(2*pi*x)*sin(2*pi*y)", "T": "5+x"}}
SCHEMES = {"default": [], **{name: [f'fluid.advection="{name}"'] for name in
                             ("donor", "central", "central4", "tvd")}}
PER_STAGE = " / pair, per projection"
TINY = 4      # cells per edge: what such a step takes is Python and calls, not arithmetic
Row = tuple[Any, ...]


def main(argv: list[str]) -> None:
    """Measure what is named, or all; see the module."""
    parts = [a for a in argv if a in ("steps", "preconditioners", "memory")]
    overrides = [a for a in argv if "=" in a]
    sizes = [int(a) for a in argv if a.isdigit()]
    RESULTS.mkdir(exist_ok=True)
    if not parts or "memory" in parts:   # first: it reads the peak of this process
        memory(overrides)
    if not parts or "steps" in parts:
        steps(sizes, overrides)
    if not parts or "preconditioners" in parts:
        pressure.main([str(n) for n in sizes])


def steps(sizes: list[int], overrides: list[str]) -> None:
    """A table of a step of every scheme: seconds, ratios, stages."""
    plans = ([("default", n) for n in sizes] or
             [("default", 32), ("default", 64), *((name, 128) for name in SCHEMES)])
    rows = []
    for name, cells in plans:
        found = measure(cells, [*SCHEMES[name], *overrides], max(10, round((256 / cells) ** 3)))
        print(f"{cells}³ {name} {' '.join(overrides)}")
        for what, value in found.items():
            print(f"  {what:<34} {value:10.5f}")
            rows.append((name, cells, what, value))
    overhead = 1e3 * statistics.median(step_seconds([TINY] * 3, 200))
    print(f"a step of {TINY}³ cells: {overhead:.2f} ms")
    rows.append(("default", TINY, "milliseconds of a step", overhead))
    chart.write_csv(RESULTS / "speed_steps.csv", "scheme,cells per edge,what,value", rows,
                    "python -m runs bench speed steps")
    plot(rows)


def make(cells: list[int], overrides: list[str],
         comm: MPI.Comm = MPI.COMM_WORLD) -> Simulation:
    """A vortex in a closed box of so many cells with temperature, two steps old."""
    data = {name: dict(values) for name, values in VORTEX.items()}
    data["domain"]["cells"] = cells
    for override in overrides:
        scenes.apply_override(data, override)
    simulation = Simulation(scenes.build(data), comm)
    for _ in range(2):
        simulation.advance(1e3)
    return simulation


def measure(cells: int, overrides: list[str], repeats: int) -> dict[str, float]:
    """Medians in seconds: pair, CG solve, step and its stages (per substep), and the ratios."""
    simulation = make([cells] * 3, overrides)
    simulation.seconds = dict.fromkeys(simulation.seconds, 0.0)
    solver = PressureSolver(simulation.state.grid)
    seconds = in_turn(repeats, pair=transform_pair(cells), solve=solve_job(solver),
                      step=lambda: simulation.advance(1e3))
    solver.destroy()
    substeps = simulation.substeps
    found = {f"seconds of a {name}": statistics.median(values) for name, values in seconds.items()}
    found["seconds of a step, best"] = min(seconds["step"])
    found["iterations per solve"] = simulation.state.iterations / substeps
    found["solve / pair"] = ratio(seconds["solve"], seconds["pair"])
    found["step / (pair × projections)"] = ratio(seconds["step"], seconds["pair"]) / substeps
    found["Mcell-steps / s"] = cells**3 / statistics.median(seconds["step"]) / 1e6
    for name, total in simulation.seconds.items():
        found[name + PER_STAGE] = total / repeats / substeps / statistics.fmean(seconds["pair"])
    simulation.destroy()
    return found


def ratio(these: list[float], those: list[float]) -> float:
    """The median of the ratios of what was timed one after the other."""
    return statistics.median(a / b for a, b in zip(these, those, strict=True))


def step_seconds(cells: list[int], repeats: int) -> list[float]:
    """Seconds of each step."""
    simulation = make(cells, [])
    seconds = in_turn(repeats, step=lambda: simulation.advance(1e3))["step"]
    simulation.destroy()
    return seconds


def memory(overrides: list[str]) -> None:
    """float64 per cell: the peak of a run of 128³ above what a run of 32³ leaves behind; and the
    growth of the resident set over 1000 steps of a 32³ run, after a hundred."""
    simulation = make([32] * 3, overrides)
    for _ in range(100):
        simulation.advance(1e3)
    before = resident()
    for _ in range(1000):
        simulation.advance(1e3)
    growth = (resident() - before) / 1024
    simulation.destroy()
    before = resident()
    make([128] * 3, overrides).destroy()
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    per_cell = (peak - before) / 8 / 128**3
    print(f"{per_cell:.1f} float64 per cell at 128³; 1000 steps of 32³ add {growth:.0f} KiB")
    chart.write_csv(RESULTS / "speed_memory.csv", "what,value",
                    [("float64 per cell at 128³", per_cell), ("KiB added by 1000 steps", growth)],
                    f"python -m runs bench speed memory {' '.join(overrides)}".rstrip())


def resident() -> int:
    """Bytes of this process in memory now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE")


def plot(rows: list[Row]) -> None:
    """Stacked bars: what each stage of a step at the largest size costs, in pairs."""
    finest = max(row[1] for row in rows)
    names = list(dict.fromkeys(row[0] for row in rows if row[1] == finest))
    values = {(row[0], row[2]): row[3] for row in rows if row[1] == finest}
    stages = dict.fromkeys(what for _, what in values if what.endswith(PER_STAGE))
    parts = {stage.removesuffix(PER_STAGE): [values[name, stage] for name in names]
             for stage in stages}
    chart.bars(RESULTS / "speed_steps.png", names, parts, "in dctn + idctn pairs, per projection",
               f"A step at {finest}³, one rank: python -m runs bench speed")
