"""A run as an XDMF index in another folder, with the full paths of the snapshots it names."""

from collections.abc import Sequence
from pathlib import Path

from solver.files import read_shapes
from solver.xdmf import HEAD, NAME, TAIL, Dataset, grids


def write(run: Path, output: Path, frames: Sequence[int]) -> list[Path]:
    """Write run.xdmf; returns it."""
    texts = []
    for frame in frames:
        time, shapes = read_shapes(run, frame)
        text = grids(frame, time, {name: Dataset(*values) for name, values in shapes.items()})
        texts.append(text.replace(">snapshots/", f">{run.resolve()}/snapshots/"))
    path = output / NAME
    path.write_text(HEAD + "".join(texts) + TAIL, encoding="utf-8")
    return [path]
