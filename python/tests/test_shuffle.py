"""Shuffled chunks: each sample once, whoever reads; the same order for the same seed."""

from __future__ import annotations

import multiprocessing
import pickle
from pathlib import Path

import numpy as np
import pytest
from graspmill import CompletionSample, Dataset, ShuffledChunks


@pytest.fixture(scope="module")
def pairs(data: Path) -> Dataset[CompletionSample]:
    return Dataset(data / "pairs", CompletionSample, split="training")


def order(shuffled: ShuffledChunks[CompletionSample]) -> list[int]:
    return [sample.index for sample in shuffled]  # type: ignore[union-attr]


@pytest.mark.parametrize("buffer", [1, 16, 10_000])
def test_every_sample_comes_once(pairs: Dataset[CompletionSample], buffer: int) -> None:
    found = order(ShuffledChunks(pairs, seed=4, buffer=buffer))
    assert sorted(found) == pairs.indices.tolist() and found != sorted(found)
    assert len(ShuffledChunks(pairs)) == len(pairs)


@pytest.mark.parametrize(("world_size", "workers"), [(1, 3), (3, 1), (2, 2), (5, 4)])
def test_ranks_and_workers_share_without_overlap(
    pairs: Dataset[CompletionSample], world_size: int, workers: int
) -> None:
    def share(rank: int, worker: int, even: bool) -> ShuffledChunks[CompletionSample]:
        settings = {"rank": rank, "world_size": world_size, "worker": worker, "workers": workers}
        return ShuffledChunks(pairs, seed=1, epoch=2, buffer=16, even=even, **settings)

    parts = [order(share(rank, worker, False)) for rank in range(world_size) for worker in range(workers)]
    assert sorted(sum(parts, [])) == pairs.indices.tolist()
    counts = []
    for rank in range(world_size):
        given = [share(rank, worker, True) for worker in range(workers)]
        found = [order(part) for part in given]
        assert [len(part) for part in given] == [len(part) for part in found]
        counts.append(len(sum(found, [])))
        assert len(set(sum(found, []))) == counts[-1]
    assert len(set(counts)) == 1 and counts[0] > 0.6 * len(pairs) / world_size


def test_seed_and_epoch_draw_the_order(pairs: Dataset[CompletionSample]) -> None:
    shuffled = ShuffledChunks(pairs, seed=1, buffer=32)
    first = order(shuffled)
    assert order(shuffled) == first == order(ShuffledChunks(pickle.loads(pickle.dumps(pairs)), seed=1, buffer=32))
    shuffled.set_epoch(1)
    assert order(shuffled) != first != order(ShuffledChunks(pairs, seed=2, buffer=32))


def test_a_buffer_parts_the_samples_of_a_chunk(pairs: Dataset[CompletionSample]) -> None:
    """Samples of one object are adjacent in the shards; after shuffling, neighbours are nearly independent."""
    kinds = dict(zip(pairs.indices.tolist(), pairs.index.subject_number[pairs.indices].tolist()))
    found = [kinds[index] for index in order(ShuffledChunks(pairs, seed=3))]
    alike = np.mean(np.array(found[1:]) == np.array(found[:-1]))
    share = np.bincount(found) / len(found)
    assert alike < np.sum(share**2) + 0.15


def test_batches_hold_as_many_as_asked_for(pairs: Dataset[CompletionSample]) -> None:
    shuffled = ShuffledChunks(pairs, seed=1, buffer=32, batch=7)
    batches = list(shuffled)
    sizes = [len(batch) for batch in batches]  # type: ignore[arg-type]
    assert len(sizes) == len(shuffled) and set(sizes[:-1]) == {7} and sum(sizes) == len(pairs)


def _grids(given: tuple[Dataset[CompletionSample], list[int]]) -> list[bytes]:
    pairs, places = given
    return [sample.partial_bits.tobytes() for sample in pairs.gather(places)]


@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_processes_read_the_same(pairs: Dataset[CompletionSample], way: str) -> None:
    places = list(range(0, len(pairs), 5))
    expected = _grids((pairs, places))
    with multiprocessing.get_context(way).Pool(2) as pool:
        assert pool.map(_grids, [(pairs, places)] * 4) == [expected] * 4


def test_samples_travel_between_processes(pairs: Dataset[CompletionSample]) -> None:
    sample = pickle.loads(pickle.dumps(pairs[2]))
    assert np.array_equal(sample.complete, pairs[2].complete) and sample.id == pairs[2].id
