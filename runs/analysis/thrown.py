"""How are the pieces thrown? Speed of each over time, and the pieces where they end.

    .venv-ecosystem/bin/python -m runs.analysis.thrown OUT PICTURE.png
"""

import sys

import matplotlib
import numpy as np

from solver.results.reading import Run

matplotlib.use("Agg")


def main(out: str, picture: str) -> None:
    """A curve per piece, and the last frame seen from the front."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    run = Run(out)
    table = run.bodies()
    speed = np.sqrt(sum(table[f"velocity_{axis}"]**2 for axis in "xyz"))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    number = len(run.fragments.body)
    colours = matplotlib.colormaps["viridis"](np.linspace(0, 0.9, number))
    for piece in range(number):
        mine = table.xs(piece, level="piece")
        left.plot(mine["time"], speed.xs(piece, level="piece"), color=colours[piece], linewidth=1)
    left.set(xlabel="time, s", ylabel="speed of a piece, L/s")
    left.grid(alpha=0.3)
    for piece, block in enumerate(run.pieces(run.frames[-1])):
        corners = block.points[block.regular_faces][:, :, :2]
        right.add_collection(PolyCollection(corners, facecolor=colours[piece], alpha=0.5))
    right.autoscale_view()
    right.set(xlabel="x, L", ylabel="y, L", aspect="equal",
              title=f"the pieces at t = {run.times[-1]:.3g} s")
    figure.savefig(picture, dpi=80)


if __name__ == "__main__":
    main(*sys.argv[1:])
