"""A dataset, map style: samples by their index in a selection, directly from the compressed shards."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

import numpy as np
import numpy.typing as npt

from .amodal import AmodalSample
from .completion import CompletionSample
from .errors import VERIFY, BadSelection, DamagedFile
from .folder import SPLITS, Folder
from .frames import index_frame
from .geometry import SampleId
from .grasps import GraspSample
from .heatmaps import HeatmapSample
from .index import Index
from .mcap import McapFile
from .patches import PatchSample
from .picks import PickSample
from .reachability import ReachabilitySample
from .samples import Layout, Sample
from .scenes import SceneSample
from .suction import SuctionSample
from .views import ViewSample
from .volumes import VolumeSample

if TYPE_CHECKING:
    import pandas as pd

S = TypeVar("S", bound=Sample)

KINDS: dict[str, type[Sample]] = {
    kind.product: kind
    for kind in (
        CompletionSample,
        ReachabilitySample,
        GraspSample,
        PatchSample,
        SceneSample,
        ViewSample,
        AmodalSample,
        VolumeSample,
        PickSample,
        HeatmapSample,
        SuctionSample,
    )
}


class Dataset(Generic[S]):
    """Samples of a finished dataset, by index: ``len(data)``, ``data[k]``, ``data[:100]``, ``data.gather([...])``.

    ``kind`` is the class of its samples (``CompletionSample``, ``ReachabilitySample``, ``GraspSample``, ``PatchSample``,
    ``SceneSample``, ``ViewSample``, ``AmodalSample``, ``VolumeSample``, ``PickSample``, ``HeatmapSample``,
    ``SuctionSample``): with it, type
    checkers know the attributes of a sample, and a dataset of another product is refused. ``Sample`` reads any product by the
    schemas in its shards, including products without a class. ``split``, ``objects`` (names) and ``subset`` (a nested training
    subset) select; ``channels`` are the channels to read, by default all. ``cached_chunks`` is the number of unpacked chunks, of
    about 64 KiB, that stay in memory.

    Files are opened when they are first needed, once per process, so a ``Dataset`` can be pickled and forked. Use it in one
    thread at a time.

    Raises ``DatasetError`` for a folder that cannot be read, ``BadSelection`` for a selection that it cannot fulfil.
    """

    @overload
    def __init__(
        self: Dataset[Any],
        folder: str | Path,
        kind: None = None,
        *,
        split: str | None = ...,
        objects: Iterable[str] | None = ...,
        channels: Iterable[str] | None = ...,
        subset: int | None = ...,
        cached_chunks: int = ...,
    ) -> None: ...

    @overload
    def __init__(
        self,
        folder: str | Path,
        kind: type[S],
        *,
        split: str | None = ...,
        objects: Iterable[str] | None = ...,
        channels: Iterable[str] | None = ...,
        subset: int | None = ...,
        cached_chunks: int = ...,
    ) -> None: ...

    def __init__(
        self,
        folder: str | Path,
        kind: type[Any] | None = None,
        *,
        split: str | None = None,
        objects: Iterable[str] | None = None,
        channels: Iterable[str] | None = None,
        subset: int | None = None,
        cached_chunks: int = 64,
    ) -> None:
        self.folder = Folder(folder)
        # A product without a class is read by its schemas: `Sample.message`.
        self.kind: type[Any] = kind or KINDS.get(self.folder.product, Sample)
        if self.kind is not Sample:
            self.folder.expect(self.kind.product)
        self.channels = self._channels(channels)
        self.cached_chunks = max(1, cached_chunks)
        self._firsts = np.array([shard["first_sample"] for shard in self.folder.manifest["shards"]], np.int64)
        self._index: Index | None = None
        self._reset()
        if split is None and objects is None and subset is None and self.folder.kept == self.folder.samples:
            # Nothing to look up: the index is read on first use.
            self.indices: npt.NDArray[np.int64] = np.arange(self.folder.samples)
        else:
            self.indices = np.flatnonzero(self._selected(split, objects, subset))
        """Sample index of each element, ascending except in slices with a negative step."""

    def _reset(self) -> None:
        self._files: dict[int, McapFile] = {}
        self._layout: Layout | None = None
        self._wanted: list[dict[int, int] | None] = [None] * len(self.folder.shards)
        self._cache: OrderedDict[tuple[int, int], dict[int, list[memoryview]]] = OrderedDict()

    def __getstate__(self) -> dict[str, Any]:
        kept = ("folder", "kind", "channels", "cached_chunks", "indices", "_firsts")
        return {name: self.__dict__[name] for name in kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._index = None
        self._reset()

    def __repr__(self) -> str:
        return f"<graspmill.Dataset {self.folder.path}: {len(self)} samples of {self.folder.product}>"

    def __len__(self) -> int:
        return len(self.indices)

    @overload
    def __getitem__(self, place: int) -> S: ...

    @overload
    def __getitem__(self, place: slice) -> Dataset[S]: ...

    def __getitem__(self, place: int | slice) -> S | Dataset[S]:
        """The sample at an index of the selection; negative indices count from the end. A slice is a ``Dataset`` of its
        samples, none of which is read yet.

        Raises ``IndexError`` past the end, ``DamagedFile`` where a chunk does not match its checksum.
        """
        if isinstance(place, slice):
            view = copy(self)
            view.indices, view._index = self.indices[place], self._index
            return view
        if not -len(self) <= place < len(self):
            raise IndexError(f"index {place} of {len(self)} samples")
        index = int(self.indices[place])
        shard = int(np.searchsorted(self._firsts, index, side="right")) - 1
        chunk = int(self._file(shard).chunk_of(index))
        return self._sample(shard, chunk, index)

    def __getitems__(self, places: Sequence[int]) -> list[S]:
        """Samples at several indices, in the given order; each chunk is unpacked once. PyTorch's loaders call it."""
        wanted = np.asarray(places, np.int64)
        if len(wanted) and not (-len(self) <= wanted.min() and wanted.max() < len(self)):
            raise IndexError(f"indices {wanted.min()} to {wanted.max()} of {len(self)} samples")
        indices = self.indices[wanted]
        shards, chunks = self._chunks_of(indices)
        order = np.lexsort((chunks, shards)).tolist()
        rows = list(zip(shards.tolist(), chunks.tolist(), indices.tolist()))
        samples: list[Any] = [None] * len(rows)
        for place in order:
            samples[place] = self._sample(*rows[place])
        return samples

    gather = __getitems__

    def __iter__(self) -> Iterator[S]:
        """All samples in order, one chunk at a time."""
        return (self[place] for place in range(len(self)))

    @property
    def index(self) -> Index:
        """The sample index: one row per sample index, including rejected samples."""
        if self._index is None:
            self._index = Index(self.folder)
        return self._index

    @property
    def objects(self) -> dict[str, str]:
        """The objects of the samples of this selection: name -> digest (64 hexadecimal digits, the column
        ``subject``), in the order of the asset table; two of one name are distinguished by the digest.

        Reachability maps have no objects: their subject is a robot.
        """
        numbers = np.unique(self.index.subject_number[self.indices]).tolist()
        here = {self.index.subjects[number] for number in numbers}
        found: dict[str, str] = {}
        for row in self.folder.objects():
            if row["object"] in here:
                found[row["object"] if row["name"] in found else row["name"]] = row["object"]
        return found

    def frame(self) -> pd.DataFrame:
        """The index of this selection as a pandas DataFrame: one row per sample, in their order; without the digests.
        ``data.index.frame()`` has the rejected samples, too, ``grasp_frame`` one row per grasp.

        Raises ``MissingPackage`` without pandas.
        """
        return index_frame(self.index, self.indices)

    def column(self, name: str) -> npt.NDArray[Any]:
        """A column of the index for the samples of this selection: ``object``, ``split``, ``item``, ..."""
        return self.index.column(name, self.indices)

    def index_of(self, sample: SampleId) -> int | None:
        """The index of the sample with this id, for example of a pair of the same view in another dataset; ``None`` without
        one."""
        index = self.index
        if sample.subject not in index.subjects:
            return None
        found = index.subject_number == index.subjects.index(sample.subject)
        for name in ("instance", "item", "camera"):
            found &= index[name] == getattr(sample, name)
        places = np.flatnonzero(found[self.indices])
        return int(places[0]) if len(places) else None

    def chunk_table(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Shard, chunk and first index of each chunk with a selected sample, in order.

        The samples of chunk k have the indices from its first one to that of the next.
        """
        shards, chunks = self._chunks_of(self.indices)
        new = np.ones(len(self), np.bool_)
        new[1:] = (np.diff(shards) != 0) | (np.diff(chunks) != 0)
        firsts = np.flatnonzero(new)
        return shards[firsts], chunks[firsts], firsts

    def run_of(self, shard: int, chunk: int, first: int, end: int) -> list[S]:
        """The samples at the indices from ``first`` to before ``end``, which are all in this chunk (``chunk_table``)."""
        held, path = self._read_chunk(shard, chunk), self.folder.shards[shard]
        try:
            return [self.kind(index, self._layout, held[index]) for index in self.indices[first:end].tolist()]
        except KeyError as error:
            raise DamagedFile(path, f"sample {error} is in the index, not in the shard", VERIFY) from None

    def _chunks_of(self, indices: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Shard and chunk of sample indices."""
        shards = np.searchsorted(self._firsts, indices, side="right") - 1
        chunks = np.zeros(len(indices), np.int64)
        for shard in np.unique(shards).tolist():
            mine = shards == shard
            chunks[mine] = self._file(shard).chunk_of(indices[mine])
        return shards, chunks

    def _channels(self, channels: Iterable[str] | None) -> list[str]:
        stored = self.folder.channels
        if channels is None:
            return stored
        wanted = [channels] if isinstance(channels, str) else list(channels)
        unknown = sorted(set(wanted) - set(stored))
        if unknown or not wanted:
            raise BadSelection(f"{self.folder.path}: channels {unknown}; it stores {', '.join(stored)}")
        return [channel for channel in stored if channel in wanted]

    def _selected(self, split: str | None, objects: Iterable[str] | None, subset: int | None) -> npt.NDArray[np.bool_]:
        index, path = self.index, self.folder.path
        selected = index.kept()
        if split is not None:
            if "split" not in index or split not in SPLITS:
                known = ", ".join(SPLITS) if "split" in index else f"none, since {self.folder.product} has none"
                raise BadSelection(f"{path}: no split '{split}'; there are {known}")
            selected &= index.in_split(split)
        if subset is not None:
            count = len(self.folder.splits()["training_subsets"])
            if not 0 <= subset < count:
                raise BadSelection(f"{path}: no training subset {subset}; it has {count}, counted from 0")
            selected &= index.in_subset(subset)
        if objects is not None:
            wanted = [objects] if isinstance(objects, str) else list(objects)
            known_names = {row["name"] for row in self.folder.subjects()}
            unknown = sorted(set(wanted) - known_names)
            if unknown:
                some = ", ".join(sorted(known_names)[:12])
                raise BadSelection(f"{path}: no samples of {', '.join(unknown)}; it has samples of {some}, ...")
            selected &= index.of_objects(wanted)
        return selected

    def _file(self, shard: int) -> McapFile:
        file = self._files.get(shard)
        if file is None:
            file = self._files[shard] = McapFile(self.folder.shards[shard])
            by_topic = {channel.topic: (number, channel) for number, channel in file.channels.items()}
            topics = dict(zip(self.folder.channels, self.folder.topics))
            missing = [topics[name] for name in self.channels if topics[name] not in by_topic]
            if missing:
                raise file.damaged(f"it has no topic {', '.join(missing)}")
            own = [by_topic[topics[name]] for name in self.channels]
            self._wanted[shard] = {number: place for place, (number, _) in enumerate(own)}
            if self._layout is None:
                channels = {name: channel for name, (_, channel) in zip(self.channels, own)}
                places = {name: place for place, name in enumerate(self.channels)}
                self._layout = Layout(channels, places, self.folder.path)
        return file

    def _chunk(self, shard: int, chunk: int) -> dict[int, list[memoryview]]:
        """Messages of a chunk as ``_read_chunk`` reads them, from memory if the chunk is still cached."""
        key = (shard, chunk)
        found = self._cache.get(key)
        if found is not None:
            self._cache.move_to_end(key)
            return found
        found = self._cache[key] = self._read_chunk(shard, chunk)
        if len(self._cache) > self.cached_chunks:
            self._cache.popitem(last=False)
        return found

    def _read_chunk(self, shard: int, chunk: int) -> dict[int, list[memoryview]]:
        """Payloads of every sample of a chunk by sample index, channel by channel."""
        file = self._file(shard)
        wanted = self._wanted[shard] or {}
        found: dict[int, list[memoryview]] = {}
        count = 0
        if chunk < len(file.offsets):
            for channel, time, payload in file.messages(file.chunk(chunk)):
                place = wanted.get(channel)
                if place is not None:
                    payloads = found.get(time)
                    if payloads is None:
                        payloads = found[time] = [payload] * len(wanted)
                    payloads[place] = payload
                    count += 1
        if count != len(found) * len(wanted):
            raise file.damaged(f"a sample of chunk {chunk} has not one message on every topic")
        return found

    def _sample(self, shard: int, chunk: int, index: int) -> S:
        payloads = self._chunk(shard, chunk).get(index)
        if payloads is None or self._layout is None:
            path = self.folder.shards[shard]
            raise DamagedFile(path, f"sample {index} is in the index, not in the shard", VERIFY)
        sample: S = self.kind(index, self._layout, payloads)
        return sample
