"""The camera: the pixel that a point falls on, sharpness at the focus, blur by motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from render.camera import camera_rays, middle_rays, pinhole, sample_weights
from render.hashing import mix, uniform
from render.pieces import advanced, matrices
from solver.scene_render import Camera
from tests.render_run import WINDOW
from tests.test_render_scene import film_of, snapshot

BOX = (1.0, 1.0, 1.0)


def test_weights_of_the_thesis_normalised():
    for n, total in ((1, 1), (2, 4), (3, 9.5), (4, 18)):
        weights = sample_weights(n)
        assert weights.sum() == pytest.approx(1, rel=1e-15)
        assert weights[0] == pytest.approx(1 / total)


@pytest.mark.parametrize(("width", "height"), [(40, 40), (60, 20), (20, 60)])
def test_middle_rays_look_where_they_should(width, height):
    view = pinhole(Camera(position=(3, 1, 2), target=(0, 1, -1), fov=50), BOX, width, height)
    rays = middle_rays(view, (width, height))
    direction = rays.direction.reshape(height, width, 3)
    middle = direction[height // 2 - 1:height // 2 + 1, width // 2 - 1:width // 2 + 1].mean((0, 1))
    assert middle / np.linalg.norm(middle) == pytest.approx(np.array((-1, 0, -1)) / np.sqrt(2))
    assert direction[0, 0, 1] > 0 > direction[-1, 0, 1]
    right = np.cross(view.forward, (0, 1, 0))
    assert direction[0, -1] @ right > 0 > direction[0, 0] @ right
    # fov spans the shorter edge, from pixel middle to pixel middle one pixel less
    n = min(width, height)
    ends = ((direction[height // 2, 0], direction[height // 2, -1]) if width <= height else
            (direction[0, width // 2], direction[-1, width // 2]))
    tangents = [np.sqrt(1 / (d @ view.forward) ** 2 - 1) for d in ends]
    assert max(tangents) == pytest.approx(np.tan(np.radians(25)) * (n - 1) / n, rel=2e-2)


def test_samples_stay_in_their_sub_pixels_and_fill_them():
    view = pinhole(Camera(), BOX, 30, 20)
    rays = camera_rays(view, (30, 20), np.arange(600), 3, 5)
    d = rays.direction
    s = (d @ view.right / (view.right @ view.right) / (d @ view.forward) + 1) * 15
    t = (d @ view.down / (view.down @ view.down) / (d @ view.forward) + 1) * 10
    sub = np.arange(len(s)) % 9
    x, y = (s - rays.pixel % 30) * 3 - sub % 3, (t - rays.pixel // 30) * 3 - sub // 3
    for offset in (x, y):
        assert -1e-9 < offset.min() < 0.01 and 0.99 < offset.max() < 1 + 1e-9
        assert offset.mean() == pytest.approx(0.5, abs=0.02)


def test_hash_is_uniform_and_does_not_depend_on_the_machine():
    values = np.array([uniform(mix(7, i), 1) for i in range(20_000)])
    counts = np.histogram(values, 20, (0, 1))[0]
    assert abs(counts - 1000).max() < 5 * np.sqrt(1000)
    assert getattr(mix, "py_func")(12, 34) == mix(12, 34)


def test_what_is_in_focus_is_sharp():
    """All rays of a pixel's middle meet at the distance of focus, and only there."""
    camera = Camera(position=(0, 0, 5), target=(0, 0, 0), aperture=0.2, focus=3.0)
    view = pinhole(camera, BOX, 1, 1)
    rays = camera_rays(view, (1, 1), np.arange(1), 8, 1)
    sharp = camera_rays(pinhole(Camera(position=(0, 0, 5), target=(0, 0, 0)), BOX, 1, 1), (1, 1),
                        np.arange(1), 8, 1)

    def at(batch, depth):
        t = depth / -batch.direction[:, 2]
        return batch.origin + t[:, None] * batch.direction

    assert at(rays, 3.0) == pytest.approx(at(sharp, 3.0), abs=1e-12)
    radius = np.linalg.norm(rays.origin - view.eye, axis=1)
    assert radius.max() <= 0.2 and (radius ** 2).mean() == pytest.approx(0.02, rel=0.25)
    assert abs(at(rays, 5.0) - at(sharp, 5.0)).max() > 0.05


def test_poses_advance_by_velocity_and_spin():
    turn = Rotation.from_rotvec([[0.3, -0.2, 0.9]])
    x, y, z, w = turn.as_quat()[0]
    poses = {"position": np.array([[1.0, 2, 3]]), "orientation": np.array([[w, x, y, z]]),
             "velocity": np.array([[4.0, 0, -1]]), "angular_velocity": np.array([[0, 2.0, 1.0]])}
    later = advanced(poses, 0.25)
    assert later["position"] == pytest.approx(np.array([[2, 2, 2.75]]))
    expected = (Rotation.from_rotvec([[0, 0.5, 0.25]]) * turn).as_matrix()
    assert matrices(later["orientation"]) == pytest.approx(expected, abs=1e-12)
    assert matrices(advanced(poses, 0.0)["orientation"]) == pytest.approx(turn.as_matrix())


def test_moving_pieces_blur_and_resting_ones_do_not():
    def seen(shutter, moving):
        film = film_of({**WINDOW, "render": {"width": 24, "height": 24, "samples": 3,
                                             "camera": {"shutter": shutter}}})
        moment = snapshot(film, 0.1)
        velocity = np.full_like(moment.bodies["velocity"], 8.0 if moving else 0.0)
        moment.bodies["velocity"] = velocity
        return film.frame(moment).light

    assert np.array_equal(seen(0.0, True), seen(0.0, False))
    assert seen(1.0, False) == pytest.approx(seen(0.0, False), abs=1e-12)
    assert abs(seen(1.0, True) - seen(0.0, True)).max() > 0.05
