"""What is in the folder of a run, and is it whole? Lines for people."""

import json
from pathlib import Path

import numpy as np

from solver.files import (CHECKPOINT, SNAPSHOT, FileError, checkpoint_paths, checksums, is_sealed,
                          open_file, read_shapes, read_snapshot, read_steps, snapshot_frames,
                          snapshot_path)
from solver.files_checksum import check
from solver.results.reading import Run

FRAGMENTS = "brisance-fragments"
Lines = tuple[list[str], int]


def refuse_no_run(directory: Path) -> None:
    """Raises `FileError` where no snapshot or checkpoint is."""
    if not snapshot_frames(directory) and not checkpoint_paths(directory):
        raise FileError(f"{directory}: holds no run; fix: python -m solver SCENE -o {directory}")


def listing(directory: Path) -> Lines:
    """One line per file, and how many of them cannot be read."""
    refuse_no_run(directory)
    lines, bad = [], 0
    for path in _files(directory):
        try:
            text = _contents(directory, path)
        except FileError as error:
            text, bad = f"DAMAGED: {error}", bad + 1
        lines.append(f"{str(path.relative_to(directory)):<32} {path.stat().st_size / 1e6:9.3f} MB  "
                     f"{text}")
    return lines, bad


def verified(directory: Path) -> Lines:
    """One line per file that is wrong, and a last one for all."""
    refuse_no_run(directory)
    lines, bad, unknown = [], 0, 0
    paths = _files(directory)
    for path in paths:
        problem = check(path, _form(path))
        if problem:
            lines.append(problem)
            bad += 1
        elif path.name not in checksums(path.parent) and not is_sealed(path):
            unknown += 1
    lines += _missing(directory)
    bad += len(lines) - bad
    whole = f"{len(paths) - bad} of {len(paths)} files are whole" if bad else \
        f"all {len(paths)} files are whole"
    return [*lines, whole + (f" (only opened, without a checksum: {unknown})" if unknown
                             else "")], bad


def summary(directory: Path) -> Lines:
    """Frames, fields with their ranges, particles, pieces and budgets."""
    run = Run(directory)
    lines = [f"{directory}: {_state(directory)}",
             f"frames      {len(run.frames)}, {run.frames[0]} to {run.frames[-1]}, t = "
             f"{run.times[0]:.6g} to {run.times[-1]:.6g} s"]
    last = read_snapshot(directory, run.frames[-1])
    for name, field in last.fields.items():
        values = field.values
        lines.append(f"{name:<11} {' × '.join(map(str, values.shape[::-1]))} {values.dtype}, last "
                     f"frame {np.min(values):.6g} to {np.max(values):.6g}, mean "
                     f"{np.mean(values, dtype=float):.6g}")
    for kind, columns in last.particles.items():
        lines.append(f"{kind:<11} {len(columns['position'])} particles in the last frame: "
                     f"{', '.join(columns)}")
    if last.bodies:
        speed = np.linalg.norm(last.bodies["velocity"], axis=1)
        lines.append(f"pieces      {len(speed)}, speed in the last frame {speed.min():.4g} to "
                     f"{speed.max():.4g} L/s")
    if records := read_steps(directory):
        final = records[-1]
        lines.append(f"steps       {final['step']}, worst divergence error "
                     f"{max(record.get('divergence', 0.0) for record in records):.2e}")
        lines += [f"{name:<11} {final[name]:.12g}" for name in ("burnt", "gas", "heat")
                  if final.get(name)]
    return lines, 0


def _files(directory: Path) -> list[Path]:
    frames = [snapshot_path(directory, frame) for frame in snapshot_frames(directory)]
    return [path for path in (directory / "fragments.h5", *frames, *checkpoint_paths(directory))
            if path.is_file()]


def _form(path: Path) -> str:
    return {"snapshots": SNAPSHOT, "checkpoints": CHECKPOINT}.get(path.parent.name, FRAGMENTS)


def _missing(directory: Path) -> list[str]:
    """Files that have a checksum and are gone."""
    return [f"{folder / name}: missing, though it has a checksum; fix: make it again"
            for folder in (directory / "snapshots", directory / "checkpoints")
            for name in checksums(folder) if not (folder / name).exists()]


def _contents(directory: Path, path: Path) -> str:
    form = _form(path)
    with open_file(path, form) as file:
        if form == CHECKPOINT:
            return f"step {int(file.attrs['step'])}, t = {float(file.attrs['time']):.6g}"
        if form == FRAGMENTS:
            return f"{len(file['body'])} pieces"
    time, shapes = read_shapes(directory, int(path.stem[5:]))
    fields = [name[7:] for name in shapes if name.startswith("fields/")]
    particles = [f"{shape[0][0]} {name.split('/')[1]}" for name, shape in shapes.items()
                 if name.endswith("/position")]
    return f"t = {time:.6g}  {' '.join(fields)}  {' '.join(particles)}"


def _state(directory: Path) -> str:
    try:
        return str(json.loads((directory / "status.json").read_text(encoding="utf-8"))["state"])
    except (OSError, ValueError, KeyError, TypeError):
        return "its state is unknown"
