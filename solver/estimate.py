"""What will a run need? Memory, disk, steps and time, said before it starts.

Memory is counted array by array: the fields of `state`, the buffers of the stages that the scene
needs, the records of particles, and what Python with its libraries takes per rank (measured).
Disk is what the frames take without compression, which is an upper bound, and the checkpoints.

Steps come from the speeds that a scene can be seen to have: its initial velocity, and while the
fuel burns that of its gas. Time is steps times cells in units of a fast transform pair, which is
measured here and now (PAIRS: what a step costs in such pairs), plus particles. Both are right to a
factor of two or so where the fire decides; a flow that speeds up by itself is not foreseen.
"""

import os
import time
from pathlib import Path
from shutil import disk_usage

import numexpr
import numpy as np
from ducc0.fft import dct

from solver import plan
from solver.scene import Scene
from solver.scene_physics import courant

PROGRAM = 260e6        # bytes per rank: interpreter, libraries, kernels; a 32³ run peaks at 252e6
PARTICLE_BYTES = 112
FRAME_PARTICLE = {"float32": 44, "float64": 80}
SOLVER_ARRAYS = 4      # right side, solution, pivots and the transforms' buffers
PAIRS = 4.5            # transform pairs per substep and cell: pressure, momentum
PAIRS_WARM, PAIRS_VORTICITY = 1.1, 2.0     # temperature; vorticity confinement
PARTICLE_STEP = 15e6   # particle-steps per second
LEAST_STEP = 0.5e-3    # s: what a step takes on the smallest grid
PROBE = 48             # cells per axis of the probe
SAMPLES = 16           # per axis, of the initial velocity
SUFFIX = {"k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}


def memory(scene: Scene, ranks: int) -> float:
    """Bytes at the peak of a run, on all ranks together."""
    return arrays(scene) * 8 * _ghosted_cells(scene, ranks) + ranks * PROGRAM \
        + 2.5 * PARTICLE_BYTES * particles(scene)


def arrays(scene: Scene) -> int:
    """How many arrays of the size of the grid there are."""
    several, warm = scene.time.integrator != "euler", scene.has_temperature
    stages = {stage.name for stage in plan.wanted(scene)}
    number = 7 + SOLVER_ARRAYS + 3 * several + (2 + several) * warm
    number += 3 * (scene.fuel is not None) + 2 * ("source" in stages) + 7 * ("vorticity" in stages)
    if "diffuse" in stages:   # a guess, pressures of all substeps and two, and the transforms' own
        number += 6 + len(plan.SUBSTEPS[scene.time.integrator])
    return number


def particles(scene: Scene) -> int:
    """The most particles that there can be at a time."""
    number, fuel, soot = particles_of_fuel(scene), scene.fuel, scene.soot
    if fuel is None or soot is None:
        return number
    born = int(min(1e6, fuel.mass * fuel.soot / soot.threshold)) if soot.repeat else 1
    return number * (1 + born)


def particles_of_fuel(scene: Scene) -> int:
    """Those of fuel alone, as if none were removed."""
    fuel = scene.fuel
    if fuel is None:
        return 0
    emitted = min(fuel.cap, fuel.rate * min(scene.time.end, fuel.emit_end))
    return max(fuel.particles, min(fuel.cap, fuel.particles + int(emitted)))


def disk(scene: Scene) -> tuple[float, float]:
    """Bytes of all snapshots before compression, and of the checkpoints."""
    cells, output = float(np.prod(scene.domain.cells)), scene.output
    size = 4 if output.precision == "float32" else 8
    frame = size * cells * len(output.fields) + FRAME_PARTICLE[output.precision] * (
        particles(scene) if output.particles else 0)
    frames = np.ceil(scene.time.end / scene.time.frame) + 1
    one = 96.0 * _ghosted_cells(scene, 1) + PARTICLE_BYTES * particles(scene)
    return frames * frame, (output.checkpoint_keep + 1) * one


def steps(scene: Scene) -> int:
    """About how many steps: the Courant number for the speeds that can be foreseen, at least one
    per frame."""
    inverse_h = sum(n / size for size, n in zip(scene.domain.size, scene.domain.cells, strict=True)
                    if n > 1)
    at_start, (gas, lasting) = initial_speed(scene), gas_speed(scene)
    number = 0.0
    for speed, time_ in ((at_start + gas, lasting), (at_start, scene.time.end - lasting)):
        rate = speed * inverse_h / courant(scene)
        number += time_ * max(rate, 1 / scene.time.dt_max, 1 / scene.time.frame)
    return int(np.ceil(number))


def initial_speed(scene: Scene) -> float:
    """Mean over the axes of the largest velocity at the start, L/s."""
    at = np.meshgrid(*((np.arange(SAMPLES) + 0.5) / SAMPLES * size for size in scene.domain.size))
    names = dict(zip("xyz", at, strict=True), pi=np.pi)
    peaks = [np.max(np.abs(numexpr.evaluate(getattr(scene.initial, name), local_dict=names,
                                            global_dict={}))) for name in "uvw"]
    return float(np.mean(peaks)) + scene.initial.noise


def gas_speed(scene: Scene) -> tuple[float, float]:
    """Of the gas through the surface of a ball that half of it has filled, L/s, and how long: two
    lives of a particle beyond the last one's start. (0, 0) without fuel."""
    fuel, end = scene.fuel, scene.time.end
    if fuel is None or not fuel.gas:
        return 0.0, 0.0
    most, life = particles_of_fuel(scene), fuel.mass / fuel.burn_rate
    emission = (most - fuel.particles) / fuel.rate if fuel.rate else 0.0
    flow = fuel.gas * min((fuel.particles + most) / 2 * fuel.burn_rate,
                          most * fuel.mass / (emission + life))
    ball = 4 / 3 * np.pi * scene.detonation.radius**3 + flow * min(life, end) / 2
    area = np.pi**(1 / 3) * (6 * min(ball, float(np.prod(scene.domain.size))))**(2 / 3)
    return float(flow / area), min(end, emission + 2 * life)


def seconds(scene: Scene, ranks: int, cores: int, pair: float) -> float:
    """Wall time without writing; `pair`: seconds of a transform pair per cell."""
    substeps = len(plan.SUBSTEPS[scene.time.integrator])
    pairs = PAIRS + PAIRS_WARM * scene.has_temperature
    pairs += PAIRS_VORTICITY * (scene.fluid.vorticity_confinement > 0)
    cells = float(np.prod(scene.domain.cells))
    work = substeps * pairs * pair * cells + particles_of_fuel(scene) / PARTICLE_STEP
    return steps(scene) * max(work / min(ranks, cores), LEAST_STEP)


def transform_pair() -> float:
    """Seconds per cell of a fast transform and its inverse on this machine: the probe."""
    values = np.ones((PROBE,) * 3)
    took = []
    for _ in range(4):
        start = time.perf_counter()
        dct(dct(values, type=2), type=3)
        took.append(time.perf_counter() - start)
    return min(took) / values.size


def _ghosted_cells(scene: Scene, ranks: int) -> float:
    nx, ny, nz = scene.domain.cells
    width = 4   # two ghost layers on each side (`kernel.GHOSTS`; numba is not needed here)
    split = np.sqrt(ranks)
    return float((nx + width) * (ny + width * split) * (nz + width * split))


def available_memory() -> float:
    """Bytes that this machine can still give: what the kernel says, or our container's limit."""
    free = np.inf
    for line in _read("/proc/meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            free = 1024.0 * int(line.split()[1])
    limit, used = _read("/sys/fs/cgroup/memory.max"), _read("/sys/fs/cgroup/memory.current")
    if limit.strip().isdigit() and used.strip().isdigit():
        free = min(free, float(limit) - float(used))
    return free


def _read(path: str) -> str:
    try:
        return Path(path).read_text(encoding="ascii")
    except OSError:
        return ""


def describe(scene: Scene, ranks: int, here: int, out: Path) -> tuple[str, str]:
    """The estimate in two lines, and what is in the way of the run, or "".

    ranks  of the run;  here  of them on this machine
    """
    needed, frames = memory(scene, ranks), disk(scene)
    free = available_memory()
    room = disk_usage(next(path for path in (out, *out.absolute().parents) if path.exists())).free
    text = (f"needs about {size(needed)} of memory ({size(free)} are free), at most "
            f"{size(frames[0])} of disk for frames and {size(frames[1])} for checkpoints "
            f"({size(room)} are free)\n{effort(scene, ranks)}")
    problem = ""
    if needed * here / ranks > free:
        problem = (f"domain.cells = {scene.domain.cells}: needs about "
                   f"{size(needed * here / ranks)} of memory on this machine, which has "
                   f"{size(free)}; fix: fewer cells or particles, or more machines")
    elif sum(frames) > room:
        text += "\nwarning: the disk may be too small"
    return text, problem


def effort(scene: Scene, ranks: int) -> str:
    """Steps and time in words; a scene may hold numbers for which there are none."""
    try:
        number = steps(scene)
        spent = seconds(scene, ranks, len(os.sched_getaffinity(0)), transform_pair())
        return (f"about {max(1, number // 2)} to {2 * number} steps, {duration(spent / 2)} to "
                f"{duration(2 * spent)}, beside set-up and writing")
    except (ArithmeticError, ValueError):
        return "no estimate of the steps: speeds that are not finite"


def size(number: float) -> str:
    """Bytes for people: 1.2 GB."""
    for letter in "TGMk":
        if number >= SUFFIX[letter]:
            return f"{number / SUFFIX[letter]:.3g} {letter}B"
    return f"{number:.0f} B"


def duration(number: float) -> str:
    """Seconds for people: 1.2 h."""
    for unit, letters in ((86400, "days"), (3600, "h"), (60, "min")):
        if number >= 2 * unit:
            return f"{number / unit:.2g} {letters}"
    return f"{number:.2g} s"
