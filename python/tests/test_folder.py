"""Refused folders, and whether the error names the remedy."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from graspmill import (
    CompletionSample,
    DamagedFile,
    Dataset,
    DatasetError,
    GraspSample,
    NpyExport,
    ReachabilityField,
    UnfinishedDataset,
    UnknownFormat,
    WrongProduct,
)
from graspmill.__main__ import main


@pytest.fixture
def copy(data: Path, tmp_path: Path) -> Path:
    """A dataset that may be damaged."""
    return Path(shutil.copytree(data / "pairs", tmp_path / "copy"))


def refused(kind: type[DatasetError], folder: Path, *words: str) -> None:
    with pytest.raises(kind) as caught:
        Dataset(folder)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_unfinished_folders_are_refused(copy: Path, data: Path, tmp_path: Path) -> None:
    (copy / "manifest.json").unlink()
    refused(UnfinishedDataset, copy, str(copy), "unfinished", "graspmill run")
    refused(UnfinishedDataset, tmp_path / "nowhere", "no such folder")
    refused(UnfinishedDataset, data / "set", "a set of datasets (completion, touch, grasps, patches)", "one of them")
    refused(UnfinishedDataset, data / "npy", "an export", "NpyExport")
    refused(UnfinishedDataset, tmp_path, "not a dataset")
    with pytest.raises(UnfinishedDataset, match="graspmill export --to npy"):
        NpyExport(data / "pairs")
    with pytest.raises(UnfinishedDataset, match="an export to parquet"):
        NpyExport(data / "parquet")
    with pytest.raises(UnfinishedDataset, match="no field.mcap"):
        ReachabilityField(data / "pairs")


def test_other_formats_and_products_are_refused(copy: Path) -> None:
    path = copy / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(manifest | {"format_version": 1}), encoding="utf-8")
    refused(UnknownFormat, copy, "manifest.json", "format version 1", "reads 4", "graspmill run")
    path.write_text(json.dumps(manifest | {"format_version": 5}), encoding="utf-8")
    refused(UnknownFormat, copy, "manifest.json", "format version 5", "install")
    path.write_text(json.dumps(manifest | {"colour": 1}), encoding="utf-8")
    refused(UnknownFormat, copy, "unknown keys colour")
    path.write_text("{", encoding="utf-8")
    refused(DamagedFile, copy, "manifest.json", "not JSON")
    path.write_text(json.dumps(manifest), encoding="utf-8")
    with pytest.raises(WrongProduct, match="a dataset of completion, not of grasps"):
        Dataset(copy, GraspSample)


def test_missing_and_short_shards_are_refused(copy: Path) -> None:
    shard = sorted((copy / "shards").iterdir())[1]
    whole = shard.read_bytes()
    shard.write_bytes(whole[:-1])
    refused(DamagedFile, copy, shard.name, f"{len(whole) - 1} bytes", "graspmill verify")
    shard.unlink()
    refused(DamagedFile, copy, shard.name, "missing")


@pytest.mark.parametrize("name", ["manifest.json", "assets.json", "splits.json", "shards", "shards/*"])
def test_links_inside_a_dataset_are_refused(copy: Path, tmp_path: Path, name: str) -> None:
    """Also one that leads to the very file that belongs there; a link that leads to the dataset is followed."""
    path = next(copy.glob(name))
    target = tmp_path / path.name
    path.rename(target)
    path.symlink_to(target)
    with pytest.raises(DamagedFile, match=r"symbolic link.*cp -rL"):
        data = Dataset(copy, CompletionSample)
        print(list(data)[0].partial.sum(), data.folder.objects(), data.folder.splits())
    # The remedy of the message.
    path.unlink()
    target.rename(path)
    (tmp_path / "named").symlink_to(copy)
    assert len(list(Dataset(tmp_path / "named", CompletionSample))) > 0


def test_exports_and_fields_follow_no_link(data: Path, tmp_path: Path) -> None:
    exports = [(NpyExport, "npy", "partial.npy"), (NpyExport, "npy", "samples.csv")]
    for kind, source, name in [*exports, (ReachabilityField, "axes", "field.mcap")]:
        copied = Path(shutil.copytree(data / source, tmp_path / f"{source}-{name}"))
        (copied / name).rename(tmp_path / name)
        (copied / name).symlink_to(tmp_path / name)
        with pytest.raises(DamagedFile, match="symbolic link"):
            kind(copied)
        (tmp_path / name).unlink()


def test_names_are_shown_with_escapes(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = copy / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    evil = "a\x1b[31mred\nroot 0\u202eb"
    path.write_text(json.dumps(manifest | {"warnings": [evil], "generator": evil}), encoding="utf-8")
    assert main(["info", str(copy)]) == 0
    path.unlink()
    assert main(["info", str(copy / evil)]) == 1
    shown = capsys.readouterr()
    for text in (shown.out, shown.err):
        assert all(c.isprintable() or c == "\n" for c in text) and "\nroot 0\\" not in text, text
    assert "a\\x1b[31mred\\nroot 0\\u202eb" in shown.out


def test_tables_above_their_bound_are_refused_unread(copy: Path) -> None:
    with (copy / "manifest.json").open("r+b") as file:
        file.truncate(3 << 30)
    refused(DatasetError, copy, "manifest.json", str(3 << 30), str(256 << 20))


def test_no_flipped_bit_goes_unseen(copy: Path) -> None:
    """Every sample is read; a flip anywhere in a shard is an error, or lies where nothing is read."""
    good = [bytes(sample.payload("pair")) for sample in Dataset(copy, CompletionSample)]
    shard = sorted((copy / "shards").iterdir())[0]
    whole = shard.read_bytes()
    seen = 0
    places = range(11, len(whole), len(whole) // 60)
    for place in places:
        damaged = bytearray(whole)
        damaged[place] ^= 0x10
        shard.write_bytes(damaged)
        try:
            found = [bytes(sample.payload("pair")) for sample in Dataset(copy, CompletionSample)]
        except DamagedFile as error:
            assert shard.name in str(error)
            seen += 1
        else:
            assert found == good
    # What is not read: message indexes, the index of attachments' neighbours, the header.
    assert seen > 0.9 * len(places)


def test_info_says_what_a_folder_holds(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(data / "pairs")]) == 0
    said = capsys.readouterr().out
    manifest = json.loads((data / "pairs" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["root"] in said and "touch_rays" in said and "mug-01" in said
    assert main(["info", str(data / "set/grasps"), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["product"] == "grasps" and facts["counts"]["facts"]["grasps_kept"] > 0
    assert main(["info", str(data)]) == 1
    assert "error: " in capsys.readouterr().err


OUTSIDE = ("/etc/passwd", "../../../../etc/passwd", "..", "", "a\0b")
OUTSIDE += ("completion-00000-of-00001-0123456789abcdef.mcap/../x",)
"""Names of shards that point outside the folder, or are invalid."""


@pytest.mark.parametrize("name", OUTSIDE)
def test_names_that_lead_out_of_the_folder_are_refused_untouched(
    copy: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name of another form is refused before its path is accessed."""
    path = copy / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    manifest["shards"][0]["file"] = name
    path.write_text(json.dumps(manifest), encoding="utf-8")
    touched = set()
    for asked in ("open", "stat", "lstat"):
        original = getattr(os, asked)

        def watched(path: Any, *given: Any, original: Any = original, **named: Any) -> Any:
            touched.add(str(path))
            return original(path, *given, **named)

        monkeypatch.setattr(os, asked, watched)
    refused(DamagedFile, copy, "manifest.json", "it names a shard")
    assert "manifest.json" in touched and touched <= {str(copy), str(path), "manifest.json"}


WRONG: dict[str, Any] = {
    "shards": 3,
    "shards 0": None,
    "shards 0 bytes": "many",
    "shards 0 samples": 2**60,
    "shards 0 kept": -1,
    "shards 0 first_sample": 7,
    "shards 0 file": 5,
    "counts": [],
    "counts kept": True,
    "counts facts": {"x": "y"},
    "topics": [],
    "topics 0": 4,
    "files": None,
    "warnings": [5],
    "product": 3,
}
"""Values that no manifest has, by the path to them."""


@pytest.mark.parametrize("where", WRONG)
def test_manifests_of_other_values_are_refused(copy: Path, where: str) -> None:
    path = copy / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    *outer, last = [int(part) if part.isdecimal() else part for part in where.split(" ")]
    table = manifest
    for part in outer:
        table = table[part]
    table[last] = WRONG[where]
    path.write_text(json.dumps(manifest), encoding="utf-8")
    refused(DamagedFile, copy, "manifest.json")


@pytest.mark.parametrize("name", ["shards", "manifest.json", ""])
def test_files_that_may_not_be_read_are_named(copy: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may read all: so the system's refusal is played."""
    shard = sorted((copy / "shards").iterdir())[0]
    refused_path = {"shards": shard.name, "manifest.json": "manifest.json", "": str(copy)}[name]
    original = os.open

    def refuse(path: Any, *given: Any, **named: Any) -> Any:
        if str(path) == refused_path:
            raise PermissionError(13, "Permission denied")
        return original(path, *given, **named)

    monkeypatch.setattr(os, "open", refuse)
    file = shard.name if name == "shards" else "manifest.json"
    with pytest.raises(DatasetError, match=f"{file}: it cannot be read .Permission denied."):
        Dataset(copy)[0]
