"""A dataset's folder: its manifest and tables, checked before anything else is read."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

from .errors import (
    VERIFY,
    DamagedFile,
    DatasetError,
    UnfinishedDataset,
    UnknownFormat,
    WrongProduct,
    unreadable,
)
from .inside import read_text, size_inside

FORMAT_VERSION = 4
SPLITS = ("training", "holdout", "validation", "test")

_KEYS = {
    *("format_version", "generator", "product", "root", "classes", "class_topics", "platform", "job", "topics"),
    *("counts", "shards", "files", "warnings", "seal"),
}
# A manifest with numbers of one class has no class topics; `graspmill verify` compares the seal with its file.
_MAY_BE_ABSENT = {"class_topics", "seal"}
_SHARD_KEYS = {"file": str, "digest": str, "bytes": int, "first_sample": int, "samples": int, "kept": int}
_COUNTS = {"samples": int, "kept": int, "rejected": dict, "splits": dict, "facts": dict}
_DIGEST_BYTES = 32


class Folder:
    """A finished dataset on disk, or a release of one.

    Raises ``UnfinishedDataset`` where there is no manifest, ``UnknownFormat`` where the format is not ``FORMAT_VERSION``,
    ``DamagedFile`` where a shard is missing or its size differs from the manifest.
    """

    def __init__(self, folder: str | Path) -> None:
        self.path = Path(folder)
        try:
            self._read()
        except OSError as error:
            raise unreadable(self.path, error) from error

    def _read(self) -> None:
        self.manifest = _manifest(self.path)
        self.product: str = self.manifest["product"]
        self.root: str = self.manifest["root"]
        self.topics: list[str] = self.manifest["topics"]
        self.channels = [topic.rsplit("/", 1)[-1] for topic in self.topics]
        """Names of the channels, in the order of the topics."""
        self.has_splits: bool = "splits.json" in self.manifest["files"]
        self.samples: int = self.manifest["counts"]["samples"]
        self.kept: int = self.manifest["counts"]["kept"]
        self.shards = [self.path / "shards" / shard["file"] for shard in self.manifest["shards"]]
        for path, shard in zip(self.shards, self.manifest["shards"]):
            try:
                size = size_inside(self.path, f"shards/{shard['file']}")
            except FileNotFoundError:
                raise DamagedFile(path, "it is missing, and the manifest names it", VERIFY) from None
            except OSError as error:
                raise unreadable(path, error) from error
            if size != shard["bytes"]:
                raise DamagedFile(path, f"it has {size} bytes, and the manifest lists {shard['bytes']}", VERIFY)

    def expect(self, *products: str) -> None:
        """Raises ``WrongProduct`` unless the dataset is of one of these products."""
        if self.product not in products:
            known = " or ".join(products)
            remedy = "give a dataset whose job has product = " + " or ".join(f'"{product}"' for product in products)
            raise WrongProduct(self.path, f"a dataset of {self.product}, not of {known}", remedy)

    def objects(self) -> list[dict[str, Any]]:
        """The rows of ``assets.json``: at least ``object`` (digest) and ``name``; ``object_facts`` and ``resting_poses`` read
        further properties of objects."""
        rows: list[dict[str, Any]] = self._rows("assets.json", {"object": str, "name": str})["objects"]
        return rows

    def subjects(self) -> list[dict[str, Any]]:
        """The rows of the subjects, each with ``object`` (digest) and ``name``: those of ``objects()``, or separate rows for a
        product whose subjects are not objects."""
        own = "subjects" if "subjects" in self._table("assets.json") else "objects"
        rows: list[dict[str, Any]] = self._rows("assets.json", {"object": str, "name": str}, own)[own]
        return rows

    def splits(self) -> dict[str, Any]:
        """``splits.json``; empty tables if the product has no splits."""
        if not self.has_splits:
            return {"training_subsets": [], "objects": []}
        table = self._rows("splits.json", {"object": str, "split": str})
        path = self.path / "splits.json"
        _expect(path, _are_counts(table.get("training_subsets")), "its training_subsets are not a list of counts")
        for row in table["objects"]:
            held = _are_counts(row.get("holdout_items", [])) and _is_count(row.get("subset", 0))
            _expect(path, held, f"the row of {row['object']} holds no numbers of items")
        return table

    def types(self) -> dict[str, Any]:
        """``types.json`` of a dataset of patches: the kept grasps by type (``counts``), those ``without`` a type, and
        the ``chosen`` types, the most common first."""
        self.expect("patches")
        return self._table("types.json")

    def _rows(self, name: str, keys: dict[str, type], of: str = "objects") -> dict[str, Any]:
        """A table whose ``of`` are rows with these keys."""
        table = self._table(name)
        rows = table.get(of)
        _expect(self.path / name, isinstance(rows, list), f"it has no list of {of}")
        for number, row in enumerate(rows or ()):
            _expect(self.path / name, _has(row, keys), f"row {number} of its {of} lacks {', '.join(keys)}")
        return table

    def _table(self, name: str) -> dict[str, Any]:
        path = self.path / name
        table = _json(self.path, name)
        entry = self.manifest["files"].get(name)
        if not isinstance(entry, dict) or entry.get("bytes") != size_inside(self.path, name):
            raise DamagedFile(path, "it does not match the manifest", VERIFY)
        return table


def _expect(path: Path, holds: bool, problem: str) -> None:
    if not holds:
        raise DamagedFile(path, problem, VERIFY)


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _are_counts(values: Any) -> bool:
    return isinstance(values, list) and all(map(_is_count, values))


def _has(row: Any, keys: dict[str, type]) -> bool:
    """Whether a row is a table with a value of its type at each of these keys; whole numbers are counts."""
    if not isinstance(row, dict) or not set(keys) <= set(row):
        return False
    return all(_is_count(row[key]) if kind is int else isinstance(row[key], kind) for key, kind in keys.items())


def _check_manifest(path: Path, manifest: dict[str, Any]) -> None:
    """Raises ``DamagedFile`` if the manifest is invalid, before any file that it names is touched."""
    texts = {key: str for key in ("generator", "product", "root")}
    kinds = texts | {"topics": list, "counts": dict, "shards": list, "files": dict, "warnings": list, "classes": dict}
    for key, kind in kinds.items():
        _expect(path, isinstance(manifest[key], kind), f"its {key} is no {kind.__name__}")
    topics, counts = manifest["topics"], manifest["counts"]
    whole = bool(topics) and all(isinstance(topic, str) for topic in topics) and len(set(topics)) == len(topics)
    _expect(path, whole, f"its topics are {topics!r}"[:200])
    _expect(path, all(isinstance(warning, str) for warning in manifest["warnings"]), "a warning is not text")
    _expect(path, _has(counts, _COUNTS), "its counts are not whole numbers")
    numbers = [number for key in ("rejected", "splits", "facts") for number in counts[key].values()]
    _expect(path, _are_counts(numbers), "its counts are not whole numbers")
    name = re.compile(rf"{re.escape(manifest['product'])}-\d{{5,}}-of-\d{{5,}}-[0-9a-f]{{16}}\.mcap", re.ASCII)
    samples = kept = 0
    for number, shard in enumerate(manifest["shards"]):
        _expect(path, _has(shard, _SHARD_KEYS), f"its shard {number} lacks {', '.join(_SHARD_KEYS)}")
        # A name of any other form could point outside the folder.
        _expect(path, name.fullmatch(shard["file"]) is not None, f"it names a shard {shard['file']!r}"[:200])
        fits = shard["first_sample"] == samples and 0 < shard["samples"] and shard["kept"] <= shard["samples"]
        # Each kept sample has a digest per topic in its shard, each rejected one a reason.
        least = _DIGEST_BYTES * len(topics) * shard["kept"] + shard["samples"] - shard["kept"]
        counted = f"{shard['samples']} samples from {shard['first_sample']}, {shard['kept']} kept"
        _expect(path, fits and least <= shard["bytes"], f"its shard {number} has {shard['bytes']} bytes and {counted}")
        samples, kept = samples + shard["samples"], kept + shard["kept"]
    problem = f"its shards have {samples} samples and keep {kept}, it states {counts['samples']} and {counts['kept']}"
    _expect(path, (samples, kept) == (counts["samples"], counts["kept"]), problem)


def _json(folder: Path, name: str) -> dict[str, Any]:
    path = folder / name
    try:
        value = json.loads(read_text(folder, name))
    except FileNotFoundError:
        raise DamagedFile(path, "it is missing", VERIFY) from None
    except OSError as error:
        raise unreadable(path, error) from error
    except RecursionError:
        raise DamagedFile(path, "it is nested too deep", VERIFY) from None
    except ValueError as error:
        raise DamagedFile(path, f"it is not JSON ({error})", VERIFY) from error
    if not isinstance(value, dict):
        raise DamagedFile(path, "it does not contain a JSON object", VERIFY)
    return value


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / "manifest.json"
    # A link exists, regardless of its target.
    if not os.path.lexists(path):
        raise _without_manifest(folder)
    manifest = _json(folder, path.name)
    version = manifest.get("format_version")
    if isinstance(version, int) and version < FORMAT_VERSION:
        problem = f"format version {version}, and this package reads {FORMAT_VERSION}"
        remedy = "make it again with `graspmill run`, or read it with the package of the program that wrote it"
        raise UnknownFormat(path, problem, remedy)
    if version != FORMAT_VERSION:
        problem = f"format version {version!r}, and this package reads {FORMAT_VERSION}"
        raise UnknownFormat(path, problem, "install the graspmill package of the program that wrote it")
    unknown = sorted(set(manifest) - _KEYS)
    if unknown:
        problem = f"unknown keys {', '.join(unknown)}"
        raise UnknownFormat(path, problem, "install the graspmill package of the program that wrote it")
    missing = sorted(_KEYS - _MAY_BE_ABSENT - set(manifest))
    if missing:
        raise DamagedFile(path, f"keys are missing: {', '.join(missing)}", VERIFY)
    _check_manifest(path, manifest)
    return manifest


def _without_manifest(folder: Path) -> DatasetError:
    if not folder.is_dir():
        return UnfinishedDataset(folder, "no such folder", "give the folder that `graspmill run --out` made")
    if (folder / "set.json").is_file():
        jobs = _json(folder, "set.json").get("jobs", [])
        names = ", ".join(job["name"] for job in jobs if _has(job, {"name": str})) if isinstance(jobs, list) else ""
        return UnfinishedDataset(folder, f"a set of datasets ({names})", "give the folder of one of them")
    if (folder / "run.json").is_file():
        return UnfinishedDataset(
            folder,
            "unfinished: it has no manifest.json",
            "run the same `graspmill run` again, which resumes where it stopped",
        )
    if (folder / "export.json").is_file():
        return UnfinishedDataset(folder, "an export, not a dataset", "read `--to npy` with graspmill.NpyExport")
    return UnfinishedDataset(
        folder, "not a dataset: it has no manifest.json", "give the folder that `graspmill run --out` made"
    )
