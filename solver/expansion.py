"""How fast will the air move that a source of divergence is about to push? Bounds the next step."""

import numpy as np


def source_speed(peak: float, net: float, cells: tuple[int, ...], size: tuple[float, ...]) -> float:
    """The fastest flow that a divergence of at most `peak` [1/s] and of total `net` [L³/s] can
    drive in still air: all of it in a ball of radius R with |∇ψ| ≤ peak R (a disc or a slab where
    the box is one cell thick along one or two axes), L/s."""
    if peak == 0 or net == 0:
        return 0.0
    thin = [s for s, n in zip(size, cells, strict=True) if n == 1]
    dimensions = 3 - len(thin)
    unit = {3: 4 * np.pi / 3, 2: np.pi, 1: 2.0, 0: np.inf}[dimensions]
    extent = net / (peak * unit * float(np.prod(thin)))
    return float(peak * extent ** (1 / max(dimensions, 1)))
