"""What is written can be read back, by any number of ranks; what is damaged is refused."""

import time

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from solver import files_write
from solver.files import (SNAPSHOT, FileError, checksum, checksums, open_file, read_snapshot,
                          read_steps, read_tree, snapshot_frames, snapshot_path)
from solver.files_whole import replacing, write_tree
from solver.files_write import Block, SnapshotWriter

COMM = MPI.COMM_WORLD


def slab(whole: np.ndarray) -> Block:
    """This rank's layers of a field; uneven, and none for the last rank where there are several."""
    ends = np.linspace(0, len(whole), max(COMM.size - 1, 1) + 1).astype(int)
    ends = np.append(ends, len(whole))
    start, stop = ends[COMM.rank:COMM.rank + 2]
    return Block(whole[start:stop], (int(start), 0, 0), whole.shape,
                 {"origin": [0.5, 0.5, 0.5], "spacing": [1.0, 2.0, 3.0]})


@pytest.mark.parametrize("compression", ["gzip", "none"])
@pytest.mark.parametrize("gather", [False, True])
def test_snapshot_round_trip(shared_path, monkeypatch, gather, compression):
    monkeypatch.setattr(files_write, "PARALLEL_FROM", 0)
    writer = SnapshotWriter(shared_path, COMM, "float64", compression, gather=gather)
    assert writer.parallel == (COMM.size > 1 and not gather)
    whole = np.random.default_rng(1).random((37, 5, 33))
    mine = 0 if COMM.rank == 0 and COMM.size > 1 else 3 + COMM.rank   # a rank without particles
    rows = COMM.rank + np.arange(mine * 3.0).reshape(mine, 3)
    path = writer.write(12, {
        "fields/T": slab(whole), "particles/fuel/position": writer.rows(rows),
        "particles/soot/id": writer.rows(np.zeros(0, np.int64)),
        "bodies/mass": writer.replicated(np.array([1.0, 2.0]))}, {"time": 0.25, "step": 7})
    assert path == snapshot_path(shared_path, 12) and snapshot_frames(shared_path) == [12]
    assert not list(path.parent.glob("*.tmp"))
    frame = read_snapshot(shared_path, 12)
    assert (frame.frame, frame.time, frame.step) == (12, 0.25, 7)
    np.testing.assert_array_equal(frame.fields["T"].values, whole)
    np.testing.assert_array_equal(frame.fields["T"].spacing, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(frame.particles["fuel"]["position"],
                                  np.concatenate(COMM.allgather(rows)))
    assert frame.particles["soot"]["id"].shape == (0,)
    np.testing.assert_array_equal(frame.bodies["mass"], [1.0, 2.0])


def test_precision_is_that_of_the_scene(shared_path):
    SnapshotWriter(shared_path, COMM, "float32").write(
        0, {"fields/T": slab(np.full((4, 3, 2), 1 / 3))}, {"time": 0.0, "step": 0})
    assert read_snapshot(shared_path, 0).fields["T"].values.dtype == np.float32


def test_only_wanted_fields_are_read(shared_path):
    writer = SnapshotWriter(shared_path, COMM)
    blocks = {f"fields/{name}": slab(np.zeros((4, 3, 2))) for name in "pT"}
    writer.write(0, blocks, {"time": 0.0, "step": 0})
    assert set(read_snapshot(shared_path, 0, fields=("T",)).fields) == {"T"}


@pytest.mark.serial
def test_a_failed_write_leaves_the_earlier_file(tmp_path):
    path = tmp_path / "tree.h5"
    write_tree(path, "kind", {"a": np.arange(3)})
    with pytest.raises(TypeError):
        write_tree(path, "kind", {"a": object()})
    tree, attributes = read_tree(path, "kind")
    np.testing.assert_array_equal(tree["a"], np.arange(3))
    assert attributes["complete"] == 1


def test_a_line_that_a_killed_run_has_not_finished_is_no_step(tmp_path):
    path = tmp_path / "run.log.jsonl"
    assert read_steps(tmp_path) == []
    path.write_text('{"step": 1}\n{"step": 2}\n{"st')
    assert [record["step"] for record in read_steps(tmp_path)] == [1, 2]
    for broken in ('{"step": 1}\n{"st\n{"step": 2}\n', '{"time": 1}\n'):
        path.write_text(broken)
        with pytest.raises(FileError, match=f"{path}: not one .*fix: "):
            read_steps(tmp_path)


@pytest.mark.serial
def test_what_takes_the_place_of_a_file_does_so_whole_or_not_at_all(tmp_path):
    path = tmp_path / "folder" / "file"
    with replacing(path) as temporary:
        temporary.write_text("old")
    with pytest.raises(ZeroDivisionError), replacing(path) as temporary:
        temporary.write_text("half")
        assert path.read_text() == "old"
        _ = 1 / 0
    assert path.read_text() == "old" and list(path.parent.iterdir()) == [path]


@pytest.mark.serial
def test_unusable_files_are_refused_by_name(tmp_path):
    text, foreign, unfinished = (tmp_path / name for name in ("a.h5", "b.h5", "c.h5"))
    text.write_text("no HDF5")
    write_tree(foreign, "something else", {})
    with h5py.File(unfinished, "w") as file:
        file.attrs["format"] = SNAPSHOT
    for path, word in ((text, "not a readable"), (foreign, "something else"),
                       (unfinished, "never finished"), (tmp_path / "d.h5", "no such")):
        with pytest.raises(FileError, match=word) as caught:
            with open_file(path, SNAPSHOT):
                pass
        assert str(path) in str(caught.value)


@pytest.mark.serial
def test_the_same_values_make_the_same_bytes_and_no_old_checksum_outlives_a_file(tmp_path):
    values = np.arange(24.0).reshape(4, 3, 2)
    writer = SnapshotWriter(tmp_path, durable=False)

    def write(shift):
        path = writer.write(0, {"fields/T": slab(values + shift)}, {"time": 0.0, "step": 0})
        known = checksums(path.parent).get(path.name)   # perhaps not yet, but never the old one
        assert known in (None, checksum(path))
        writer.sync()
        assert checksums(path.parent)[path.name] == checksum(path)
        return path.read_bytes()

    first = write(0.0)
    assert write(1.0) != first
    time.sleep(1.1)   # HDF5's times are in seconds
    assert write(0.0) == first
