"""What will a run need? Memory and disk, said before it starts.

Memory is counted array by array: the fields of `state`, the buffers of the stages that the scene
needs, the records of particles, and what Python with its libraries takes per rank (measured).
Disk is what the frames take without compression, which is an upper bound, and the checkpoints.
"""

from pathlib import Path
from shutil import disk_usage

import numpy as np

from solver.scene import Scene

PROGRAM = 260e6        # bytes per rank: interpreter, libraries, kernels; a 32³ run peaks at 252e6
PARTICLE_BYTES = 112
FRAME_PARTICLE = {"float32": 44, "float64": 80}
SOLVER_ARRAYS = 6      # right side, solution, CG's and the transforms' buffers
SUFFIX = {"k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}


def memory(scene: Scene, ranks: int) -> float:
    """Bytes at the peak of a run, on all ranks together."""
    return arrays(scene) * 8 * _ghosted_cells(scene, ranks) + ranks * PROGRAM \
        + 2.5 * PARTICLE_BYTES * particles(scene)


def arrays(scene: Scene) -> int:
    """How many arrays of the size of the grid there are."""
    several, warm = scene.time.integrator != "euler", scene.has_temperature
    fire = scene.fuel is not None
    number = 7 + SOLVER_ARRAYS + 3 * several + (2 + several) * warm
    number += 3 * fire + 2 * bool(scene.fluid.source or scene.fluid.heat_source)
    return number + 4 * (scene.fluid.vorticity_confinement > 0)


def particles(scene: Scene) -> int:
    """The most particles that there can be at a time."""
    fuel, soot = scene.fuel, scene.soot
    if fuel is None:
        return 0
    emitted = fuel.rate * min(scene.time.end, fuel.emit_end)
    number = max(fuel.particles, min(fuel.cap, fuel.particles + int(emitted)))
    if soot is None:
        return number
    born = int(fuel.mass * fuel.soot / soot.threshold) if soot.repeat else 1
    return number * (1 + born)


def disk(scene: Scene) -> tuple[float, float]:
    """Bytes of all snapshots before compression, and of the checkpoints."""
    cells, output = float(np.prod(scene.domain.cells)), scene.output
    size = 4 if output.precision == "float32" else 8
    frame = size * cells * len(output.fields) + FRAME_PARTICLE[output.precision] * (
        particles(scene) if output.particles else 0)
    frames = np.ceil(scene.time.end / scene.time.frame) + 1
    one = 96.0 * _ghosted_cells(scene, 1) + PARTICLE_BYTES * particles(scene)
    return frames * frame, (output.checkpoint_keep + 1) * one


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
    """The estimate in one line, and what is in the way of the run, or "".

    ranks  of the run;  here  of them on this machine
    """
    needed, frames = memory(scene, ranks), disk(scene)
    free = available_memory()
    room = disk_usage(next(path for path in (out, *out.absolute().parents) if path.exists())).free
    text = (f"needs about {size(needed)} of memory ({size(free)} are free), at most "
            f"{size(frames[0])} of disk for frames and {size(frames[1])} for checkpoints "
            f"({size(room)} are free)")
    problem = ""
    if needed * here / ranks > free:
        problem = (f"domain.cells = {scene.domain.cells}: needs about "
                   f"{size(needed * here / ranks)} of memory on this machine, which has "
                   f"{size(free)}; fix: fewer cells or particles, or more machines")
    elif sum(frames) > room:
        text += "\nwarning: the disk may be too small"
    return text, problem


def size(number: float) -> str:
    """Bytes for people: 1.2 GB."""
    for letter in "TGMk":
        if number >= SUFFIX[letter]:
            return f"{number / SUFFIX[letter]:.3g} {letter}B"
    return f"{number:.0f} B"
