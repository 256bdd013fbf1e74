"""The index out of ledgers against index.parquet as pyarrow reads it, and digests against the payloads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from blake3 import blake3
from conftest import FOLDERS
from graspmill import DamagedFile, Dataset, Folder, Index
from graspmill.mcap import Attachment, McapFile


@pytest.mark.parametrize("name", FOLDERS)
def test_columns_are_those_of_the_table(data: Path, name: str) -> None:
    index = Dataset(data / name).index
    table = parquet.read_table(data / name / "index.parquet")
    assert table.column_names == list(index)
    for column in table.column_names:
        found: list[object] = index[column].tolist()
        if column.startswith("digest_"):
            found = [bytes(row) if kept else None for row, kept in zip(index[column], index["kept"])]
        elif column in ("reason", "detail"):
            found = [word or None for word in index[column].tolist()]
        assert found == table[column].to_pylist(), column


@pytest.mark.parametrize("name", FOLDERS)
def test_payloads_have_the_digests_of_the_index(data: Path, name: str) -> None:
    samples = Dataset(data / name)
    assert len(samples)
    for sample in samples:
        for channel in samples.channels:
            digest = bytes(samples.index[f"digest_{channel}"][sample.index])
            assert blake3(bytes(sample.payload(channel))).digest() == digest


def test_rejects_say_why(data: Path) -> None:
    index = Dataset(data / "pairs").index
    rejected = ~index["kept"]
    assert rejected.any() and set(index["reason"][rejected]) == {"few_partial_cells", "little_remains"}
    assert all(index["detail"][rejected])


@pytest.mark.parametrize("name", FOLDERS)
def test_counts_of_facts_are_sums_of_columns(data: Path, name: str) -> None:
    samples = Dataset(data / name)
    counts = samples.folder.manifest["counts"]
    assert {fact: int(samples.index[fact].sum()) for fact in counts["facts"]} == counts["facts"]
    splits = {split: int((samples.index["split"][samples.indices] == split).sum()) for split in counts["splits"]}
    assert splits == counts["splits"]
    assert sum(counts["rejected"].values()) == np.sum(~samples.index["kept"])


@pytest.mark.parametrize(
    ("name", "end", "said"),
    [
        ("ledger", -1, "ledger cannot be read"),
        ("facts", 0, "no fact .*grasps_kept"),
        ("facts", -8, "ledger cannot be read"),
        ("digests", -32, "bytes of digests"),
        ("digests", None, "it has no digests"),
    ],
)
def test_damaged_ledgers_are_refused(
    data: Path, monkeypatch: pytest.MonkeyPatch, name: str, end: int | None, said: str
) -> None:
    """Attachments whose checksums hold, but that end too early, or are missing."""
    whole = McapFile.attachments

    def cut(file: McapFile) -> Iterator[Attachment]:
        for each in whole(file):
            if each.name != name:
                yield each
            elif end is not None:
                yield replace(each, data=each.data[:end])

    monkeypatch.setattr(McapFile, "attachments", cut)
    with pytest.raises(DamagedFile, match=said):
        Index(Folder(data / "set/grasps"))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1e-9, 1.5, 1e300])
def test_facts_outside_of_their_range_are_refused(data: Path, monkeypatch: pytest.MonkeyPatch, value: float) -> None:
    true = Dataset(data / "pairs").index["solid_share"][0]
    _forge(monkeypatch, np.float64(true).tobytes(), np.float64(value).tobytes())
    with pytest.raises(DamagedFile, match="the fact solid_share of row 0 is .*, which is not from 0.0 to 1.0"):
        Index(Folder(data / "pairs"))


def test_runs_without_a_grasp_have_infinite_energy_and_no_other(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    energies = Dataset(data / "set/grasps").index["best_energy"]
    _forge(monkeypatch, energies[:1].tobytes(), np.float64(np.inf).tobytes())
    assert Index(Folder(data / "set/grasps"))["best_energy"][0] == np.inf
    monkeypatch.undo()
    _forge(monkeypatch, energies[:1].tobytes(), np.float64(np.nan).tobytes())
    with pytest.raises(DamagedFile, match="the fact best_energy of row 0 is nan"):
        Index(Folder(data / "set/grasps"))


def _forge(monkeypatch: pytest.MonkeyPatch, true: bytes, forged: bytes) -> None:
    """Puts other bytes in place of the first such ones in the facts of every shard."""
    whole = McapFile.attachments

    def attachments(file: McapFile) -> Iterator[Attachment]:
        for each in whole(file):
            if each.name == "facts":
                each = replace(each, data=memoryview(bytes(each.data).replace(true, forged, 1)))
            yield each

    monkeypatch.setattr(McapFile, "attachments", attachments)


@pytest.mark.parametrize("name", FOLDERS)
def test_rows_of_a_column_are_those_of_the_whole_one(data: Path, name: str) -> None:
    index = Dataset(data / name).index
    rows = np.arange(len(index["sample_index"]))[::-2]
    for column in index:
        assert np.array_equal(index.column(column, rows), index[column][rows]), column
    with pytest.raises(KeyError):
        index.column("colour")
    assert "colour" not in index and 1 not in index
