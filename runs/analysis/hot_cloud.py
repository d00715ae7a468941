"""How large and how hot is the fire? The volume above a temperature, and a slice at its height.

    .venv-ecosystem/bin/python -m runs.analysis.hot_cloud OUT PICTURE.png
"""

import sys

import matplotlib
import numpy as np

from solver.results.reading import Run

matplotlib.use("Agg")
LEVELS = (0.1, 0.3, 0.6)   # of the largest rise above the coldest


def main(out: str, picture: str) -> None:
    """Volumes over time, and the frame with the largest, cut through the middle of z."""
    import matplotlib.pyplot as plt

    heat = Run(out).fields(["T"])["T"]
    low, high = heat.min().item(), heat.max().item()
    cell = np.prod([float(heat[axis].diff(axis)[0]) for axis in "xyz"])
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    volumes = [(heat > low + level * (high - low)).sum(["x", "y", "z"]) * cell for level in LEVELS]
    for level, volume in zip(LEVELS, volumes, strict=True):
        left.plot(heat.time, volume, label=f"T > {low + level * (high - low):.3g} K")
    left.set(xlabel="time, s", ylabel="volume, L³")
    left.legend()
    left.grid(alpha=0.3)
    frame = heat.isel(time=int(np.argmax(volumes[0].data)), z=heat.sizes["z"] // 2)
    mesh = right.pcolormesh(frame.x, frame.y, frame, cmap="inferno")
    right.set(xlabel="x, L", ylabel="y, L", aspect="equal",
              title=f"T at t = {frame.time.item():.3g} s, z = {frame.z.item():.3g}")
    figure.colorbar(mesh, ax=right)
    figure.savefig(picture, dpi=80)


if __name__ == "__main__":
    main(*sys.argv[1:])
