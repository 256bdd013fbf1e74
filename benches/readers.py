"""Completion pairs a second from Python, in one process: our package, the exports with their own libraries, the
official MCAP reader.

    make bench-readers

Random: every sample alone, anywhere. Shuffled: as training takes them, an epoch in random order. `packed` hands over
the bits as they are stored (16 kB a pair at 40^3), `cells` unpacks both grids with numpy (128 kB). Each figure is the
best of three passes, wall clock and processor time apart: on a shared machine the second is the one to compare. Every
reader's samples are counted and their bits summed, and all must agree.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))

from graspmill import CompletionSample, Dataset, NpyExport, PairBatch, ShuffledChunks  # noqa: E402

BATCH = 256
PASSES = 3
# Slow readers get this many samples of a pass.
FEW = 2048

Planes = tuple[np.ndarray, np.ndarray]
"""Partial and complete, packed: uint8 (samples, bytes)."""


def ours_one_by_one(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    data = Dataset(folder / "data", CompletionSample)
    for place in places.tolist():
        sample = data[place]
        yield sample.partial_bits[None], sample.complete_bits[None]


def ours_in_batches(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    data = Dataset(folder / "data", CompletionSample)
    for first in range(0, len(places), BATCH):
        batch = PairBatch.of(data.gather(places[first : first + BATCH]))
        yield batch.partial, batch.complete


def ours_shuffled(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    data = Dataset(folder / "data", CompletionSample)
    for samples in ShuffledChunks(data, seed=len(places), batch=BATCH):
        batch = PairBatch.of(samples)
        yield batch.partial, batch.complete


def npy_one_by_one(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    data = NpyExport(folder / "npy")
    for place in places.tolist():
        batch = data[place]
        yield batch.partial, batch.complete


def npy_in_batches(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    data = NpyExport(folder / "npy")
    for first in range(0, len(places), BATCH):
        batch = data.gather(places[first : first + BATCH])
        yield batch.partial, batch.complete


def parquet_shuffled(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    """Row groups in random order, eight of them mixed at a time, by pyarrow."""
    from pyarrow import parquet

    file = parquet.ParquetFile(folder / "parquet" / "pairs.parquet")
    draws = np.random.default_rng(len(places))
    groups = draws.permutation(file.num_row_groups)
    for first in range(0, len(groups), 8):
        table = file.read_row_groups(
            groups[first : first + 8].tolist(), columns=["partial", "complete"], use_threads=False
        )
        table = table.combine_chunks()
        planes = [_binary(table[name].chunk(0)) for name in ("partial", "complete")]
        order = draws.permutation(len(planes[0]))
        for start in range(0, len(order), BATCH):
            some = order[start : start + BATCH]
            yield planes[0][some], planes[1][some]


def _binary(column: object) -> np.ndarray:
    """A column of binaries of one length as rows, without a copy."""
    _, offsets, data = column.buffers()
    offsets = np.frombuffer(offsets, np.int32)[column.offset : column.offset + len(column) + 1]
    return np.frombuffer(data, np.uint8)[offsets[0] : offsets[-1]].reshape(len(column), -1)


def webdataset_shuffled(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    """Tar shards in random order and a buffer of 1,000, by the webdataset package."""
    import webdataset

    shards = sorted(str(path) for path in (folder / "webdataset").glob("*.tar"))
    data = webdataset.WebDataset(shards, shardshuffle=len(shards), seed=len(places)).shuffle(1000)
    # As its own decoder does: "npy" goes through numpy.load; "json", which training does not need, stays bytes.
    for sample in data.decode(webdataset.handle_extension("npy", _npy)):
        yield sample["partial.npy"][None], sample["complete.npy"][None]


def _npy(data: bytes) -> np.ndarray:
    import io

    return np.load(io.BytesIO(data))


def official_random(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    """The mcap package: each sample by its time, messages decoded by mcap-protobuf-support."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    data = Dataset(folder / "data")
    firsts = [shard["first_sample"] for shard in data.folder.manifest["shards"]]
    readers = [make_reader(path.open("rb"), decoder_factories=[DecoderFactory()]) for path in data.folder.shards]
    for index in data.indices[places].tolist():
        reader = readers[int(np.searchsorted(firsts, index, side="right")) - 1]
        messages = reader.iter_decoded_messages(topics=["/completion/pair"], starting_at=index, ending_before=index + 1)
        pair = next(iter(messages)).decoded_message
        yield np.frombuffer(pair.partial, np.uint8)[None], np.frombuffer(pair.complete, np.uint8)[None]


def official_in_order(folder: pathlib.Path, places: np.ndarray) -> Iterator[Planes]:
    """The same in the order of the shards, which is no shuffle at all."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    for path in Dataset(folder / "data").folder.shards:
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for message in reader.iter_decoded_messages(topics=["/completion/pair"]):
                pair = message.decoded_message
                yield np.frombuffer(pair.partial, np.uint8)[None], np.frombuffer(pair.complete, np.uint8)[None]


Reader = Callable[[pathlib.Path, np.ndarray], Iterator[Planes]]
READERS: list[tuple[str, str, Reader, bool]] = [
    ("shards, graspmill, one by one", "random", ours_one_by_one, False),
    ("shards, graspmill, batches of 256", "random", ours_in_batches, False),
    ("shards, graspmill.ShuffledChunks", "shuffled", ours_shuffled, False),
    ("npy export, graspmill, one by one", "random", npy_one_by_one, False),
    ("npy export, graspmill, batches of 256", "random", npy_in_batches, False),
    ("parquet export, pyarrow", "shuffled", parquet_shuffled, False),
    ("webdataset export, webdataset", "shuffled", webdataset_shuffled, False),
    ("shards, official mcap", "random", official_random, True),
    ("shards, official mcap", "in order", official_in_order, False),
]


def measured(reader: Reader, folder: pathlib.Path, places: np.ndarray, cells: bool) -> dict[str, float]:
    """Samples a second of the best pass, by wall clock and by processor time, and the bits of a pass."""
    wall = processor = np.inf
    for _ in range(PASSES):
        count = 0
        clock, own = time.perf_counter(), time.process_time()
        for partial, complete in reader(folder, places):
            count += len(partial)
            if cells:
                for plane in (partial, complete):
                    np.unpackbits(plane, axis=1, bitorder="little")
        wall = min(wall, (time.perf_counter() - clock) / count)
        processor = min(processor, (time.process_time() - own) / count)
    return {"wall": 1 / wall, "processor": 1 / processor}


def checked(reader: Reader, folder: pathlib.Path, places: np.ndarray) -> tuple[int, int, int]:
    """Samples and bits of one pass; it also warms the page cache."""
    counts = np.zeros(3, np.int64)
    for partial, complete in reader(folder, places):
        bits = [int(np.unpackbits(plane).sum()) for plane in (partial, complete)]
        counts += np.array([len(partial), *bits])
    return tuple(counts.tolist())


def made(graspmill: str, folder: pathlib.Path, job: str, settings: list[str]) -> None:
    """The dataset and its exports; what is there stays."""
    if not (folder / "data" / "manifest.json").is_file():
        arguments = [argument for setting in settings for argument in ("--set", setting)]
        command = [graspmill, "run", job, "--out", str(folder / "data"), "--progress", "none", *arguments]
        subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    for kind in ("npy", "parquet", "webdataset"):
        if not (folder / kind).is_dir():
            command = [graspmill, "export", str(folder / "data"), "--to", kind, "--out", str(folder / kind)]
            subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def size(path: pathlib.Path) -> int:
    """Bytes of all files below."""
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--graspmill", default=str(ROOT / "target/release/graspmill"), help="the program")
    parser.add_argument("--job", default="jobs/builtin.toml")
    parser.add_argument("--set", action="append", default=["channels.visibility=false"], help="settings of the job")
    parser.add_argument("--folder", type=pathlib.Path, help="folder of the data, made if missing; temporary by default")
    parser.add_argument("--only", default="", help="readers whose names hold this")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        made(given.graspmill, folder, given.job, given.set)
        count = len(Dataset(folder / "data"))
        places = np.random.default_rng(0).permutation(count)
        sizes = {kind: size(folder / kind) / count for kind in ("data", "npy", "parquet", "webdataset")}
        if not given.json:
            print(f"{count} pairs; bytes a pair: " + ", ".join(f"{kind} {each:.0f}" for kind, each in sizes.items()))
            print("| reader | order | packed/s | cells/s | packed/s of processor | cells/s of processor |")
            print("| --- | --- | --- | --- | --- | --- |")
        rows, sums = [], {}
        for name, order, reader, slow in READERS:
            if given.only not in name:
                continue
            some = places[:FEW] if slow else places
            sums.setdefault(len(some), set()).add(checked(reader, folder, some))
            packed, cells = (measured(reader, folder, some, unpacked) for unpacked in (False, True))
            rows.append({"reader": name, "order": order, "packed": packed, "cells": cells})
            figures = packed["wall"], cells["wall"], packed["processor"], cells["processor"]
            if not given.json:
                print(f"| {name} | {order} | " + " | ".join(f"{figure:,.0f}" for figure in figures) + " |", flush=True)
        if any(len(found) > 1 for found in sums.values()):
            sys.exit(f"readers disagree about samples and bits: {sums}")
        if given.json:
            print(json.dumps({"pairs": count, "bytes": sizes, "readers": rows}))


if __name__ == "__main__":
    main()
