"""The sample index as NumPy columns, from the ledgers in the shards.

``index.parquet`` holds the same rows, but reading it requires pyarrow (170 MB installed). A ledger is three attachments of
its shard: ``ledger`` (identity and fate, one run per stretch of consecutive items), ``facts`` (one column per fact) and
``digests`` (32 bytes per kept sample and channel). Each becomes columns without a loop over rows.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from .errors import VERIFY, DamagedFile
from .fact_ranges import FACT_RANGES, FINITE
from .folder import FORMAT_VERSION, SPLITS, Folder
from .mcap import Attachment, McapFile
from .frames import index_frame
from .wire import Message, WireError

if TYPE_CHECKING:
    import pandas as pd

Column = npt.NDArray[Any]
Rows = Union[slice, npt.NDArray[np.int64]]
"""Rows of the index: a slice, or their numbers."""

_ATTACHMENTS = ("ledger", "facts", "digests")
_SPLIT_WORDS = np.array(["", *SPLITS], dtype="U10")
"""Splits by their number; empty for subjects without one."""


class Index(Mapping[str, Column]):
    """One row per sample index, in order, kept or rejected: the columns of ``index.parquet`` by name.

    ``index.frame()`` is a pandas DataFrame of them. ``object`` is the subject's name, ``subject`` its digest in 64 hexadecimal
    digits, ``item`` the number of the view, position, run or grasp; ``split`` exists if the product has splits. Facts follow
    under their own names, then ``digest_<channel>``: (rows, 32) bytes, BLAKE3 of the payload, zeros for rejected samples.

    Rows are held in their narrowest types, a few bytes each. A column is built on first use, and digests are then read from the
    shards; ``column`` builds only some rows of one.
    """

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        ledgers = [_read_ledger(folder, shard) for shard in range(len(folder.shards))]
        rows_of = {row["object"]: row for row in folder.subjects()}
        self.subjects: list[str] = sorted({subject for ledger in ledgers for subject in ledger.subjects})
        """The digests in the rows, sorted; ``subject_number`` is an index into them."""
        unknown = [subject for subject in self.subjects if subject not in rows_of]
        if unknown:
            problem = f"a shard has samples of {unknown[0]}, which is in no row"
            raise DamagedFile(folder.path / "assets.json", problem, VERIFY)
        self._names = [str(rows_of[subject]["name"]) for subject in self.subjects]
        number = {subject: index for index, subject in enumerate(self.subjects)}
        own = [np.array([number[subject] for subject in ledger.subjects], np.int32) for ledger in ledgers]
        self.subject_number = _joined([table[ledger.subject] for table, ledger in zip(own, ledgers)], np.int32)
        rows = len(self.subject_number)
        if rows != folder.samples:
            problem = f"its shards account for {rows} samples, the manifest for {folder.samples}"
            raise DamagedFile(folder.path, problem, VERIFY)
        if any(list(ledger.facts) != list(ledgers[0].facts) for ledger in ledgers):
            raise DamagedFile(folder.path, "its shards have different facts", VERIFY)
        self._firsts = np.cumsum([0, *(len(ledger.item) for ledger in ledgers)])
        # Numbers of every row, and the rejected rows with their words.
        self._numbers: dict[str, Column] = {}
        for name in ("item", "instance", "camera"):
            self._numbers[name] = _joined([getattr(ledger, name) for ledger in ledgers], np.uint32)
        for name in ledgers[0].facts if ledgers else ():
            self._numbers[name] = _joined([ledger.facts[name] for ledger in ledgers], np.uint32)
        rejected = [ledger.rejected + first for ledger, first in zip(ledgers, self._firsts.tolist())]
        self._rejected = _joined(rejected, np.int64)
        self._words = {
            "reason": [word for ledger in ledgers for word in ledger.reason],
            "detail": [word for ledger in ledgers for word in ledger.detail],
        }
        if rows - len(self._rejected) != folder.kept:
            problem = f"its ledgers keep {rows - len(self._rejected)} samples, the manifest {folder.kept}"
            raise DamagedFile(folder.path, problem, VERIFY)
        self._split, self._subsets = _splits(folder, self.subjects, self.subject_number, self._numbers["item"])

    def column(self, name: str, rows: Rows = slice(None)) -> Column:
        """Some rows of a column.

        Raises ``KeyError`` if there is none of that name.
        """
        if name not in self:
            raise KeyError(name)
        if name == "sample_index":
            return np.arange(len(self.subject_number), dtype=np.int64)[rows]
        if name == "subject":
            return np.array(self.subjects, dtype="U64")[self.subject_number[rows]]
        if name == "object":
            return np.array(self._names, dtype=np.str_)[self.subject_number[rows]]
        if name == "split":
            return _SPLIT_WORDS[self._split[rows]]
        if name == "shard":
            return np.repeat(np.arange(len(self._firsts) - 1), np.diff(self._firsts))[rows]
        if name == "kept":
            return self.kept()[rows]
        if name in self._words:
            words = np.array(["", *self._words[name]], dtype=np.str_)
            return words[self._reject_numbers()[rows]]
        if name.startswith("digest_"):
            return self._digests(self._folder.channels.index(name.removeprefix("digest_")))[rows]
        numbers = self._numbers[name][rows]
        return numbers if numbers.dtype == np.float64 else numbers.astype(np.int64)

    def kept(self) -> npt.NDArray[np.bool_]:
        """Whether each row is stored."""
        kept = np.ones(len(self.subject_number), np.bool_)
        kept[self._rejected] = False
        return kept

    def in_split(self, split: str) -> npt.NDArray[np.bool_]:
        """Whether each row is of this split."""
        mask: npt.NDArray[np.bool_] = self._split == _SPLIT_WORDS.tolist().index(split)
        return mask

    def in_subset(self, subset: int) -> npt.NDArray[np.bool_]:
        """Whether the smallest nested training subset with each row's object is this one, or one before."""
        return ((self._subsets >= 0) & (self._subsets <= subset))[self.subject_number]

    def of_objects(self, names: list[str]) -> npt.NDArray[np.bool_]:
        """Whether each row is of an object of these names."""
        return np.isin(self._names, names)[self.subject_number]

    def __getitem__(self, name: str) -> Column:
        return self.column(name)

    def __iter__(self) -> Iterator[str]:
        yield from ("sample_index", "subject", "object", "item", "instance", "camera")
        if self._folder.has_splits:
            yield "split"
        yield from ("shard", "kept", "reason", "detail")
        yield from list(self._numbers)[3:]
        yield from (f"digest_{channel}" for channel in self._folder.channels)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, name: object) -> bool:
        return any(name == own for own in self)

    def frame(self) -> pd.DataFrame:
        """All rows as a pandas DataFrame, rejected samples included; without the digests.

        Raises ``MissingPackage`` without pandas.
        """
        return index_frame(self, slice(None))

    def _reject_numbers(self) -> npt.NDArray[np.int64]:
        """Number of each row among the rejected ones, from 1; 0 for a kept one."""
        numbers = np.zeros(len(self.subject_number), np.int64)
        numbers[self._rejected] = np.arange(1, len(self._rejected) + 1)
        return numbers

    def _digests(self, channel: int) -> npt.NDArray[np.uint8]:
        """BLAKE3 of the payloads of a channel, (rows, 32)."""
        table = np.zeros((len(self.subject_number), 32), np.uint8)
        kept, firsts = self.kept(), self._firsts.tolist()
        for shard, (first, end) in enumerate(zip(firsts, firsts[1:])):
            file, found = _attachments(self._folder, shard)
            mine = kept[first:end]
            stored = _digests_of(file, found["digests"].data, int(mine.sum()), len(self._folder.channels))
            table[first:end][mine] = stored[:, channel]
        return table


@dataclass(frozen=True, eq=False)
class _Ledger:
    """One shard's rows, column by column."""

    subjects: list[str]
    subject: Column
    """Index into ``subjects``."""
    item: Column
    instance: Column
    camera: Column
    rejected: npt.NDArray[np.int64]
    """Rejected rows, ascending."""
    reason: list[str]
    """Reason of each rejected row."""
    detail: list[str]
    facts: dict[str, Column]
    """uint32 for whole numbers, float64 for the others."""


def _joined(parts: list[Column], kind: Any) -> Column:
    return np.concatenate(parts) if parts else np.zeros(0, kind)


def _splits(
    folder: Folder, subjects: list[str], numbers: npt.NDArray[np.int32], items: Column
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.int64]]:
    """Split of each row, an index into ``_SPLIT_WORDS``; and the smallest training subset with each subject (-1: none)."""
    rows = {row["object"]: row for row in folder.splits()["objects"]}
    words = _SPLIT_WORDS.tolist()
    own = [str(rows.get(subject, {}).get("split", "")) for subject in subjects]
    split = np.array([words.index(word) if word in words else 0 for word in own], np.uint8)[numbers]
    subsets = np.array([rows.get(subject, {}).get("subset", -1) for subject in subjects], np.int64)
    for index, subject in enumerate(subjects):
        row = rows.get(subject, {})
        if row.get("split") == SPLITS[0] and row.get("holdout_items"):
            split[(numbers == index) & np.isin(items, row["holdout_items"])] = words.index(SPLITS[1])
    return split, subsets


def _attachments(folder: Folder, shard: int) -> tuple[McapFile, dict[str, Attachment]]:
    """A shard and the attachments of its ledger by name."""
    file = McapFile(folder.shards[shard])
    found = {attachment.name: attachment for attachment in file.attachments()}
    missing = [name for name in _ATTACHMENTS if name not in found]
    if missing:
        raise file.damaged(f"it has no {', '.join(missing)}")
    return file, found


def _read_ledger(folder: Folder, shard: int) -> _Ledger:
    file, found = _attachments(folder, shard)
    entry = folder.manifest["shards"][shard]
    try:
        ledger = _decoded(file, found["ledger"])
        if ledger["format_version"] != FORMAT_VERSION:
            raise WireError(f"format version {ledger['format_version']}, expected {FORMAT_VERSION}")
        if (ledger["topics"], ledger["first_index"]) != (folder.topics, entry["first_sample"]):
            raise WireError(f"topics {ledger['topics']} from sample {ledger['first_index']} on")
        table = _table(ledger, _decoded(file, found["facts"]), entry["samples"])
        absent = sorted(set(folder.manifest["counts"]["facts"]) - set(table.facts))
        if absent:
            raise WireError(f"no fact {', '.join(absent)}")
        _expect_ranges(folder.product, table.facts)
        kept = len(table.item) - len(table.rejected)
        _digests_of(file, found["digests"].data, kept, len(folder.topics))
        return table
    except (IndexError, KeyError, OverflowError, ValueError) as error:
        raise file.damaged(f"its ledger cannot be read ({error})") from error


def _digests_of(file: McapFile, data: memoryview, kept: int, topics: int) -> npt.NDArray[np.uint8]:
    """The attachment ``digests``, (kept rows, topics, 32).

    Raises ``DamagedFile`` if it has another length.
    """
    if len(data) != 32 * topics * kept:
        raise file.damaged(f"{len(data)} bytes of digests for {kept} kept rows of {topics} channels")
    return np.frombuffer(data, np.uint8).reshape(-1, topics, 32)


def _expect_ranges(product: str, facts: dict[str, Column]) -> None:
    """Raises ``WireError`` unless every fact is in the range that its product declares."""
    ranges = FACT_RANGES.get(product, {})
    for name, values in facts.items():
        if values.dtype != np.float64:
            continue
        low, high = ranges.get(name, FINITE)
        outside = np.flatnonzero(~((values >= low) & (values <= high)))
        if len(outside):
            row = int(outside[0])
            raise WireError(f"the fact {name} of row {row} is {values[row]}, which is not from {low} to {high}")


def _decoded(file: McapFile, attachment: Attachment) -> Message:
    """The message of an attachment, by the schema in the shard's channels."""
    name = attachment.media_type.partition("messageType=")[2]
    schema = next((channel.schema for channel in file.channels.values() if name in channel.schema.types), None)
    if schema is None:
        raise WireError(f"no schema of the message '{name}'")
    return schema.decode(name, attachment.data)


def _table(ledger: Message, facts: Message, samples: int) -> _Ledger:
    """The rows of a ledger from its attachments. ``samples`` is the count in the manifest."""
    runs = ledger["runs"]
    lengths = np.array([run["rows"] for run in runs], np.int64)
    rows = int(lengths.sum())
    if rows != samples or (lengths < 1).any():
        raise WireError(f"{rows} rows, the manifest lists {samples}")
    of_run = np.repeat(np.arange(len(runs)), lengths)

    def column(name: str) -> Column:
        return np.array([run[name] for run in runs], np.int64)[of_run]

    # Items follow each other within a run.
    starts = np.cumsum(lengths) - lengths
    item = column("first_item") + np.arange(rows) - starts[of_run]
    subjects = [bytes(subject).hex() for subject in ledger["subjects"]]
    subject = column("subject")
    if rows and subject.max() >= len(subjects):
        raise WireError(f"a run of subject {subject.max()} of {len(subjects)}")

    rejects = ledger["rejects"]
    rejected = np.array([reject["row"] for reject in rejects], np.int64)
    if (np.diff(rejected) <= 0).any() or (rejected >= rows).any() or not all(reject["reason"] for reject in rejects):
        raise WireError("rejects out of order, beyond the rows or without a reason")

    values: dict[str, Column] = {}
    for each in facts["columns"]:
        whole, broken = each["integers"].astype(np.uint32), each["numbers"]
        values[each["name"]] = broken if len(broken) else whole
        if len(whole) + len(broken) != rows:
            raise WireError(f"the fact {each['name']} has {len(whole) + len(broken)} values for {rows} rows")
    return _Ledger(
        subjects=subjects,
        subject=subject.astype(np.int32),
        item=item.astype(np.uint32),
        instance=column("instance").astype(np.uint32),
        camera=column("camera").astype(np.uint32),
        rejected=rejected,
        reason=[sys.intern(reject["reason"]) for reject in rejects],
        detail=[reject["detail"] for reject in rejects],
        facts=values,
    )
