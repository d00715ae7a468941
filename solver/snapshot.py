"""What a frame stores: fields, particles and bodies, as this rank's blocks of the file.

u, v and w are written with the low boundary face of the box, so their own axis is one longer.
"""

from pathlib import Path

import numpy as np

from partition.fragments import Fragments
from solver.files_write import Block, SnapshotWriter
from solver.grid import AXES, Field, Grid
from solver.hashing import uniform_at
from solver.kernel import GHOSTS
from solver.openpmd import dress
from solver.scene import Scene
from solver.state import VELOCITY, State
from solver.xdmf import Index, described

SPECIES = ("fuel", "soot")   # by the kind of a particle
THINNING_STREAM = 20
BODY_COLUMNS = ("position", "orientation", "velocity", "spin", "mass", "rest_centre")


class Snapshot:
    """Writes the state of a run, frame by frame."""

    def __init__(self, scene: Scene, state: State, directory: Path):
        output = scene.output
        self.scene = scene
        self.writer = SnapshotWriter(directory, state.grid.comm, output.precision,
                                     output.compression, durable=False)
        self.index = Index(directory)
        self.names = [name for name in output.fields if getattr(state, name) is not None]

    def write(self, state: State, frame: int) -> Path:
        """Write one frame; every rank must call it."""
        blocks = self.blocks(state)
        path = self.writer.write(frame, blocks, {
            "time": state.time, "step": state.step, "dt": state.dt, "title": self.scene.title},
            lambda file, blocks: dress(file, blocks, frame, state.time, state.dt))
        if state.grid.comm.rank == 0:
            self.writer.later(self.index.add, frame, state.time,
                              described(blocks, self.writer.precision.itemsize))
        return path

    def sync(self) -> None:
        """Wait until all frames are on the disk: a checkpoint that counts on them follows."""
        self.writer.sync()

    def blocks(self, state: State) -> dict[str, Block]:
        """What is stored of a state, by name; every rank must call it."""
        blocks = {f"fields/{name}": field_block(state.grid, name, getattr(state, name))
                  for name in self.names}
        if state.swarm is not None and self.scene.output.particles:
            blocks.update(self._particles(state))
        if state.bodies is not None:
            for column in BODY_COLUMNS:
                name = "angular_velocity" if column == "spin" else column
                blocks[f"bodies/{name}"] = self.writer.replicated(getattr(state.bodies, column))
            if state.T is not None:
                blocks["bodies/temperature"] = self.writer.replicated(
                    state.bodies.temperature(state))
            if state.bodies.deformation is not None:   # else they are those of the fragments
                blocks["bodies/vertices"] = self.writer.replicated(state.bodies.vertices)
        return blocks

    def _particles(self, state: State) -> dict[str, Block]:
        points, output = state.swarm.points, self.scene.output
        kept = np.ones(len(points), bool)
        if output.thinning < 1:
            key = points["id"].astype(np.uint64)
            kept = uniform_at(self.scene.seed, THINNING_STREAM, key) < output.thinning
        blocks = {}
        for kind, species in enumerate(SPECIES):
            if species not in output.species:
                continue
            chosen = np.flatnonzero(kept & (points["kind"] == kind))
            blocks.update(self.writer.table({f"particles/{species}/{column}": points[column][chosen]
                                             for column in ("position", *output.columns, "id")}))
        return blocks


def field_block(grid: Grid, name: str, field: Field) -> Block:
    """This rank's values of a field, without ghosts but with the box's own low face."""
    axis = VELOCITY.index(name) if name in VELOCITY else None
    origin = [0.5 * h for h in grid.spacing]
    starts, shape = list(grid.start), list(grid.cells)
    first = [GHOSTS] * 3
    if axis is not None:
        origin[axis] = 0.0
        shape[axis] += 1
        if grid.at_low_end(axis):
            first[axis] -= 1
        else:
            starts[axis] += 1
    region = [slice(0)] * 3
    for a in range(3):
        region[AXES[a]] = slice(first[a], GHOSTS + grid.count[a])
    return Block(field[tuple(region)], tuple(reversed(starts)), tuple(reversed(shape)),
                 {"origin": origin, "spacing": grid.spacing})


def check_fragments(scene: Scene, fragments: Fragments, path: Path) -> str:
    """What is wrong when fragments were made from another scene, or ""."""
    names = tuple(body.name for body in scene.body)
    if fragments.names != names:
        return (f"{path}: holds the bodies {', '.join(fragments.names)} but the scene has "
                f"{', '.join(names)}; fix: run python -m partition again")
    for index, body in enumerate(scene.body):
        wanted = body.fracture.pieces if body.fracture is not None else 1
        found = int((fragments.body == index).sum())
        if wanted != found:
            return (f"{path}: body {body.name} has {found} pieces but the scene asks for {wanted}; "
                    "fix: run python -m partition again")
    return ""
