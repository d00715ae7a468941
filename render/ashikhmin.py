"""How does brushed metal or varnish answer light? The BRDF of Ashikhmin and Shirley (2000).

k1 towards the light, k2 towards the viewer, h half way, n the normal, u and v tangents:
    rho_s = sqrt((n_u + 1)(n_v + 1)) / (8 pi) * (n·h)^e / ((h·k1) max(n·k1, n·k2)) * F(h·k1)
    e     = (n_u (h·u)² + n_v (h·v)²) / (1 - (n·h)²)
    F(c)  = R_s + (1 - R_s)(1 - c)^5
    rho_d = 28 R_d / (23 pi) (1 - R_s) (1 - (1 - n·k1 / 2)^5) (1 - (1 - n·k2 / 2)^5)
The thesis prints n·k1 for h·k1 in the denominator, which is not reciprocal. At h = n, where e is
0/0, (n·h)^e is 1. In units of Phong's R_d N·L the radiance is pi (rho_d + rho_s) n·k1.
"""

import numpy as np

from render.kernel import kernel
from render.vector import Three, cross, dot, scaled, unit


@kernel
def specular(n: Three, u: Three, k1: Three, k2: Three, n_u: float, n_v: float) -> float:
    """rho_s without F; 0 where the light or the viewer is behind the surface."""
    a, b = dot(n, k1), dot(n, k2)
    if a <= 0.0 or b <= 0.0:
        return 0.0
    h = unit((k1[0] + k2[0], k1[1] + k2[1], k1[2] + k2[2]))
    across, along = dot(h, u), dot(h, cross(n, u))
    nh, rest = min(dot(n, h), 1.0), across * across + along * along   # rest = 1 - (n·h)²
    lobe = nh ** ((n_u * across * across + n_v * along * along) / rest) if rest > 1e-14 else 1.0
    return np.sqrt((n_u + 1.0) * (n_v + 1.0)) / (8.0 * np.pi) * lobe / (dot(h, k1) * max(a, b))


@kernel
def grazing(k1: Three, k2: Three) -> float:
    """(1 - h·k1)^5, the share of the way from R_s to 1 that F has gone."""
    h = unit((k1[0] + k2[0], k1[1] + k2[1], k1[2] + k2[2]))
    return (1.0 - min(dot(h, k1), 1.0)) ** 5


@kernel
def diffuse(r_d: float, r_s: float, cosine_1: float, cosine_2: float) -> float:
    """rho_d from n·k1 and n·k2."""
    if cosine_1 <= 0.0 or cosine_2 <= 0.0:
        return 0.0
    return (28.0 * r_d / (23.0 * np.pi) * (1.0 - r_s) * (1.0 - (1.0 - 0.5 * cosine_1) ** 5)
            * (1.0 - (1.0 - 0.5 * cosine_2) ** 5))


@kernel
def lighting(n: Three, u: Three, k1: Three, k2: Three, r_d: Three, r_s: Three, n_u: float,
             n_v: float) -> Three:
    """pi (rho_d + rho_s) n·k1 for colours R_d and R_s."""
    lobe, edge = specular(n, u, k1, k2, n_u, n_v), grazing(k1, k2)
    dull = diffuse(1.0, 0.0, dot(n, k1), dot(n, k2))
    return scaled((dull * r_d[0] * (1.0 - r_s[0]) + lobe * (r_s[0] + (1.0 - r_s[0]) * edge),
                   dull * r_d[1] * (1.0 - r_s[1]) + lobe * (r_s[1] + (1.0 - r_s[1]) * edge),
                   dull * r_d[2] * (1.0 - r_s[2]) + lobe * (r_s[2] + (1.0 - r_s[2]) * edge)),
                  np.pi * max(dot(n, k1), 0.0))
