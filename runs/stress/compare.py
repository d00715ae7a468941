"""Are two runs the same, and is every file of a run whole?"""

from pathlib import Path

import numpy as np

from solver.files import (CHECKPOINT, SNAPSHOT, checkpoint_paths, read_snapshot, snapshot_frames,
                          snapshot_path)
from solver.files_checksum import check


def broken_files(out: Path) -> list[str]:
    """What is wrong with the files that stand under their final names."""
    problems = [check(path, CHECKPOINT) for path in checkpoint_paths(out)]
    problems += [check(snapshot_path(out, frame), SNAPSHOT) for frame in snapshot_frames(out)]
    return [problem for problem in problems if problem]


def count_files(out: Path) -> int:
    """How many files `broken_files` looks at."""
    return len(checkpoint_paths(out)) + len(snapshot_frames(out))


def difference(mine: Path, theirs: Path) -> str:
    """The first thing that differs between the snapshots of two runs, bit by bit, or ""."""
    frames = snapshot_frames(theirs)
    if snapshot_frames(mine) != frames:
        return f"frames {snapshot_frames(mine)} instead of {frames}"
    for frame in frames:
        ours, others = contents(mine, frame), contents(theirs, frame)
        if ours.keys() != others.keys():
            return f"frame {frame}: other datasets"
        for name, values in others.items():
            if not np.array_equal(ours[name], values, equal_nan=values.dtype.kind == "f"):
                return f"frame {frame}: {name}"
    return ""


def contents(out: Path, frame: int) -> dict[str, np.ndarray]:
    """Every array of a snapshot."""
    snapshot = read_snapshot(out, frame)
    arrays = {"clock": np.array([snapshot.time, snapshot.step])}
    arrays |= {name: field.values for name, field in snapshot.fields.items()}
    for kind, columns in snapshot.particles.items():
        arrays |= {f"{kind}/{name}": values for name, values in columns.items()}
    return arrays | {f"bodies/{name}": values for name, values in snapshot.bodies.items()}
