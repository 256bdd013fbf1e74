"""A dataset's folder: its manifest and tables, checked before anything else is read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .errors import (
    VERIFY,
    DamagedFile,
    DatasetError,
    UnfinishedDataset,
    UnknownFormat,
    WrongProduct,
    refuse_irregular,
)

FORMAT_VERSION = 2
SPLITS = ("training", "holdout", "validation", "test")

_KEYS = {
    *("format_version", "generator", "product", "root", "classes", "class_topics", "platform", "job", "topics"),
    *("counts", "shards", "files", "warnings", "seal"),
}
# A manifest with numbers of one class has no class topics; `graspmill verify` compares the seal with its file.
_MAY_BE_ABSENT = {"class_topics", "seal"}


class Folder:
    """A finished dataset on disk, or a release of one.

    Raises ``UnfinishedDataset`` where there is no manifest, ``UnknownFormat`` where the format is another than
    ``FORMAT_VERSION``, ``DamagedFile`` where a shard is missing or of another size than the manifest says.
    """

    def __init__(self, folder: str | Path) -> None:
        self.path = Path(folder)
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
            if path.name != shard["file"]:
                raise DamagedFile(self.path / "manifest.json", f"it names a shard {shard['file']!r}", VERIFY)
            refuse_irregular(path)
            if not path.is_file():
                raise DamagedFile(path, "it is missing, and the manifest names it", VERIFY)
            if path.stat().st_size != shard["bytes"]:
                size = path.stat().st_size
                raise DamagedFile(path, f"it has {size} bytes, and the manifest says {shard['bytes']}", VERIFY)

    def expect(self, product: str) -> None:
        """Raises ``WrongProduct`` unless the dataset is of this product."""
        if self.product != product:
            remedy = f'give a dataset whose job says product = "{product}"'
            raise WrongProduct(self.path, f"a dataset of {self.product}, not of {product}", remedy)

    def objects(self) -> list[dict[str, Any]]:
        """The rows of ``assets.json``: at least ``object`` (digest) and ``name``; of grasps also ``resting``."""
        rows: list[dict[str, Any]] = self._table("assets.json")["objects"]
        return rows

    def splits(self) -> dict[str, Any]:
        """``splits.json``; empty tables where the product has no splits."""
        return self._table("splits.json") if self.has_splits else {"training_subsets": [], "objects": []}

    def types(self) -> dict[str, Any]:
        """``types.json`` of a dataset of patches: the kept grasps by type (``counts``), those ``without`` a type, and
        the ``chosen`` types, the most common first."""
        self.expect("patches")
        return self._table("types.json")

    def _table(self, name: str) -> dict[str, Any]:
        path = self.path / name
        table = _json(path)
        entry = self.manifest["files"].get(name)
        if entry is None or entry["bytes"] != path.stat().st_size:
            raise DamagedFile(path, "the manifest knows it otherwise", VERIFY)
        return table


def _json(path: Path) -> dict[str, Any]:
    refuse_irregular(path)
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DamagedFile(path, "it is missing", VERIFY) from None
    except RecursionError:
        raise DamagedFile(path, "it is nested too deep", VERIFY) from None
    except (ValueError, UnicodeDecodeError) as error:
        raise DamagedFile(path, f"it is no JSON ({error})", VERIFY) from error
    if not isinstance(value, dict):
        raise DamagedFile(path, "it holds no JSON object", VERIFY)
    return value


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / "manifest.json"
    if not path.exists():
        raise _without_manifest(folder)
    manifest = _json(path)
    version = manifest.get("format_version")
    if isinstance(version, int) and version < FORMAT_VERSION:
        problem = f"format version {version}, and this package reads {FORMAT_VERSION}"
        remedy = "make it anew with `graspmill run`, or read it with the package of the program that wrote it"
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
    return manifest


def _without_manifest(folder: Path) -> DatasetError:
    if not folder.is_dir():
        return UnfinishedDataset(folder, "no such folder", "give the folder that `graspmill run --out` made")
    if (folder / "set.json").is_file():
        names = ", ".join(job["name"] for job in _json(folder / "set.json").get("jobs", []))
        return UnfinishedDataset(folder, f"a set of datasets ({names})", "give the folder of one of them")
    if (folder / "run.json").is_file():
        return UnfinishedDataset(
            folder,
            "unfinished: it has no manifest.json",
            "run the same `graspmill run` again, which goes on where it stopped",
        )
    if (folder / "export.json").is_file():
        return UnfinishedDataset(folder, "an export, not a dataset", "read `--to npy` with graspmill.NpyExport")
    return UnfinishedDataset(
        folder, "no dataset: it has no manifest.json", "give the folder that `graspmill run --out` made"
    )
