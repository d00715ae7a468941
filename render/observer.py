"""Which light does an eye see? The CIE 1931 2° standard observer, kept as a table beside this file.

    python -m render.observer       writes observer.csv again, from colour-science

The library holds it with a thousand other data sets and takes most of two seconds to load, longer
than a frame.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TABLE = Path(__file__).with_name("observer.csv")


def observer() -> tuple[Array, Array]:
    """(wavelengths (n,) in m, xbar, ybar, zbar (n, 3)) from 360 to 830 nm in steps of 1 nm."""
    rows = np.loadtxt(TABLE, delimiter=",")
    return rows[:, 0] * 1e-9, rows[:, 1:]


def from_library() -> Array:
    """(n, 4) wavelength in nm, xbar, ybar, zbar, as colour-science has them."""
    from colour import MSDS_CMFS
    curves = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    return np.column_stack([curves.wavelengths, curves.values])


def main() -> None:
    """Write the table, every digit of it."""
    lines = [",".join(repr(float(x)) for x in row) for row in from_library()]
    TABLE.write_text("# CIE 1931 2 degree observer: wavelength nm, xbar, ybar, zbar; "
                     "python -m render.observer\n" + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
