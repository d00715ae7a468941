"""Where does the fuel go, and how fast does the flow answer? Burnt mass, gas, energy, dt over time.

    .venv-ecosystem/bin/python -m runs.analysis.budgets OUT PICTURE.png
"""

import sys

import matplotlib

from solver.results.reading import Run

matplotlib.use("Agg")


def main(out: str, picture: str) -> None:
    """Draw four curves over time."""
    import matplotlib.pyplot as plt

    table = Run(out).budgets().set_index("time")
    figure, axes = plt.subplots(2, 2, figsize=(8, 5), sharex=True, layout="constrained")
    for axis, (name, label) in zip(axes.flat, (
            ("burnt", "burnt mass, M"), ("gas", "gas made, L³"),
            ("energy", "kinetic energy / density, L⁵/s²"), ("dt", "time step, s")), strict=True):
        if name in table:
            axis.plot(table.index, table[name], color="#c43c00", linewidth=1.2)
        axis.set(ylabel=label, xlabel="time, s" if name in ("energy", "dt") else "")
        axis.grid(alpha=0.3)
    figure.savefig(picture, dpi=80)


if __name__ == "__main__":
    main(*sys.argv[1:])
