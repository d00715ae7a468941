"""How does a run become a film? Frames and rows over ranks; finished ones are kept, then one video.

A frame is made from the scene, the fragments, its snapshot and this renderer. The digest of all of
them is kept inside its PNG; a frame whose digest has not changed is not made again.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partition import fragments as pieces
from render import image
from render.frame import Film, Picture
from render.video import write_film
from solver import files
from solver.scene import Scene
from solver.scene_render import Render

if TYPE_CHECKING:
    from render.fire import Fire

# sections beside [render]
MEANINGFUL = ("seed", "domain", "fluid", "fuel", "soot", "body", "obstacle")


@dataclass(frozen=True)
class Work:
    """What a rank did: frames made and kept, seconds of set-up and of rendering, rays traced."""

    made: int
    kept: int
    setup: float
    seconds: float
    rays: int


def frame_path(directory: Path, frame: int) -> Path:
    """The picture of a frame."""
    return directory / f"frame_{frame:06d}.png"


def shoot(run: Path, scene: Scene, render: Render, frames: Sequence[int], output: Path,
          comm: Any, progress: Callable[[int, int], None]) -> Work:
    """Render `frames` of a run into `output`; returns this rank's work.

    Frames are dealt out to the ranks; the last ones, fewer than ranks, are shared row by row.
    """
    began = time.perf_counter()
    if comm.rank == 0:
        output.mkdir(parents=True, exist_ok=True)
    fragments = pieces.read(run / "fragments.h5") if scene.body else None
    fire = fire_of(run, scene, render, comm)
    common = digest_of_run(run, scene, render, fire)
    digests = [(frame, digest_of_frame(common, run, frame))
               for frame in frames[comm.rank::comm.size]]
    due = sorted(sum(comm.allgather([
        (frame, digest) for frame, digest in digests if _outdated(output, frame, digest, render)
    ]), []))
    whole = len(due) // comm.size * comm.size
    mine, shared = due[comm.rank:whole:comm.size], due[whole:]
    rays, setup, began_frames = 0, 0.0, began
    if due:
        film = Film(scene, render, fragments, fire)
        compile_once(film, files.read_snapshot(run, frames[len(frames) // 2], ("T",)), comm)
        began_frames = time.perf_counter()
        setup = began_frames - began
        for done, (frame, digest) in enumerate(mine + shared):
            snapshot = files.read_snapshot(run, frame, ("T",))
            picture = film.frame(snapshot) if done < len(mine) else _together(film, snapshot, comm)
            rays += picture.rays
            if done < len(mine) or comm.rank == 0:
                _save(picture, frame_path(output, frame), render, digest)
            progress(done + 1, len(mine) + len(shared))
    made = len(mine) + (len(shared) if comm.rank == 0 else 0)
    kept = len(frames) - len(due) if comm.rank == 0 else 0
    return Work(made, kept, setup, time.perf_counter() - began_frames, rays)


def _outdated(output: Path, frame: int, digest: str, render: Render) -> bool:
    path = frame_path(output, frame)
    return (image.made_from(path) != digest
            or render.exr and not path.with_suffix(".exr").is_file())


def _together(film: Film, snapshot: files.Snapshot, comm: Any) -> Picture:
    """A frame of which every rank renders some rows, every n-th; whole on rank 0."""
    rows = range(comm.rank, film.render.height, comm.size)
    part = film.frame(snapshot, rows) if rows else None
    parts = comm.gather(part.light if part else None)
    if parts is None:
        return Picture(np.empty((0, 0, 3)), part.rays if part else 0)
    assert part is not None     # rank 0 has a row of every picture
    light = np.empty((film.render.height, film.render.width, 3))
    for rank, piece in enumerate(parts):
        if piece is not None:
            light[rank::comm.size] = piece
    return Picture(light, part.rays, part.layers)


def _save(picture: Picture, path: Path, render: Render, digest: str) -> None:
    """Write a frame; the PNG, which says that the frame is done, comes last."""
    if picture.layers is not None:
        extra = picture.layers
        image.save_exr(path.with_suffix(".exr"), picture.light, {
            "Z": extra.depth, "piece.id": extra.piece, "temperature.T": extra.temperature,
            **{f"normal.{axis}": np.ascontiguousarray(extra.normal[..., i])
               for i, axis in enumerate("XYZ")}})
    image.save_png(path, image.developed(picture.light, render.exposure, render.tone), digest)


def fire_of(run: Path, scene: Scene, render: Render, comm: Any) -> Fire | None:
    """What fire looks like in this run; None where there is none or it is not wanted."""
    incandescent = any(material.incandescent for material in render.material.values())
    if (not (render.volume.visible or incandescent) or not scene.has_temperature
            or "T" not in scene.output.fields):
        return None
    from render.fire import fire_of_run
    return fire_of_run(run, scene, render, comm)


def compile_once(film: Film, snapshot: files.Snapshot, comm: Any) -> None:
    """Compile the kernels, or load them: if they are not on disk yet one rank before the others."""
    row = film.render.height // 2
    together = comm.bcast(compiled())
    for turn in range(2):
        if turn == (0 if together or comm.rank == 0 else 1):
            film.frame(snapshot, range(row, row + 1))
        comm.barrier()


def compiled() -> bool:
    """Whether the cache on disk beside this file holds kernels, and none is older than its source.

    If that is not all, some are compiled by every rank, to the same effect.
    """
    folder = Path(__file__).parent
    cached = list((folder / "__pycache__").glob("*.nbi"))
    return bool(cached) and all(
        source.is_file() and source.stat().st_mtime <= index.stat().st_mtime
        for index in cached for source in [folder / f"{index.name.partition('.')[0]}.py"])


def digest_of_run(run: Path, scene: Scene, render: Render, fire: Fire | None) -> str:
    """What all frames depend on."""
    digest = hashlib.blake2b(digest_size=16)
    data = scene.model_dump(mode="json", include=set(MEANINGFUL))
    data["render"] = render.model_dump(mode="json", exclude={"fps", "exr"})
    data["scales"] = [fire.high, fire.most] if fire else None
    digest.update(json.dumps(data, sort_keys=True).encode())
    sources = sorted(path for path in Path(__file__).parent.iterdir()
                     if path.suffix in (".py", ".csv"))
    meshes = [thing.mesh for thing in render.object] + [body.mesh for body in scene.body]
    pictures = [render.backdrop.image] + [material.texture.image for material
                                          in render.material.values() if material.texture]
    own_files = [scene.path.parent / name for name in meshes + pictures if name]
    for path in (*sources, *own_files, run / "fragments.h5"):
        digest.update(path.read_bytes() if path.is_file() else b"absent")
    return digest.hexdigest()


def digest_of_frame(common: str, run: Path, frame: int) -> str:
    """What one frame depends on."""
    content = files.snapshot_path(run, frame).read_bytes()
    return hashlib.blake2b(content, digest_size=16, key=common.encode()).hexdigest()


def write_video(path: Path, output: Path, frames: Sequence[int], fps: int) -> None:
    """Join the frames' pictures to one film."""
    write_film(path, (image.load_png(frame_path(output, frame)) for frame in frames), fps)


def write_contact_sheet(path: Path, output: Path, frames: Sequence[int], most: int = 20,
                        columns: int = 5) -> None:
    """At most `most` of the frames, evenly spread, side by side."""
    chosen = [frames[round(i)] for i in np.linspace(0, len(frames) - 1, min(most, len(frames)))]
    image.contact_sheet(path, (image.load_png(frame_path(output, frame)) for frame in chosen),
                        min(columns, len(chosen)))


def preview(render: Render) -> Render:
    """The same picture, small and rough: at most 160 pixels wide and high, one ray each."""
    shrink = min(1.0, 160 / max(render.width, render.height))
    return render.model_copy(update={
        "width": max(1, round(render.width * shrink)), "samples": 1, "exr": False,
        "height": max(1, round(render.height * shrink)), "depth": min(render.depth, 4)})
