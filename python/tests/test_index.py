"""The index out of ledgers against index.parquet as pyarrow reads it, and digests against the payloads."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as parquet
import pytest
from blake3 import blake3
from conftest import FOLDERS
from graspmill import Dataset


@pytest.mark.parametrize("name", FOLDERS)
def test_columns_are_those_of_the_table(data: Path, name: str) -> None:
    index = Dataset(data / name).index
    table = parquet.read_table(data / name / "index.parquet")
    assert set(table.column_names) == set(index)
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
    assert rejected.any() and set(index["reason"][rejected]) == {"few_partial_cells"} and all(index["detail"][rejected])
