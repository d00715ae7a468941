"""The number of ranks changes nothing but round-off, and too many are refused."""

import numpy as np
import pytest

SOLVER_TOLERANCE = 1e-8    # of the largest value; the pressure is solved to 1e-10 in every substep
ROUND_OFF = 1e-13


@pytest.fixture(scope="module")
def one_rank(tmp_path_factory):
    return {}


@pytest.mark.serial
@pytest.mark.parametrize("ranks", [2, 3, 4])
def test_twenty_steps_are_the_same_on_any_number_of_ranks(ranks, mpirun, tmp_path_factory,
                                                          one_rank):
    folder = tmp_path_factory.mktemp("ranks")

    def run(number):
        path = folder / f"{number}.npz"
        done = mpirun(number, "-m", "tests.flow_ranks", path)
        assert done.returncode == 0, done.stdout
        return dict(np.load(path))

    if not one_rank:
        one_rank.update(run(1))
    found = run(ranks)
    assert found.keys() == one_rank.keys()
    assert one_rank["counts"][0] > 300 and one_rank["counts"][1] > 0   # emitted, and soot was made
    for name, wanted in one_rank.items():
        assert found[name].shape == wanted.shape, name
        if name in ("counts", "particle_id"):
            assert np.array_equal(found[name], wanted), name
        else:
            error = np.abs(found[name] - wanted).max() / np.abs(wanted).max()
            assert error < (ROUND_OFF if name == "totals" else SOLVER_TOLERANCE), (name, error)


@pytest.mark.serial
def test_too_many_ranks_is_one_line_that_names_the_largest_number(mpirun, tmp_path):
    scene = tmp_path / "thin.toml"
    scene.write_text('[domain]\ncells = [8, 1, 5]\n[time]\nend = 1.0\nframe = 1.0\n')
    done = mpirun(3, "-m", "solver", scene, "-o", tmp_path / "out")
    errors = [line for line in done.stdout.splitlines() if line.startswith("error:")]
    assert done.returncode == 2, done.stdout
    assert len(errors) == 1 and "at most 2" in errors[0] and "domain.cells" in errors[0]
    assert "Traceback" not in done.stdout and not (tmp_path / "out").exists()
