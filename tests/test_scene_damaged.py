"""Whatever a scene file holds, it is a scene or one clear line; nothing in it is executed."""

import tomllib

import numpy as np
import pytest

from runs.stress import fuzz, malformed
from solver.scene import LONGEST_MESSAGE, SceneError, load, save

pytestmark = pytest.mark.serial


@pytest.mark.parametrize("seed", range(10))
def test_random_mistakes(seed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    random, path = np.random.default_rng(seed), tmp_path / "scene.toml"
    for text in malformed.valid_scenes():
        path.write_bytes(fuzz.damaged(text, tomllib.loads(text), random))
        try:
            save(load(path), tmp_path / "as_run.toml")
            assert load(tmp_path / "as_run.toml")
        except SceneError as error:
            message = str(error)
            assert message.startswith(str(path)) and message.isprintable(), message
            assert len(message) <= LONGEST_MESSAGE + 4
    assert {name.name for name in tmp_path.iterdir()} <= {"scene.toml", "as_run.toml"}


@pytest.mark.parametrize("text, words", [
    ("[INITIAL]\nu = '0'", ["INITIAL", "unknown key"]), ("[Fuel]", ["Fuel", "unknown key"]),
    ("a = " + "[" * 3000, ["not valid TOML", "fix"]), ("a = " + "9" * 6000, ["not valid TOML"]),
    ("\x00", ["not valid TOML"]), ("t" * 9000 + " = 1", ["unknown key"])])
def test_mistakes_that_once_ended_in_a_traceback(text, words, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("[time]\nend = 1.0\nframe = 0.1\n" + text)
    with pytest.raises(SceneError) as caught:
        load(path)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_text_that_is_no_name_of_a_file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(f'title = "{"long " * 100}"\n[time]\nend = 1.0\nframe = 0.1\n')
    save(load(path), tmp_path / "as_run.toml")
    assert load(tmp_path / "as_run.toml").title.startswith("long")
