"""For PyTorch: functions for its loaders, and packed grids unpacked on the device. Needs ``torch``.

    loader = DataLoader(data, batch_size=256, shuffle=True, collate_fn=collate, num_workers=2)
    for batch in loader:
        partial = unpack(batch["partial"].to(device), batch["resolution"])

Batches stay packed until they are on the device: an eighth of the bytes between processes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from .errors import MissingPackage

try:
    import torch
    from torch.utils.data import IterableDataset, get_worker_info
except ModuleNotFoundError as error:
    if error.name != "torch":
        raise
    raise MissingPackage(
        "torch",
        "graspmill.torch",
        "`pip install torch` installs it, on Linux with several gigabytes of CUDA; `uv pip install torch "
        "--torch-backend=cpu` installs the smaller wheel for CPUs; `graspmill.ShuffledChunks` shuffles in the "
        "same way without torch",
    ) from None

from . import shuffle
from .completion import CompletionSample, PairBatch
from .dataset import Dataset


def collate(samples: Sequence[CompletionSample] | PairBatch) -> dict[str, Any]:
    """Completion pairs as a batch: ``partial``, ``complete`` and, where read, ``free`` and ``tactile``, packed uint8 of
    shape (samples, ceil(n^3 / 8)); ``index``, int64 (samples,); ``resolution``, n."""
    batch = samples if isinstance(samples, PairBatch) else PairBatch.of(samples)
    planes = {"partial": batch.partial, "complete": batch.complete, "free": batch.free, "tactile": batch.tactile}
    tensors: dict[str, Any] = {name: torch.from_numpy(bits.copy()) for name, bits in planes.items() if bits is not None}
    return {**tensors, "index": torch.from_numpy(batch.indices), "resolution": batch.resolution}


def unpack(bits: torch.Tensor, resolution: int, dtype: torch.dtype = torch.float32) -> torch.Tensor:
    """Packed planes (samples, ceil(n^3 / 8)) as (samples, 1, n, n, n) of zeros and ones, on the device of ``bits``."""
    shifts = torch.arange(8, dtype=torch.uint8, device=bits.device)
    cells = bits[..., None].bitwise_right_shift(shifts).bitwise_and(1)
    n = resolution
    return cells.flatten(1)[:, : n**3].reshape(-1, 1, n, n, n).to(dtype)


class ShuffledChunks(IterableDataset[Any]):
    """``graspmill.ShuffledChunks`` for ``DataLoader``: each worker of each rank takes its own share automatically.

    With ``batch`` give the loader ``batch_size=None`` and it gets collated batches of pairs; without it single samples.
    The rank comes from ``torch.distributed`` where that is initialised, else from the arguments. Call ``set_epoch``
    before each epoch.
    """

    def __init__(
        self,
        data: Dataset[Any],
        *,
        seed: int = 0,
        buffer: int = 2048,
        batch: int | None = None,
        rank: int | None = None,
        world_size: int | None = None,
        even: bool = False,
    ) -> None:
        if rank is None or world_size is None:
            joined = torch.distributed.is_available() and torch.distributed.is_initialized()
            rank = torch.distributed.get_rank() if joined else 0
            world_size = torch.distributed.get_world_size() if joined else 1
        self.data = data
        self.batch = batch
        self._epoch = torch.zeros((), dtype=torch.int64).share_memory_()  # type: ignore[no-untyped-call]
        self._settings = {"seed": seed, "buffer": buffer, "batch": batch, "even": even}
        self._settings |= {"rank": rank, "world_size": world_size}

    def set_epoch(self, epoch: int) -> None:
        """The epoch whose order comes next; persistent workers receive it, too."""
        self._epoch.fill_(epoch)

    def __iter__(self) -> Iterator[Any]:
        info = get_worker_info()
        worker, workers = (0, 1) if info is None else (info.id, info.num_workers)
        settings: dict[str, Any] = {**self._settings, "epoch": int(self._epoch), "worker": worker, "workers": workers}
        shuffled = shuffle.ShuffledChunks(self.data, **settings)
        return iter(shuffled) if self.batch is None else map(collate, shuffled)
