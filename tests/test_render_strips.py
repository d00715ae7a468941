"""`python -m runs.layers` shows the layers of an EXR frame side by side, each as it is meant."""

import numpy as np
import pytest

from render.image import load_png, save_exr
from runs import layers


@pytest.fixture
def frame(tmp_path):
    """Two by three pixels: a near and a far piece, ground, and nothing in the last column."""
    depth = np.array([[1.0, 2.0, np.inf], [4.0, 4.0, np.inf]], np.float32)
    normal = np.zeros((2, 3, 3), np.float32)
    normal[:, :2] = (0, 1, 0)
    save_exr(tmp_path / "frame.exr", np.full((2, 3, 3), 0.5), {
        "Z": depth, "piece.id": np.array([[1, 2, 0], [0, 0, 0]], np.uint32),
        "temperature.T": np.array([[5, 5, 65], [5, 5, 35]], np.float32),
        **{f"normal.{axis}": np.ascontiguousarray(normal[..., i])
           for i, axis in enumerate("XYZ")}})
    return tmp_path / "frame.exr"


@pytest.mark.serial
def test_layers_side_by_side(frame):
    light, depth, normal, piece, heat = layers.strip(layers.channels(frame))
    assert np.ptp(light) == 0 < light.min()
    assert depth[..., 0].tolist() == [[255, 128, 0], [64, 64, 0]]
    assert normal[0, 0].tolist() == [128, 255, 128] and not normal[:, 2].any()
    colours = {tuple(piece[0, 0]), tuple(piece[0, 1]), (0, 0, 0)}
    assert len(colours) == 3 and not piece[1].any() and not piece[0, 2].any()
    bright = heat.sum(axis=-1)
    assert bright[0, 2] > bright[1, 2] > bright[0, 0] == bright[1, 1]


@pytest.mark.serial
def test_command_writes_one_picture_and_asks_for_both_names(frame, capsys):
    picture = frame.with_suffix(".png")
    assert layers.main([str(frame)]) == 2 and capsys.readouterr().err.count("\n") == 1
    assert layers.main([str(frame), str(picture)]) == 0
    assert load_png(picture).shape == (2, 5 * 3, 3)
