"""Samples in random order directly from compressed shards: whole chunks in random order, mixed in a buffer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Generic

import numpy as np
import numpy.typing as npt

from .dataset import Dataset, S


class ShuffledChunks(Generic[S]):
    """An epoch of a dataset's selection in an order drawn from ``seed`` and ``epoch``.

    Chunks are put into random order and distributed over ``world_size`` ranks and their ``workers``, so that each sample comes
    exactly once; a buffer of ``buffer`` samples mixes those of a chunk among others. The order depends only on seed, epoch,
    buffer, rank and worker. With ``batch`` it yields lists of ``batch`` samples (the last one is shorter), else single samples.

    The counts of samples of ranks differ by a few chunks; with ``even`` each stops at the smallest count, so that ranks that
    wait for each other do not hang, and the few samples at the end of the longer ones are omitted in this epoch.

    For PyTorch's loaders use ``graspmill.torch.ShuffledChunks``, which finds rank and worker by itself.
    """

    def __init__(
        self,
        data: Dataset[S],
        *,
        seed: int = 0,
        epoch: int = 0,
        buffer: int = 2048,
        batch: int | None = None,
        rank: int = 0,
        world_size: int = 1,
        worker: int = 0,
        workers: int = 1,
        even: bool = False,
    ) -> None:
        if not (0 <= rank < world_size and 0 <= worker < workers):
            raise ValueError(f"rank {rank} of {world_size}, worker {worker} of {workers}")
        if buffer < 1 or (batch is not None and batch < 1):
            raise ValueError(f"a buffer of {buffer} samples, batches of {batch}; both must be at least 1")
        self.data = data
        self.seed = seed
        self.epoch = epoch
        self.buffer = buffer
        self.batch = batch
        self.rank, self.world_size = rank, world_size
        self.worker, self.workers = worker, workers
        self.even = even

    def set_epoch(self, epoch: int) -> None:
        """The epoch of the order of the next iterator."""
        self.epoch = epoch

    def __len__(self) -> int:
        """Samples, or batches, that the next iterator gives."""
        count = self._share()[1]
        return count if self.batch is None else -(-count // self.batch)

    def __iter__(self) -> Iterator[S | list[S]]:
        if self.batch is None:
            yield from self._samples()
            return
        ready: list[S] = []
        for sample in self._samples():
            ready.append(sample)
            if len(ready) == self.batch:
                yield ready
                ready = []
        if ready:
            yield ready

    def _share(self) -> tuple[list[tuple[int, int, int, int]], int]:
        """This worker's chunks in order, as ``Dataset.run_of`` takes them; and how many samples it gives."""
        shards, chunks, firsts = self.data.chunk_table()
        ends = np.append(firsts[1:], len(self.data))
        order = np.random.default_rng([self.seed, self.epoch]).permutation(len(firsts))
        sizes = (ends - firsts)[order]
        place = np.arange(len(order))
        ranks, workers = place % self.world_size, place // self.world_size % self.workers
        counts = np.zeros((self.world_size, self.workers), np.int64)
        np.add.at(counts, (ranks, workers), sizes)
        own = counts[self.rank]
        if self.even:
            # Cut from the workers with the most samples: their sum is that of the smallest rank.
            own = _lowered(own, int(own.sum() - counts.sum(axis=1).min()))
        mine = order[(ranks == self.rank) & (workers == self.worker)]
        runs = zip(*(column[mine].tolist() for column in (shards, chunks, firsts, ends)))
        return list(runs), int(own[self.worker])

    def _samples(self) -> Iterator[S]:
        runs, count = self._share()
        draws = np.random.default_rng([self.seed, self.epoch, self.rank, self.worker])
        held: list[S] = []
        left = count
        for run in runs:
            # Copies: otherwise a sample in the buffer would keep its whole chunk in memory.
            held += [sample.copy() for sample in self.data.run_of(*run)]
            surplus = len(held) - self.buffer
            if surplus > 0:
                for pick in draws.random(surplus).tolist():
                    if left == 0:
                        return
                    left -= 1
                    yield _pick(held, pick)
        for pick in draws.random(left).tolist():
            yield _pick(held, pick)


def _pick(held: list[S], pick: float) -> S:
    """Removes one sample; the last one replaces it."""
    place = int(pick * len(held))
    held[place], held[-1] = held[-1], held[place]
    return held.pop()


def _lowered(counts: npt.NDArray[np.int64], by: int) -> npt.NDArray[np.int64]:
    """Counts reduced by a total, always from the largest, the first of equal ones."""
    counts = counts.copy()
    for _ in range(by):
        counts[np.argmax(counts)] -= 1
    return counts
