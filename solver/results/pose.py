"""Which frames can be joined to one, and where do the vertices of the pieces stand in them?

x = position + R(orientation) (X - rest_centre), X at rest, or as a soft body has been carried.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition.fragments import Fragments
from solver.files import FileError, Snapshot, read_snapshot, snapshot_path

NEEDED = ("position", "orientation", "rest_centre")


def moments(run: Path, frames: Sequence[int]) -> list[Snapshot]:
    """The frames without their fields; raises `FileError` unless all hold the same tables."""
    found = [read_snapshot(run, frame, ()) for frame in frames]
    for snapshot in found:
        missing = _columns(found[0]) ^ _columns(snapshot)
        missing |= _needed(snapshot) - _columns(snapshot)
        if missing:
            raise FileError(f"{snapshot_path(run, snapshot.frame)}: does not hold what the other "
                            f"frames hold ({', '.join(sorted(missing)[:3])}); fix: make it again")
    return found


def _columns(snapshot: Snapshot) -> set[str]:
    return {f"particles/{kind}/{name}" for kind, table in snapshot.particles.items()
            for name in table} | {f"bodies/{name}" for name in snapshot.bodies}


def _needed(snapshot: Snapshot) -> set[str]:
    """What no table can do without."""
    return {f"particles/{kind}/{name}" for kind in snapshot.particles
            for name in ("position", "id")} | {f"bodies/{name}" for name in (*NEEDED, "velocity")
                                               if snapshot.bodies}


def posed(fragments: Fragments, bodies: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """(nv, 3) the vertices of all pieces; `bodies` as in a snapshot. Raises `FileError`."""
    rest = shape_at_rest(fragments, bodies)
    owner = fragments.piece_of_vertex
    turned = rotate(bodies["orientation"][owner], rest - bodies["rest_centre"][owner])
    return np.asarray(bodies["position"][owner] + turned, np.float64)


def shape_at_rest(fragments: Fragments, bodies: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """(nv, 3) the vertices before they are posed."""
    if any(len(bodies.get(name, ())) != fragments.count for name in NEEDED):
        raise FileError(f"the snapshot does not pose the {fragments.count} pieces of fragments.h5; "
                        "fix: give the folder of one run")
    rest = np.asarray(bodies.get("vertices", fragments.vertices), np.float64)
    if rest.shape != fragments.vertices.shape:
        raise FileError("the snapshot has other vertices than fragments.h5; fix: give the folder "
                        "of one run")
    return rest


def rotate(quaternion: NDArray[Any], vector: NDArray[Any]) -> NDArray[np.float64]:
    """v + 2 w (q × v) + 2 q × (q × v) for unit quaternions (w, q), row by row."""
    scalar, axis = quaternion[:, :1], quaternion[:, 1:]
    once = np.cross(axis, vector)
    return np.asarray(vector + 2 * scalar * once + 2 * np.cross(axis, once))
