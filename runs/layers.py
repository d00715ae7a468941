"""What is in the layers of an EXR frame? Light, depth, normal, piece and temperature side by side.

    python -m runs.layers FRAME.exr PICTURE.jpg
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.image import developed

Array = NDArray[Any]


def main(arguments: list[str]) -> int:
    """Draw the layers of one frame; returns an exit code."""
    if len(arguments) != 2:
        print("runs.layers: fix: python -m runs.layers FRAME.exr PICTURE.jpg", file=sys.stderr)
        return 2
    from PIL import Image
    tiles = strip(channels(Path(arguments[0])))
    Image.fromarray(np.concatenate(tiles, axis=1)).save(arguments[1], quality=85, optimize=True)
    return 0


def channels(path: Path) -> dict[str, Array]:
    """(height, width) arrays by their names in the file."""
    import OpenEXR
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def strip(layer: dict[str, Array]) -> list[NDArray[np.uint8]]:
    """Pictures (height, width, 3): light; depth, near is bright; normal as (n + 1) / 2; every piece
    in a colour of its own; temperature, from the coldest to the hottest."""
    from matplotlib import colormaps
    light = developed(np.stack([layer[c] for c in "RGB"], axis=-1).astype(float), 1.0, "film")
    met = np.isfinite(layer["Z"])
    near = np.where(met, layer["Z"][met].min() / np.where(met, layer["Z"], 1.0), 0.0)
    normal = np.stack([layer[f"normal.{axis}"] for axis in "XYZ"], axis=-1)
    piece, heat = layer["piece.id"].astype(np.int64), layer["temperature.T"]
    warm = (heat - heat.min()) / max(float(np.ptp(heat)), 1e-9)
    colours = np.where((piece > 0)[..., None], colormaps["tab20"]((piece - 1) % 20)[..., :3], 0.0)
    return [light, *(np.asarray(np.round(255 * tile), np.uint8) for tile in (
        np.repeat(near[..., None], 3, axis=-1), np.where(met[..., None], (normal + 1) / 2, 0.0),
        colours, colormaps["inferno"](warm)[..., :3]))]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
