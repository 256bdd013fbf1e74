"""The export ``graspmill export --to npy``, mapped into memory: the fastest way to read completion pairs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .completion import PairBatch
from .errors import BadSelection, DamagedFile, UnfinishedDataset
from .geometry import pack
from .inside import read_text, size_inside

_AGAIN = "export it again"


class NpyExport:
    """Pairs of an export, by row: ``len(pairs)``, ``pairs[k]``, ``pairs.gather([...])``.

    ``split`` and ``objects`` (names) select rows of ``samples.csv``. Exports with ``--unpacked`` work, too.

    Raises ``DatasetError`` for a folder that is not such an export, ``BadSelection`` for an empty selection.
    """

    def __init__(self, folder: str | Path, *, split: str | None = None, objects: Iterable[str] | None = None) -> None:
        self.path = Path(folder)
        facts = self.path / "export.json"
        if not facts.is_file():
            raise UnfinishedDataset(
                self.path, "not an export: it has no export.json", "make it with `graspmill export --to npy`"
            )
        self.facts: dict[str, Any] = json.loads(read_text(self.path, facts.name))
        if self.facts.get("format") != "npy":
            raise UnfinishedDataset(self.path, f"an export to {self.facts.get('format')}", "give one `--to npy`")
        self.root: str = self.facts["root"]
        """Root digest of the exported dataset."""
        rows = list(csv.DictReader(io.StringIO(read_text(self.path, "samples.csv"), newline="")))
        names = [] if objects is None else [objects] if isinstance(objects, str) else list(objects)
        chosen = [
            place
            for place, row in enumerate(rows)
            if (split is None or row["split"] == split) and (objects is None or row["object"] in names)
        ]
        if not chosen:
            raise BadSelection(f"{self.path}: no row of split {split!r} and objects {names}")
        self.rows = np.array(chosen, np.int64)
        """Row in the arrays for each index."""
        self.samples = [rows[place] for place in chosen]
        """The rows of ``samples.csv``, as text."""
        self.indices = np.array([int(row["sample_index"]) for row in self.samples], np.int64)
        self.resolution = int(rows[0]["resolution"])
        self._open(len(rows))

    def _open(self, count: int) -> None:
        self._partial, self._complete = self._array("partial", count), self._array("complete", count)
        touched = (self.path / "tactile.npy").is_file()
        self._tactile = self._array("tactile", count) if touched else None

    def _array(self, name: str, count: int) -> npt.NDArray[Any]:
        path = self.path / f"{name}.npy"
        try:
            # Refuses links and everything that is not a regular file.
            size_inside(self.path, path.name)
            # Mapped, then taken as a plain array: each row of a memmap would create a new object of that class.
            array: npt.NDArray[Any] = np.load(path, mmap_mode="r").view(np.ndarray)
        except (OSError, ValueError) as error:
            raise DamagedFile(path, f"it cannot be read ({error})", _AGAIN) from error
        n = self.resolution
        if array.shape not in {(count, (n**3 + 7) // 8), (count, n, n, n)}:
            raise DamagedFile(path, f"an array of shape {array.shape} for {count} rows of samples.csv", _AGAIN)
        return array

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: value for name, value in self.__dict__.items() if name not in ("_partial", "_complete", "_tactile")
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._open(self.facts["samples"])

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, place: int) -> PairBatch:
        """One pair, as a batch of one."""
        if not -len(self) <= place < len(self):
            raise IndexError(f"index {place} of {len(self)} samples")
        return self.gather([place])

    def gather(self, places: Sequence[int] | npt.NDArray[np.int64]) -> PairBatch:
        """Pairs at several indices, packed, in the given order."""
        wanted = np.asarray(places, np.int64)
        rows = self.rows[wanted]
        tactile = None if self._tactile is None else self._bits(self._tactile, rows)
        partial, complete = self._bits(self._partial, rows), self._bits(self._complete, rows)
        return PairBatch(self.resolution, self.indices[wanted], partial, complete, None, tactile)

    @staticmethod
    def _bits(array: npt.NDArray[Any], rows: npt.NDArray[np.int64]) -> npt.NDArray[np.uint8]:
        picked = array[rows]
        return pack(picked) if picked.dtype == np.bool_ else picked
