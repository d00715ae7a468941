"""How does light become a picture? Tone curve, sRGB, PNG; linear light with layers as EXR.

    film    x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), Narkowicz' fit of the ACES film curve
    sRGB    12.92 x below 0.0031308, else 1.055 x^(1/2.4) - 0.055
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from solver.files import FileError
from solver.files_whole import replacing

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]


def developed(light: Array, exposure: float, tone: str) -> Bytes:
    """(height, width, 3) sRGB bytes of linear light."""
    x = np.maximum(light * exposure, 0)
    if tone == "film":
        x = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return np.asarray(np.round(255 * srgb(np.clip(x, 0, 1))), np.uint8)


def srgb(x: Array) -> Array:
    """The transfer function of sRGB on [0, 1]."""
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def save_png(path: Path, picture: Bytes, made_from: str) -> None:
    """Write a PNG under its name only when it is complete; `made_from` is kept inside it."""
    note = PngInfo()
    note.add_text("made-from", made_from)
    with replacing(path) as temporary:
        Image.fromarray(picture).save(temporary, "PNG", pnginfo=note, compress_level=3)


def made_from(path: Path) -> str:
    """What a PNG of ours was made from; empty if it is not one."""
    try:
        with Image.open(path) as image:
            return str(image.info.get("made-from", ""))
    except (OSError, SyntaxError):
        return ""


def load_png(path: Path) -> Bytes:
    """(height, width, 3) bytes."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def save_exr(path: Path, light: Array, layers: Mapping[str, NDArray[Any]]) -> None:
    """Write linear light (height, width, 3) and layers (height, width) by channel name."""
    import OpenEXR
    channels = {"RGB": light.astype(np.float32), **layers}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with replacing(path) as temporary, OpenEXR.File(header, channels) as file:
        file.write(str(temporary))


def load_linear(path: Path) -> Array:
    """(height, width, 3) linear RGB of a picture in sRGB; raises `FileError`."""
    try:
        values = load_png(path) / 255.0
    except (OSError, SyntaxError) as error:
        raise FileError(f"{path}: not a readable picture ({error}); fix: PNG or JPEG") from None
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def contact_sheet(path: Path, pictures: Iterable[Bytes], columns: int) -> None:
    """Write pictures of one size, side by side in rows, as one PNG, or as the JPEG of a .jpg."""
    tiles = list(pictures)
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % columns)
    rows = [np.concatenate(tiles[i:i + columns], axis=1) for i in range(0, len(tiles), columns)]
    kind = "JPEG" if path.suffix in (".jpg", ".jpeg") else "PNG"
    with replacing(path) as temporary:
        Image.fromarray(np.concatenate(rows)).save(temporary, kind, quality=90, optimize=True)
