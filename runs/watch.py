"""What a viewer of a film would say, asked of the stored numbers.

Every function takes a run and returns a `Finding`: the claim with the number behind it, and
whether it holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from partition import fragments as pieces
from partition.fragments import Fragments
from render.image import load_png
from render.sequence import frame_path
from solver.files import read_snapshot, snapshot_frames
from solver.inertia import tetrahedra
from solver.results.pose import posed
from solver.scene import Scene

Array = NDArray[Any]
LANDED = 0.12       # L: a piece whose centre is nearer to the ground than this has fallen
MOST = 0.75         # more than this share of the pieces
BRIGHTER = 40       # of 255: of a pixel that shows fire
SEEN = 0.005        # share of such pixels from which on there is fire
SLOW = 0.1          # of the largest speed of the film: at rest, but for a last rocking


@dataclass(frozen=True)
class Finding:
    """A claim in words, with its number, and whether it holds."""

    text: str
    holds: bool


@dataclass(frozen=True)
class Run:
    """The pieces of a run over its frames.

    time (f,); position (f, n, 3), orientation (f, n, 4), velocity (f, n, 3); mass (n,);
    shape (f, nv, 3): the vertices as they are drawn
    """

    path: Path
    scene: Scene
    fragments: Fragments
    time: Array
    position: Array
    orientation: Array
    velocity: Array
    mass: Array
    shape: Array

    @classmethod
    def read(cls, path: Path, scene: Scene) -> Run:
        """All snapshots of a run, without their fields."""
        fragments = pieces.read(path / "fragments.h5")
        frames = [read_snapshot(path, frame, ()) for frame in snapshot_frames(path)]
        bodies = [frame.bodies for frame in frames]
        column = {name: np.array([body[name] for body in bodies])
                  for name in ("position", "orientation", "velocity")}
        shape = np.array([posed(fragments, body) for body in bodies])
        return cls(path, scene, fragments, np.array([frame.time for frame in frames]),
                   mass=np.asarray(bodies[0]["mass"]), shape=shape, **column)

    @property
    def speed(self) -> Array:
        """(f, n) of the centres."""
        return np.linalg.norm(self.velocity, axis=2)


def centre_first(run: Run) -> Finding:
    """When the pane parts, some of it two thicknesses ahead of the rest, its middle has moved
    farther than its rim."""
    moved = np.linalg.norm(run.shape - run.shape[0], axis=2)
    frame = int(np.argmax(np.ptp(moved, axis=1) > 2 * run.scene.body[0].size[2]))
    away = np.linalg.norm((run.shape[0] - run.scene.detonation.position)[:, :2], axis=1)
    inner, outer = away < np.quantile(away, 0.25), away > np.quantile(away, 0.75)
    ratio = moved[frame][inner].mean() / moved[frame][outer].mean()
    return Finding(f"the pane parts from its centre: at t = {run.time[frame]:.3g} its inner "
                   f"quarter has moved {ratio:.2f} times as far as its outer",
                   bool(ratio > 1.05))


def small_fly_faster(run: Run) -> Finding:
    """Rank correlation of mass and highest level speed, and the halves' means: how far it flies,
    not how deep it falls."""
    fastest = np.linalg.norm(run.velocity[:, :, [0, 2]], axis=2).max(axis=0)
    rank = float(spearmanr(run.mass, fastest).statistic)
    light = run.mass <= np.median(run.mass)
    return Finding(f"small pieces fly faster: the lighter half at {fastest[light].mean():.2f} L/s, "
                   f"the heavier at {fastest[~light].mean():.2f}; rank correlation {rank:.2f}",
                   rank < 0)


def comes_to_rest(run: Run) -> Finding:
    """In the last frame most pieces lie on the ground and move no more, or hardly."""
    ground = run.scene.obstacle[0].place[1]
    low = np.array([run.shape[-1][run.fragments.piece_of_vertex == n, 1].min()
                    for n in range(len(run.mass))]) - ground
    slow = run.speed[-1] < SLOW * run.speed.max()
    lies = (low < LANDED) & slow
    return Finding(f"pieces fall and come to rest: {lies.sum()} of {len(lies)} lie on the ground "
                   f"at the end, {(run.speed[-1] == 0).sum()} of them quite still; the lowest "
                   f"corner is {low.min():.1e} above it",
                   bool(lies.mean() > MOST and low.min() > -1e-5))


def head_alone_breaks(run: Run) -> Finding:
    """The heaviest piece, the body, stays; the others, cut off beyond the neck, are thrown."""
    moved = np.linalg.norm(run.position[-1] - run.position[0], axis=1)
    body = int(run.mass.argmax())
    head = np.delete(np.arange(len(run.mass)), body)
    neck = float(run.position[0, head, 0].min() - run.position[0, body, 0])
    holds = neck > 0 and moved[body] < 0.25 * np.median(moved[head])
    return Finding(f"the head comes off and only it breaks: the body moves {moved[body]:.3f} L, "
                   f"the {len(head)} pieces of the head {np.median(moved[head]):.2f} L",
                   bool(holds))


def swells_before_it_bursts(run: Run) -> Finding:
    """Until its pieces part, the surface encloses ever more."""
    whole = np.all(run.orientation == run.orientation[0], axis=(1, 2))
    last = int(np.argmin(whole)) - 1 if not whole.all() else len(whole) - 1
    volume = [enclosed(run, frame) for frame in range(last + 1)]
    growth = volume[-1] / volume[0]
    return Finding(f"it swells before it bursts: {growth:.2f} times its volume at t = "
                   f"{run.time[last]:.3g}, then {len(run.mass)} pieces", bool(growth > 1.2))


def enclosed(run: Run, frame: int) -> float:
    """Volume inside the body's own surface, by tetrahedra."""
    corner = run.shape[frame][run.fragments.faces[run.fragments.face_neighbour < 0]]
    corner = corner - corner.mean(axis=(0, 1))
    return float(tetrahedra(corner).sum())


def red_to_yellow(run: Run) -> Finding:
    """Green per red of what has become brighter than at first, from when it appears to when it
    is the most yellow."""
    frames = [frame_path(run.path / "frames", frame) for frame in snapshot_frames(run.path)]
    dark = load_png(frames[0]).astype(float)
    shades = []
    for path in frames:
        picture = load_png(path).astype(float)
        r, g, b = np.moveaxis(picture, 2, 0)
        fire = (r - dark[..., 0] > BRIGHTER) & (r > 2.5 * b)
        shades.append(np.percentile(g[fire] / r[fire], 90) if fire.mean() > SEEN else np.nan)
    seen = np.flatnonzero(~np.isnan(shades))
    if not len(seen):
        return Finding("colours run from red to yellow: no fire is seen", False)
    hottest = int(np.nanargmax(shades))
    first, most = shades[seen[0]], shades[hottest]
    return Finding(f"colours run from red to yellow as the fire heats: green per red {first:.2f} "
                   f"when it appears at t = {run.time[seen[0]]:.3g}, {most:.2f} at "
                   f"{run.time[hottest]:.3g}, {shades[seen[-1]]:.2f} at the last",
                   bool(most > first + 0.05))


def goes_round_outwards(run: Run) -> Finding:
    """Turns about the middle of the box, and by how much the distance from it has grown."""
    size = run.scene.domain.size
    x, y = (run.position[:, 0, axis] - size[axis] / 2 for axis in (0, 1))
    angle, away = np.unwrap(np.arctan2(y, x)), np.hypot(x, y)
    turn = np.unwrap(2 * np.arctan2(run.orientation[:, 0, 3], run.orientation[:, 0, 0]))
    turns = (angle[-1] - angle[0]) / (2 * np.pi)
    holds = np.all(np.diff(angle) > 0) and away[-1] > 1.5 * away[0] and turns > 0.5
    return Finding(f"the block is carried round and outwards: {turns:.2f} times round the middle, "
                   f"turning {(turn[-1] - turn[0]) / (2 * np.pi):.2f} times, from {away[0]:.2f} to "
                   f"{away[-1]:.2f} L off it",
                   bool(holds))
