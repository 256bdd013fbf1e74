"""Files that are read by place: few are open at a time, in every process and on every thread."""

from __future__ import annotations

import errno
import multiprocessing
import os
import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from graspmill import CompletionSample, DamagedFile, Dataset, DatasetError, errors, files


def read(samples: Dataset[CompletionSample], places: list[int]) -> list[bytes]:
    return [bytes(samples[place].payload("pair")) for place in places]


def test_two_open_files_are_enough(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = Dataset(data / "pairs", CompletionSample)
    assert len(samples.folder.shards) > 2
    places = np.random.default_rng(1).permutation(len(samples)).tolist()
    wanted = read(samples, places)
    monkeypatch.setattr(files, "_MOST_OPEN", 2)
    # One chunk in memory: nearly every sample is read anew.
    few = Dataset(data / "pairs", CompletionSample, cached_chunks=1)
    assert read(few, places) == wanted
    assert files.open_files.count() <= 2


def test_threads_and_forked_processes_read_the_same(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_MOST_OPEN", 1)
    samples = Dataset(data / "pairs", CompletionSample, cached_chunks=1)
    places = list(range(len(samples)))
    wanted = read(samples, places)

    def share(worker: int) -> list[bytes]:
        own = Dataset(data / "pairs", CompletionSample, cached_chunks=1)
        return read(own, places[worker::4])

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(share, range(4))) == [wanted[worker::4] for worker in range(4)]
    with multiprocessing.get_context("fork").Pool(2) as processes:
        jobs = [processes.apply_async(read, (samples, places[worker::2])) for worker in range(2)]
        # The parent reads by the same descriptors meanwhile.
        assert read(samples, places) == wanted
        assert [job.get(60) for job in jobs] == [wanted[worker::2] for worker in range(2)]
    assert read(pickle.loads(pickle.dumps(samples)), places) == wanted


def test_a_file_stays_open_while_it_is_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"0123456789")
    whole = os.fstat

    def other_thread_first(descriptor: int) -> os.stat_result:
        files.open_files.forget(path)
        return whole(descriptor)

    monkeypatch.setattr(os, "fstat", other_thread_first)
    assert bytes(files.FileBytes(path).read(2, 3)) == b"234"


def test_a_file_that_another_one_replaced_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"0123456789")
    opened = files.FileBytes(path)
    assert bytes(opened.read(2, 3)) == b"234" and bytes(opened.read(8, 99)) == b"89" and not opened.read(99, 1)
    (tmp_path / "other").write_bytes(b"abcdefghij")
    os.replace(tmp_path / "other", path)
    files.open_files.forget(path)
    with pytest.raises(DamagedFile, match="changed since it was opened"):
        opened.read(0, 1)
    assert bytes(files.FileBytes(path).read(0, 1)) == b"a"
    path.write_bytes(b"")
    with pytest.raises(DamagedFile, match="it is empty"):
        files.FileBytes(path)
    path.unlink()
    with pytest.raises(DamagedFile, match="it is missing"):
        files.FileBytes(path)


@pytest.mark.parametrize(
    ("number", "remedy"),
    [
        (errno.EMFILE, "too many open files.*ulimit -n"),
        (errno.ENFILE, "this machine has too many open files"),
        (errno.EACCES, "change its permissions"),
        (errno.EIO, "check the disk"),
        (errno.ESTALE, "open the dataset again"),
        (errno.ENOSYS, "check the path, its permissions and the disk"),
    ],
)
def test_remedies_fit_the_errors_of_the_system(number: int, remedy: str) -> None:
    error = errors.unreadable(Path("shard"), OSError(number, os.strerror(number)))
    assert isinstance(error, DatasetError)
    with pytest.raises(DatasetError, match=f"shard: it cannot be read .*; .*{remedy}"):
        raise error
    assert ("permissions" in error.remedy) == (number in (errno.EACCES, errno.ENOSYS))


def test_open_files_of_ours_make_way_for_others(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = Dataset(data / "pairs", CompletionSample, cached_chunks=1)
    wanted = read(samples, list(range(len(samples))))
    whole, refused = os.open, []

    def open_once(path: str | Path, flags: int, **named: int) -> int:
        if not refused and str(path).endswith(".mcap"):
            refused.append(path)
            raise OSError(errno.EMFILE, "Too many open files")
        return whole(path, flags, **named)

    again = Dataset(data / "pairs", CompletionSample, cached_chunks=1)
    monkeypatch.setattr(os, "open", open_once)
    assert read(again, list(range(len(again)))) == wanted and refused
