"""How large should a brick be? The same picture with bricks of 4, 8 and 16 cells a side.

The edge is a constant that is compiled into the kernels, so that every edge takes a process of its
own, which changes the constant before anything else reads it, and compiles to a folder of its own:
kernels of the real edge on disk are neither used nor touched.

    python -m runs.bench.render_bricks SHIFT LIGHT.npy      one of these processes; edge 2^SHIFT
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
EDGES = {4: 2, 8: 3, 16: 4}     # cells a side: SHIFT
LOOK = {"samples": 2}


def rungs() -> Iterator[tuple[int, float, int, Array]]:
    """(edge, CPU seconds, bytes of the volume, light) of every edge."""
    for edge, shift in EDGES.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "light.npy"
            found = subprocess.run(
                [sys.executable, "-m", "runs.bench.render_bricks", str(shift), str(path)],
                env={**os.environ, "NUMBA_CACHE_DIR": folder}, check=True, capture_output=True,
                text=True).stdout.split()
            yield edge, float(found[0]), int(found[1]), np.load(path)


def main(arguments: list[str]) -> int:
    """Print seconds and bytes of the ladder's scene with bricks of an edge, save its light."""
    from render import bricks
    bricks.SHIFT = int(arguments[0])
    bricks.B = 1 << bricks.SHIFT
    from runs.bench import render
    film, snapshot = render.prepared(render.WINDOW, {"step": 1.0}, **render.SMALL, **LOOK)
    seconds, picture = render.timed(film, snapshot)
    volume = film.fire.volume(snapshot, film.lights) if film.fire else None
    assert volume is not None and volume[0].bricks.pool.shape[1] == bricks.B + 1
    np.save(arguments[1], picture.light)
    print(seconds, volume[0].bricks.bytes)
    return 0


def largest_difference(lights: dict[int, Any]) -> float:
    """Between the light of any edge and that of the first."""
    first = next(iter(lights.values()))
    return max(float(np.abs(light - first).max()) for light in lights.values())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
