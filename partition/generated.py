"""Which bodies are generated, by name?

What makes them is loaded only when one is asked for.
"""

import numpy as np
from numpy.typing import NDArray

from partition.graph import Ints

NAMES = ("animal", "bear", "pumpkin", "statue")


def generated(name: str) -> tuple[NDArray[np.float64], Ints]:
    """Vertices (v, 3) and faces (f, 3) of one of `NAMES`, some two units large."""
    from partition.figurines import GENERATED

    return GENERATED[name]()
