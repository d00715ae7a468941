"""What came out of a partition, as tables for a terminal."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from partition import fragments
from partition.cut import CutMade
from partition.fragments import Fragments
from partition.graph import numbered, union

MAX_ROWS = 64


def of_pieces(pieces: Fragments) -> str:
    """One row per piece, and one for all."""
    rows, parts = fragments.table(pieces), connected_parts(pieces)
    lines = [f"{'piece':>5}  {'body':<16} {'triangles':>9} {'parts':>5} {'area':>11} "
             f"{'volume':>11}"]
    for index, row in enumerate(rows):
        volume = f"{row['volume']:11.4g}" if pieces.closed[index] else f"{'open':>11}"
        lines.append(f"{index:5d}  {row['body'].decode():<16.16} {row['triangles']:9d} "
                     f"{parts[index]:5d} {row['area']:11.4g} {volume}")
    lines = _shortened(lines)
    lines.append(f"{'all':>5}  {'':<16} {rows['triangles'].sum():9d} {parts.sum():5d} "
                 f"{rows['area'].sum():11.4g} {rows['volume'].sum():11.4g}")
    return "\n".join(lines)


def of_cuts(cuts: Sequence[CutMade]) -> str:
    """One row per spectral cut, in the order in which they were made."""
    lines = [f"{'cut':>5} {'triangles':>9} {'smaller':>9} {'length':>10} {'lambda2':>10} "
             f"{'l3/l2':>8} {'residual':>9} {'iter':>5} {'seconds':>8}"]
    for index, made in enumerate(cuts):
        lines.append(f"{index:5d} {made.triangles:9d} {made.smaller:9d} {made.length:10.4g} "
                     f"{made.eigenvalue:10.4g} {made.ratio:8.4g} {made.residual:9.1e} "
                     f"{made.iterations:5d} {made.seconds:8.3f}")
    return "\n".join(_shortened(lines))


def connected_parts(pieces: Fragments) -> NDArray[np.int64]:
    """(n,) in how many parts each piece is; two triangles hang together by a common vertex."""
    a, b, c = pieces.faces.astype(np.int64).T
    part = numbered(union(len(pieces.vertices), np.concatenate([a, b]), np.concatenate([b, c])))
    _, first = np.unique(part, return_index=True)
    return np.bincount(pieces.piece_of_vertex[first], minlength=pieces.count).astype(np.int64)


def _shortened(lines: list[str]) -> list[str]:
    """Without the middle of a long table."""
    if len(lines) <= MAX_ROWS:
        return lines
    return [*lines[:MAX_ROWS // 2], f"{'...':>5}", *lines[-MAX_ROWS // 2:]]
