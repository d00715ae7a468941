"""Where are the pieces of the bodies in a frame? Fragments at rest, posed, as triangles.

A vertex at rest X of piece i stands at position[i] + R(q_i) (X - rest_centre[i]).

An inner fracture face is left out while its two pieces have not parted, so that an unbroken pane
shows no cracks: a pair of pieces has parted when some vertex of their common faces, moved with one
piece, is further than `crack_gap` times the body's thickness 2 V / A from itself moved with the
other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partition.fragments import NO_NEIGHBOUR, Fragments
from render.triangles import (Array, Integers, Triangles, box_coordinates, normals,
                              smooth_normals)
from solver.scene_body import Body
from solver.scene_render import Material


def default_material(body: Body) -> str:
    """Panes are glass unless told otherwise."""
    return body.material or ("glass" if body.shape == "pane" else "matt")


@dataclass
class Pieces:
    """The fragments of a run, prepared once, posed for every frame."""

    rest: Triangles
    neighbour: Integers     # (n,) piece on the other side of each triangle, or NO_NEIGHBOUR
    gap: Array              # (n,) L, displacement that parts a pair
    faces: Integers         # (n, 3) vertices of each triangle, for bodies that change their shape
    crease: Array           # (n,) degrees

    @classmethod
    def of(cls, fragments: Fragments, bodies: tuple[Body, ...], materials: Mapping[str, Material],
           crack_gap: float, folder: Path | None = None) -> "Pieces":
        """`bodies` are looked up by the fragments' names, their mesh files in `folder`; `materials`
        in table order."""
        corner = fragments.vertices[fragments.faces]
        piece = fragments.piece_of_face.astype(np.int64)
        neighbour = fragments.face_neighbour.astype(np.int64)
        body = fragments.body[piece]
        outer, inner, crease = _materials(fragments.names, bodies, materials)
        rest = Triangles(corner, normals(corner),
                         smooth_normals(corner, piece, crease[body]), corner,
                         _coordinates(fragments, bodies, corner, folder), np.zeros((len(body), 3)),
                         np.where(neighbour == NO_NEIGHBOUR, outer[body], inner[body]), piece)
        thickness = np.array([_thickness(corner[body == b], neighbour[body == b])
                              for b in range(len(fragments.names))])
        return cls(rest, neighbour, crack_gap * thickness[body], fragments.faces.astype(np.int64),
                   crease[body])

    def shaped(self, poses: Mapping[str, Array]) -> Triangles:
        """The triangles before they are posed: at rest, or as a soft body has been carried."""
        if "vertices" not in poses:
            return self.rest
        corner = np.asarray(poses["vertices"], np.float64)[self.faces]
        return self.rest._replace(corner=corner, normal=normals(corner), smooth=smooth_normals(
            corner, self.rest.piece, self.crease))

    def posed(self, poses: Mapping[str, Array]) -> Triangles:
        """The triangles of one frame, hidden inner faces left out; `poses` as in a snapshot."""
        shown = self.shaped(poses)
        rotation = matrices(poses["orientation"])
        everywhere = _moved(shown.corner, shown.piece, rotation, poses)
        seen = self.neighbour == NO_NEIGHBOUR
        seen |= self.parted(shown.corner, everywhere, rotation, poses)
        turn = rotation[shown.piece[seen]]
        return Triangles(everywhere[seen], np.einsum("nab,nb->na", turn, shown.normal[seen]),
                         np.einsum("nab,ncb->nca", turn, shown.smooth[seen]), shown.rest[seen],
                         shown.uv[seen], shown.glow[seen], shown.material[seen], shown.piece[seen])

    def parted(self, rest: Array, corner: Array, rotation: Array,
               poses: Mapping[str, Array]) -> NDArray[np.bool_]:
        """(n,) whether a triangle is an inner face whose pair of pieces has parted; `rest` and
        `corner` (n, 3, 3) are the triangles before and after they are posed."""
        inner = self.neighbour != NO_NEIGHBOUR
        mine, other = self.rest.piece[inner], self.neighbour[inner]
        carried = _moved(rest[inner], other, rotation, poses)
        drift = np.linalg.norm(corner[inner] - carried, axis=2).max(axis=1)
        pair = np.minimum(mine, other) * len(rotation) + np.maximum(mine, other)
        _, group = np.unique(pair, return_inverse=True)
        furthest = np.zeros(group.max() + 1 if group.size else 0)
        np.maximum.at(furthest, group, drift)
        result = np.zeros(len(inner), bool)
        result[inner] = furthest[group] > self.gap[inner]
        return result


def advanced(poses: Mapping[str, Array], time: float) -> dict[str, Array]:
    """The poses after a short time of steady flight and spin: x + v t, and q turned by omega t."""
    spin = np.asarray(poses["angular_velocity"], np.float64) * time
    angle = np.linalg.norm(spin, axis=1)
    axis = np.divide(spin, angle[:, None], out=np.zeros_like(spin), where=angle[:, None] > 0)
    w, v = np.cos(angle / 2), axis * np.sin(angle / 2)[:, None]
    q = np.asarray(poses["orientation"], np.float64)
    turned = np.column_stack([w * q[:, 0] - (v * q[:, 1:]).sum(axis=1),
                              w[:, None] * q[:, 1:] + q[:, :1] * v + np.cross(v, q[:, 1:])])
    return {**poses, "position": poses["position"] + time * np.asarray(poses["velocity"]),
            "orientation": turned}


def matrices(q: Array) -> Array:
    """(n, 3, 3) rotation matrices of unit quaternions (w, x, y, z)."""
    q = np.asarray(q, np.float64)
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
                    ).transpose(2, 0, 1)


def _moved(corner: Array, piece: Integers, rotation: Array, poses: Mapping[str, Array]) -> Array:
    offset = corner - poses["rest_centre"][piece][:, None]
    return poses["position"][piece][:, None] + np.einsum("nab,ncb->nca", rotation[piece], offset)


def _coordinates(fragments: Fragments, bodies: tuple[Body, ...], corner: Array,
                 folder: Path | None) -> Array:
    """(n, 3, 2) u and v of all triangles: of the bodies' mesh files where they have them."""
    owner = fragments.body[fragments.piece_of_face].astype(np.int64)
    uv = box_coordinates(corner, owner)
    for body in bodies:
        if body.shape == "mesh" and folder is not None and body.name in fragments.names:
            from render.wrapping import wrapped
            outer = (owner == fragments.names.index(body.name)) & (
                fragments.face_neighbour == NO_NEIGHBOUR)
            uv[outer] = wrapped(body, folder, corner[outer], uv[outer])
    return uv


def _thickness(corner: Array, neighbour: Integers) -> float:
    """2 V / A of a closed body: the thickness of a plate."""
    volume = np.einsum("na,na->n", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6
    outside = corner[neighbour == NO_NEIGHBOUR]
    area = np.linalg.norm(np.cross(outside[:, 1] - outside[:, 0], outside[:, 2] - outside[:, 0]),
                          axis=1).sum() / 2
    return float(2 * abs(volume) / area) if area > 0 else 0.0


def _materials(names: tuple[str, ...], bodies: tuple[Body, ...],
               materials: Mapping[str, Material]) -> tuple[Integers, Integers, Array]:
    """Per body: index of its outer and its inner material, crease angle (glass is flat)."""
    order = list(materials)
    by_name = {body.name: default_material(body) for body in bodies}
    outer = [by_name.get(name, "matt") for name in names]
    inner = [materials[name].inner or name for name in outer]
    crease = [0.0 if materials[name].kind == "glass" else materials[name].crease for name in outer]
    return (np.array([order.index(name) for name in outer], np.int64),
            np.array([order.index(name) for name in inner], np.int64), np.array(crease))
