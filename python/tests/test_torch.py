"""With PyTorch: loaders with workers, unpacking, and the training example."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from graspmill import CompletionSample, Dataset, PairBatch

torch = pytest.importorskip("torch")

from graspmill.torch import ShuffledChunks, collate, unpack  # noqa: E402
from torch.utils.data import DataLoader  # noqa: E402


@pytest.fixture(scope="module")
def pairs(data: Path) -> Dataset[CompletionSample]:
    return Dataset(data / "pairs", CompletionSample, split="training")


@pytest.mark.parametrize("workers", [0, 2])
@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_a_loader_gives_every_pair_once(pairs: Dataset[CompletionSample], workers: int, way: str) -> None:
    settings: dict[str, Any] = {"num_workers": workers, "multiprocessing_context": way if workers else None}
    loader = DataLoader(pairs, batch_size=16, shuffle=True, collate_fn=collate, **settings)  # type: ignore[arg-type]
    found = []
    for batch in loader:
        cells = unpack(batch["complete"], batch["resolution"])
        for row, index in zip(cells, batch["index"].tolist()):
            found.append(index)
            place = int(np.searchsorted(pairs.indices, index))
            assert np.array_equal(row[0].numpy() == 1, pairs[place].complete)
    assert sorted(found) == pairs.indices.tolist()


@pytest.mark.parametrize("workers", [0, 3])
def test_shuffled_chunks_share_themselves_out(pairs: Dataset[CompletionSample], workers: int) -> None:
    shuffled = ShuffledChunks(pairs, seed=1, buffer=16, batch=8)
    loader = DataLoader(shuffled, batch_size=None, num_workers=workers, persistent_workers=workers > 0)
    epochs = []
    for epoch in (0, 1, 0):
        shuffled.set_epoch(epoch)
        epochs.append([index for batch in loader for index in batch["index"].tolist()])
        assert sorted(epochs[-1]) == pairs.indices.tolist()
    assert epochs[0] == epochs[2] != epochs[1]


def test_unpacking_is_numpys(pairs: Dataset[CompletionSample]) -> None:
    batch = PairBatch.of(pairs.gather(range(20)))
    packed = collate(batch)
    for name in ("partial", "complete", "free", "tactile"):
        assert np.array_equal(unpack(packed[name], 40).numpy()[:, 0], batch.cells(name).astype(np.float32))


def test_the_training_example_learns(data: Path) -> None:
    example = Path(__file__).parent.parent / "examples" / "completion.py"
    command = [sys.executable, str(example), str(data / "pairs"), "--epochs", "2", "--device", "cpu"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    losses = [float(line.split("loss ")[1].split()[0]) for line in done.stdout.splitlines() if "loss " in line]
    assert len(losses) == 2 and losses[1] < losses[0]


def test_the_benchmarks_network_learns(pairs: Dataset[CompletionSample]) -> None:
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benches"))
    from data_faults import Fault, jaccard, unpack
    from data_torch import Budget, Pairs, completed, from_blocks, learn, to_blocks

    batch = PairBatch.of(pairs.gather(range(len(pairs))))
    partial, complete = unpack(batch.partial), unpack(batch.complete)
    assert np.array_equal(partial, batch.cells("partial"))
    assert np.array_equal(from_blocks(to_blocks(partial).numpy()), partial)

    training = Pairs(batch.partial, batch.complete, pairs.column("object"))
    networks = [learn(training, Fault("none"), Budget(0, 0, 0, steps), seed=1) for steps in (5, 60, 60)]
    worse, better, again = (jaccard(completed(network, partial), complete).mean() for network in networks)
    assert better == again, "the seed decides"
    assert better > worse and better > jaccard(partial, complete).mean() + 0.1
