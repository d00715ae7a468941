"""How does light split at glass? Reflection, Snell's law, total internal reflection, Schlick.

With i the ray's direction, n the normal against it, c = -i·n and eta = n_from / n_to:
    r = i + 2 c n
    t = eta i + (eta c - sqrt(1 - eta² (1 - c²))) n,   none where the radicand is negative
    R = R0 + (1 - R0) (1 - c')^5,   R0 = ((eta - 1) / (eta + 1))²
c' is the cosine on the thin side (Schlick 1994). The thesis prints two signs of c that exclude each
other; these hold together.
"""

import numpy as np

from render.kernel import kernel
from render.vector import Three, along, dot


@kernel
def reflect(i: Three, n: Three) -> Three:
    """The mirrored direction; either sign of n gives the same."""
    return along(i, -2.0 * dot(i, n), n)


@kernel
def refract(i: Three, n: Three, eta: float) -> tuple[float, Three]:
    """(share reflected, direction transmitted); (1, zero) at total internal reflection."""
    c = -dot(i, n)
    radicand = 1.0 - eta * eta * (1.0 - c * c)
    if radicand < 0.0:
        return 1.0, (0.0, 0.0, 0.0)
    cosine = np.sqrt(radicand)
    bend = eta * c - cosine
    t = (eta * i[0] + bend * n[0], eta * i[1] + bend * n[1], eta * i[2] + bend * n[2])
    return schlick(cosine if eta > 1.0 else c, eta), t


@kernel
def schlick(cosine: float, eta: float) -> float:
    """The share reflected, at a cosine measured in the thinner medium."""
    r0 = ((eta - 1.0) / (eta + 1.0)) ** 2
    x = 1.0 - min(cosine, 1.0)
    return r0 + (1.0 - r0) * x * x * x * x * x
