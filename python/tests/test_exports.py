"""Exports to Parquet and WebDataset, read by pyarrow and tarfile, against the shards."""

from __future__ import annotations

import io
import json
import tarfile
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from graspmill import CompletionSample, Dataset


@pytest.fixture(scope="module")
def pairs(data: Path) -> Dataset[CompletionSample]:
    return Dataset(data / "pairs", CompletionSample)


def facts_of(sample: CompletionSample) -> dict[str, object]:
    pair = sample.pair
    facts = {name: getattr(pair, name) for name in ("partial_cells", "complete_cells", "both_cells", "solid_share")}
    poses = ("camera_from_object", "world_from_object", "world_from_camera")
    facts |= {name: getattr(pair, name)[:3].reshape(-1).tolist() for name in poses}
    own = {"subject": pair.sample.subject, "instance": pair.sample.instance, "item": pair.sample.item}
    return (
        facts
        | own
        | {"sample_index": sample.index, "resolution": pair.grid.resolution, "cell_size": pair.grid.cell_size}
    )


def test_parquet_holds_the_pairs(data: Path, pairs: Dataset[CompletionSample]) -> None:
    table = parquet.read_table(data / "parquet" / "pairs.parquet")
    assert table.schema.metadata[b"graspmill.root"].decode() == pairs.folder.root
    rows = table.to_pylist()
    assert len(rows) == len(pairs)
    names = pairs.column("object"), pairs.column("split")
    for row, sample, name, split in zip(rows, pairs, *names):
        expected = facts_of(sample)
        assert {key: row[key] for key in expected} == expected
        assert (row["object"], row["split"], row["camera"]) == (name, split, 0)
        camera, centre = sample.pair.camera, sample.pair.grid.centre.tolist()
        assert [row[key] for key in ("fx", "fy", "cx", "cy")] == [camera.fx, camera.fy, camera.cx, camera.cy]
        assert [row[f"centre_{axis}"] for axis in "xyz"] == centre
        assert row["partial"] == sample.partial_bits.tobytes() and row["complete"] == sample.complete_bits.tobytes()
        tactile = np.unpackbits(np.frombuffer(row["tactile"], np.uint8), bitorder="little")
        assert np.array_equal(tactile[: 40**3].reshape(40, 40, 40), sample.tactile)
    file = parquet.ParquetFile(data / "parquet" / "pairs.parquet")
    assert all(file.metadata.row_group(group).num_rows <= 256 for group in range(file.num_row_groups))


def test_tar_shards_hold_the_pairs(data: Path, pairs: Dataset[CompletionSample]) -> None:
    found: dict[str, dict[str, bytes]] = {}
    for path in sorted((data / "webdataset").glob("*.tar")):
        with tarfile.open(path) as shard:
            for member in shard:
                assert (member.mtime, member.uid, member.gid, member.uname, member.mode) == (0, 0, 0, "", 0o644)
                key, _, extension = member.name.partition(".")
                file = shard.extractfile(member)
                assert file is not None
                found.setdefault(key, {})[extension] = file.read()
    assert list(found) == sorted(found) and len(found) == len(pairs)
    for sample, (key, members) in zip(pairs, found.items()):
        assert int(key) == sample.index and set(members) == {"json", "partial.npy", "complete.npy", "tactile.npy"}
        facts, expected = json.loads(members["json"]), facts_of(sample)
        assert {name: facts[name] for name in expected} == expected
        planes = {name: np.load(io.BytesIO(members[f"{name}.npy"])) for name in ("partial", "complete", "tactile")}
        assert np.array_equal(planes["partial"], sample.partial_bits)
        assert np.array_equal(planes["complete"], sample.complete_bits)
        assert np.array_equal(planes["tactile"], np.packbits(sample.tactile.reshape(-1), bitorder="little"))


def test_exports_name_their_dataset(data: Path, pairs: Dataset[CompletionSample]) -> None:
    for name in ("npy", "unpacked", "parquet", "webdataset"):
        facts = json.loads((data / name / "export.json").read_text(encoding="utf-8"))
        assert facts["root"] == pairs.folder.root and facts["samples"] == len(pairs)
