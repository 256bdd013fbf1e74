"""The sample index as NumPy columns.

``index.parquet`` holds the same rows, but reading it takes pyarrow (170 MB installed). The ledgers inside the shards
hold them, too: one protobuf row a sample index. They are read here column by column, all rows of a shard at a time, so
that NumPy alone is enough.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import VERIFY, DamagedFile
from .folder import SPLITS, Folder
from .mcap import McapFile
from .wire import BYTES, DOUBLE, STRING, MessageType, WireError, varint, varints

Column = npt.NDArray[Any]

# As the index names the numbers of packed lists, in order.
_LISTS = {
    "labels": ("no_solution", "colliding", "reachable"),
    "proofs": ("by_bound", "by_interval_ends", "by_swept", "by_searched", "by_witness"),
    "verdicts": (
        *("grasps_kept", "grasps_penetrates", "grasps_open_hand", "grasps_no_force_closure", "grasps_low_quality"),
        "grasps_below_table",
    ),
    "trials": ("grasps_tried", "grasps_held", "grasps_refused"),
}
_NOT_FACTS = {"subject", "instance", "view", "camera", "digests", "reason", "detail"}


class Index(Mapping[str, Column]):
    """One row a sample index, in order, kept or rejected: the columns of ``index.parquet`` by name.

    ``dict(index)`` is what ``pandas.DataFrame`` takes. ``object`` is the object's name, ``subject`` its digest in 64
    hexadecimal digits, ``split`` empty where the product has no splits; ``digest_<channel>`` are (rows, 32) bytes,
    BLAKE3 of the payload, zeros of rejected samples.
    """

    def __init__(self, folder: Folder) -> None:
        tables = [_read_ledger(path, folder) for path in folder.shards]
        names = {row["object"]: row["name"] for row in folder.objects()}
        self.subjects: list[str] = sorted({subject for table in tables for subject in table.subjects})
        """The digests that rows name, sorted; ``subject_number`` counts them."""
        number = {subject: place for place, subject in enumerate(self.subjects)}
        parts = [np.array([number[subject] for subject in table.subjects], np.int64) for table in tables]
        self.subject_number = np.concatenate(
            [of[table.columns["subject"].astype(np.int64)] for of, table in zip(parts, tables)]
            or [np.zeros(0, np.int64)]
        )
        columns: dict[str, Column] = {"sample_index": np.arange(len(self.subject_number), dtype=np.int64)}
        if len(self.subject_number) != folder.samples:
            problem = f"its shards account for {len(self.subject_number)} samples, the manifest for {folder.samples}"
            raise DamagedFile(folder.path, problem, VERIFY)
        columns["subject"] = np.array(self.subjects, dtype="U64")[self.subject_number]
        columns["object"] = np.array([names.get(subject, "") for subject in self.subjects])[self.subject_number]
        for name in ("instance", "view", "camera"):
            columns[name] = _together(tables, name).astype(np.int64)
        # `subset`: the smallest nested training subset that holds a row's object, -1 without one.
        split, self.subset = _splits(folder, self.subjects, self.subject_number, columns["view"])
        if folder.product != "reachability":
            columns["split"] = split
        columns["shard"] = np.repeat(np.arange(len(tables)), [len(table.columns["view"]) for table in tables])
        columns["reason"] = _together(tables, "reason")
        columns["detail"] = _together(tables, "detail")
        columns["kept"] = columns["reason"] == ""
        for name in tables[0].columns if tables else ():
            if name not in _NOT_FACTS:
                columns[name] = _together(tables, name)
        for place, topic in enumerate(folder.topics):
            digests = [table.digests[:, place] for table in tables]
            columns[f"digest_{topic.rsplit('/', 1)[-1]}"] = np.concatenate(digests or [np.zeros((0, 32), np.uint8)])
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


class _Ledger:
    """One shard's rows, column by column."""

    def __init__(self, subjects: list[str], columns: dict[str, Column], digests: npt.NDArray[np.uint8]) -> None:
        self.subjects = subjects
        self.columns = columns
        self.digests = digests


def _together(tables: list[_Ledger], name: str) -> Column:
    return np.concatenate([table.columns[name] for table in tables] or [np.zeros(0)])


def _splits(
    folder: Folder, subjects: list[str], numbers: npt.NDArray[np.int64], views: Column
) -> tuple[Column, npt.NDArray[np.int64]]:
    """Split of each row, and the smallest training subset that holds its object (-1: none)."""
    rows = {row["object"]: row for row in folder.splits()["objects"]}
    split = np.array([rows.get(subject, {}).get("models", "") for subject in subjects], dtype="U17")[numbers]
    subset = np.array([rows.get(subject, {}).get("subset", -1) for subject in subjects], np.int64)[numbers]
    for place, subject in enumerate(subjects):
        row = rows.get(subject, {})
        if row.get("models") == SPLITS[0] and row.get("holdout_views"):
            split[(numbers == place) & np.isin(views, row["holdout_views"])] = SPLITS[1]
    return split, subset


def _read_ledger(path: Any, folder: Folder) -> _Ledger:
    file = McapFile(path)
    attachment = next((found for found in file.attachments() if found.name == "ledger"), None)
    if attachment is None:
        raise file.damaged("it has no ledger")
    name = attachment.media_type.partition("messageType=")[2]
    schema = next((channel.schema for channel in file.channels.values() if name in channel.schema.types), None)
    if schema is None:
        raise file.damaged(f"no schema of its ledger, {name}")
    try:
        return _parse(schema.types[name], schema.types, attachment.data, len(folder.topics))
    except (IndexError, WireError, ValueError) as error:
        raise file.damaged(f"its ledger cannot be read ({error})") from error


def _parse(kind: MessageType, types: dict[str, MessageType], data: memoryview, topics: int) -> _Ledger:
    row_field, subject_field = kind.by_name["rows"], kind.by_name["subjects"]
    subjects: list[str] = []
    starts: list[int] = []
    ends: list[int] = []
    place, end = 0, len(data)
    while place < end:
        tag, place = varint(data, place)
        if tag & 7 == 2:
            length, place = varint(data, place)
            if tag >> 3 == row_field.number:
                starts.append(place)
                ends.append(place + length)
            elif tag >> 3 == subject_field.number:
                subjects.append(bytes(data[place : place + length]).hex())
            place += length
        else:
            _, place = varint(data, place)
    raw = np.frombuffer(bytes(data) + b"\0" * 16, np.uint8)
    columns, spans = _rows(types[row_field.message], raw, np.array(starts, np.int64), np.array(ends, np.int64))
    digest_starts, lengths = spans.pop("digests")
    digests = np.zeros((len(starts), topics, 32), np.uint8)
    kept = lengths > 0
    if np.any(lengths[kept] != 32 * topics):
        raise WireError("a row has digests of other topics")
    offsets = np.arange(32 * topics)
    digests[kept] = raw[digest_starts[kept, None] + offsets].reshape(-1, topics, 32)
    for field, (at, sizes) in spans.items():
        parts = [bytes(raw[start : start + size]) for start, size in zip(at, sizes)]
        if types[row_field.message].by_name[field].kind == STRING:
            columns[field] = np.array([str(part, "utf-8") for part in parts], dtype=object).astype(str)
        else:
            columns.update(_lists(field, parts))
    return _Ledger(subjects, columns, digests)


def _lists(field: str, parts: list[bytes]) -> dict[str, Column]:
    """The numbers of packed lists as columns; a list that no row has makes none (trials)."""
    names = _LISTS.get(field, ())
    table = np.zeros((len(parts), len(names)), np.int64)
    longest = 0
    for row, part in enumerate(parts):
        numbers = varints(memoryview(part))[: len(names)]
        longest = max(longest, len(numbers))
        table[row, : len(numbers)] = numbers
    if longest == 0 and field == "trials":
        return {}
    return {name: table[:, place] for place, name in enumerate(names)}


Spans = dict[str, tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]


def _rows(
    kind: MessageType, raw: npt.NDArray[np.uint8], starts: npt.NDArray[np.int64], ends: npt.NDArray[np.int64]
) -> tuple[dict[str, Column], Spans]:
    """All rows in step: the k-th field of each, whatever it is. Numbers as columns, the rest as start and length."""
    count = len(starts)
    columns: dict[str, Column] = {}
    spans: Spans = {}
    for field in kind.fields.values():
        if field.kind in (STRING, BYTES) or field.repeated:
            spans[field.name] = (np.zeros(count, np.int64), np.zeros(count, np.int64))
        else:
            columns[field.name] = np.zeros(count, np.float64 if field.kind == DOUBLE else np.int64)
    place = starts.copy()
    rows = np.arange(count)
    while len(rows):
        rows = rows[place[rows] < ends[rows]]
        tags, place[rows] = _varints_at(raw, place[rows])
        for tag in np.unique(tags):
            some = rows[tags == tag]
            own = kind.fields.get(int(tag) >> 3)
            if tag & 7 == 2:
                lengths, at = _varints_at(raw, place[some])
                if own is not None:
                    spans[own.name][0][some], spans[own.name][1][some] = at, lengths
                place[some] = at + lengths
            elif tag & 7 == 0:
                values, place[some] = _varints_at(raw, place[some])
                if own is not None:
                    columns[own.name][some] = values
            elif tag & 7 == 1:
                values = raw[place[some, None] + np.arange(8)].view("<f8")[:, 0]
                if own is not None:
                    columns[own.name][some] = values
                place[some] += 8
            else:
                raise WireError(f"wire type {int(tag) & 7} in a row")
    if np.any(place != ends):
        raise WireError("a row ends within a field")
    return columns, spans


def _varints_at(
    raw: npt.NDArray[np.uint8], place: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """One number at each place, and the places behind them."""
    place = place.copy()
    values = np.zeros(len(place), np.int64)
    more = np.arange(len(place))
    for shift in range(0, 64, 7):
        byte = raw[place[more]].astype(np.int64)
        values[more] |= (byte & 0x7F) << shift
        place[more] += 1
        more = more[byte >= 0x80]
        if not len(more):
            return values, place
    raise WireError("a number of more than ten bytes")
