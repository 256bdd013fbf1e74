"""The sample index as NumPy columns, out of the ledgers that the shards carry.

``index.parquet`` holds the same rows, but reading it takes pyarrow (170 MB installed). A ledger is three attachments of
its shard: ``ledger`` (identity and fate, one run per stretch of consecutive items), ``facts`` (one column per fact) and
``digests`` (32 bytes per kept sample and channel). Each becomes columns without a loop over rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import VERIFY, DamagedFile
from .folder import FORMAT_VERSION, SPLITS, Folder
from .mcap import Attachment, McapFile
from .frames import index_frame
from .wire import Message, WireError

if TYPE_CHECKING:
    import pandas as pd

Column = npt.NDArray[Any]

_ATTACHMENTS = ("ledger", "facts", "digests")


class Index(Mapping[str, Column]):
    """One row per sample index, in order, kept or rejected: the columns of ``index.parquet`` by name.

    ``index.frame()`` is a pandas DataFrame of them. ``object`` is the subject's name, ``subject`` its digest in 64
    hexadecimal digits, ``item`` the number of the view, position, run or grasp; ``split`` is there where the product
    has splits. Facts follow under their own names, then ``digest_<channel>``: (rows, 32) bytes, BLAKE3 of the payload,
    zeros for rejected samples.
    """

    def __init__(self, folder: Folder) -> None:
        ledgers = [_read_ledger(folder, shard) for shard in range(len(folder.shards))]
        names = {row["object"]: row["name"] for row in folder.subjects()}
        unknown = sorted({subject for ledger in ledgers for subject in ledger.subjects} - set(names))
        if unknown:
            problem = f"a shard has samples of {unknown[0]}, which stands in no row"
            raise DamagedFile(folder.path / "assets.json", problem, VERIFY)
        self.subjects: list[str] = sorted({subject for ledger in ledgers for subject in ledger.subjects})
        """The digests that rows name, sorted; ``subject_number`` is an index into them."""
        number = {subject: index for index, subject in enumerate(self.subjects)}
        own = [np.array([number[subject] for subject in ledger.subjects], np.int64) for ledger in ledgers]
        self.subject_number = _joined([table[ledger.subject] for table, ledger in zip(own, ledgers)], np.int64)
        rows = len(self.subject_number)
        if rows != folder.samples:
            problem = f"its shards account for {rows} samples, the manifest for {folder.samples}"
            raise DamagedFile(folder.path, problem, VERIFY)
        columns: dict[str, Column] = {"sample_index": np.arange(rows, dtype=np.int64)}
        columns["subject"] = np.array(self.subjects, dtype="U64")[self.subject_number]
        columns["object"] = np.array([names[subject] for subject in self.subjects])[self.subject_number]
        for name in ("item", "instance", "camera"):
            columns[name] = _joined([getattr(ledger, name) for ledger in ledgers], np.int64)
        # `subset`: the smallest nested training subset that holds a row's object, -1 without one.
        split, self.subset = _splits(folder, self.subjects, self.subject_number, columns["item"])
        if folder.has_splits:
            columns["split"] = split
        columns["shard"] = np.repeat(np.arange(len(ledgers)), [len(ledger.item) for ledger in ledgers])
        columns["kept"] = _joined([ledger.reason == "" for ledger in ledgers], np.bool_)
        columns["reason"] = _joined([ledger.reason for ledger in ledgers], np.str_)
        columns["detail"] = _joined([ledger.detail for ledger in ledgers], np.str_)
        if any(list(ledger.facts) != list(ledgers[0].facts) for ledger in ledgers):
            raise DamagedFile(folder.path, "its shards have different facts", VERIFY)
        for name in ledgers[0].facts if ledgers else ():
            columns[name] = _joined([ledger.facts[name] for ledger in ledgers], np.int64)
        for index, channel in enumerate(folder.channels):
            columns[f"digest_{channel}"] = _joined([ledger.digests[:, index] for ledger in ledgers], np.uint8)
        if int(columns["kept"].sum()) != folder.kept:
            problem = f"its ledgers keep {int(columns['kept'].sum())} samples, the manifest {folder.kept}"
            raise DamagedFile(folder.path, problem, VERIFY)
        self._columns = columns

    def __getitem__(self, name: str) -> Column:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def frame(self) -> pd.DataFrame:
        """All rows as a pandas DataFrame, rejected samples included; without the digests.

        Raises ``MissingPackage`` without pandas.
        """
        return index_frame(self, slice(None))


@dataclass(frozen=True, eq=False)
class _Ledger:
    """One shard's rows, column by column."""

    subjects: list[str]
    subject: Column
    """Index into ``subjects``."""
    item: Column
    instance: Column
    camera: Column
    reason: Column
    """Empty for kept samples."""
    detail: Column
    facts: dict[str, Column]
    digests: npt.NDArray[np.uint8]
    """(rows, channels, 32)"""


def _joined(parts: list[Column], kind: Any) -> Column:
    return np.concatenate(parts) if parts else np.zeros(0, kind)


def _splits(
    folder: Folder, subjects: list[str], numbers: npt.NDArray[np.int64], items: Column
) -> tuple[Column, npt.NDArray[np.int64]]:
    """Split of each row, and the smallest training subset that holds its object (-1: none)."""
    rows = {row["object"]: row for row in folder.splits()["objects"]}
    split = np.array([rows.get(subject, {}).get("split", "") for subject in subjects], dtype="U10")[numbers]
    subset = np.array([rows.get(subject, {}).get("subset", -1) for subject in subjects], np.int64)[numbers]
    for index, subject in enumerate(subjects):
        row = rows.get(subject, {})
        if row.get("split") == SPLITS[0] and row.get("holdout_items"):
            split[(numbers == index) & np.isin(items, row["holdout_items"])] = SPLITS[1]
    return split, subset


def _read_ledger(folder: Folder, shard: int) -> _Ledger:
    file = McapFile(folder.shards[shard])
    found = {attachment.name: attachment for attachment in file.attachments()}
    missing = [name for name in _ATTACHMENTS if name not in found]
    if missing:
        raise file.damaged(f"it has no {', '.join(missing)}")
    entry = folder.manifest["shards"][shard]
    try:
        ledger = _decoded(file, found["ledger"])
        if ledger["format_version"] != FORMAT_VERSION:
            raise WireError(f"format version {ledger['format_version']}, expected {FORMAT_VERSION}")
        if (ledger["topics"], ledger["first_index"]) != (folder.topics, entry["first_sample"]):
            raise WireError(f"topics {ledger['topics']} from sample {ledger['first_index']} on")
        table = _table(ledger, _decoded(file, found["facts"]), found["digests"].data, entry["samples"])
        absent = sorted(set(folder.manifest["counts"]["facts"]) - set(table.facts))
        if absent:
            raise WireError(f"no fact {', '.join(absent)}")
        return table
    except (IndexError, KeyError, OverflowError, ValueError) as error:
        raise file.damaged(f"its ledger cannot be read ({error})") from error


def _decoded(file: McapFile, attachment: Attachment) -> Message:
    """The message of an attachment, by the schema that the shard's channels carry."""
    name = attachment.media_type.partition("messageType=")[2]
    schema = next((channel.schema for channel in file.channels.values() if name in channel.schema.types), None)
    if schema is None:
        raise WireError(f"no schema of the message '{name}'")
    return schema.decode(name, attachment.data)


def _table(ledger: Message, facts: Message, digests: memoryview, samples: int) -> _Ledger:
    """The rows of a ledger out of its three attachments. ``samples`` is the count that the manifest says."""
    runs = ledger["runs"]
    lengths = np.array([run["rows"] for run in runs], np.int64)
    rows = int(lengths.sum())
    if rows != samples or (lengths < 1).any():
        raise WireError(f"{rows} rows, the manifest says {samples}")
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
    words = {}
    for name in ("reason", "detail"):
        texts = np.full(rows, "", dtype=object)
        texts[rejected] = [reject[name] for reject in rejects]
        words[name] = texts.astype(str)

    values: dict[str, Column] = {}
    for each in facts["columns"]:
        whole, broken = each["integers"].astype(np.int64), each["numbers"]
        values[each["name"]] = broken if len(broken) else whole
        if len(whole) + len(broken) != rows:
            raise WireError(f"the fact {each['name']} has {len(whole) + len(broken)} values for {rows} rows")

    kept = np.ones(rows, np.bool_)
    kept[rejected] = False
    topics = len(ledger["topics"])
    if len(digests) != 32 * topics * int(kept.sum()):
        raise WireError(f"{len(digests)} bytes of digests for {int(kept.sum())} kept rows of {topics} channels")
    table = np.zeros((rows, topics, 32), np.uint8)
    table[kept] = np.frombuffer(digests, np.uint8).reshape(-1, topics, 32)
    return _Ledger(
        subjects=subjects,
        subject=subject,
        item=item,
        instance=column("instance"),
        camera=column("camera"),
        reason=words["reason"],
        detail=words["detail"],
        facts=values,
        digests=table,
    )
