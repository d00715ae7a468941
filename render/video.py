"""How do frames become a film? H.264 in an MP4 that plays everywhere, or an animated GIF."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from solver.files_whole import replacing


def write_film(path: Path, pictures: Iterable[NDArray[np.uint8]], fps: int) -> None:
    """Join (height, width, 3) pictures of one size to a film of the kind that the suffix says."""
    write_gif(path, pictures, fps) if path.suffix == ".gif" else write_mp4(path, pictures, fps)


def write_gif(path: Path, pictures: Iterable[NDArray[np.uint8]], fps: int) -> None:
    """A GIF that loops, each frame in its own 256 colours; its clock ticks in 1/100 s."""
    from PIL import Image
    first, *rest = [Image.fromarray(picture).quantize(256) for picture in pictures]
    with replacing(path) as temporary:
        first.save(temporary, "GIF", save_all=True, append_images=rest, loop=0,
                   duration=max(20, round(100 / fps) * 10))


def write_mp4(path: Path, pictures: Iterable[NDArray[np.uint8]], fps: int) -> None:
    """H.264; odd sizes grow by a repeated edge.

    yuv420p, because many players know no other pixel format, needs even edges.
    """
    import av
    options = {"movflags": "faststart"}
    with replacing(path) as temporary, av.open(str(temporary), "w", format="mp4",
                                               options=options) as film:
        stream = None
        for picture in pictures:
            height, width = picture.shape[:2]
            even = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
            if stream is None:
                stream = film.add_stream("libx264", rate=fps, options={"crf": "16",
                                                                       "preset": "medium"})
                stream.width, stream.height = even.shape[1], even.shape[0]
                stream.pix_fmt = "yuv420p"
                stream.codec_context.thread_count = 1
            film.mux(stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")))
        if stream is not None:
            film.mux(stream.encode())
