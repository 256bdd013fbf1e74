"""MCAP files as graspmill writes them: the summary, chunks by the time they cover, messages of a chunk.

The official ``mcap`` package reads these files, too, and tests compare the two; it creates Python objects for each record, which
is too slow for shuffled training (``docs/benchmarks.md`` has the figures). Source: the MCAP specification, version 0.
"""

from __future__ import annotations

import struct
import threading
import zlib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Iterator

import numpy as np
import numpy.typing as npt
import zstandard

from .errors import VERIFY, DamagedFile
from .files import FileBytes
from .wire import Schema

MAGIC = b"\x89MCAP0\r\n"
_FOOTER = 1 + 8 + 8 + 8 + 4
_RECORD = struct.Struct("<BQ")
_FOOT = struct.Struct("<QQI")
_TIMES = struct.Struct("<QQQQ")
_CHUNK = struct.Struct("<QQQI")
_SIZES = struct.Struct("<QQ")
_MESSAGE = struct.Struct("<HIQ")
_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")

_OP_SCHEMA, _OP_CHANNEL, _OP_MESSAGE, _OP_CHUNK = 0x03, 0x04, 0x05, 0x06
_OP_CHUNK_INDEX, _OP_ATTACHMENT, _OP_ATTACHMENT_INDEX = 0x08, 0x09, 0x0A

_BROKEN = (struct.error, IndexError, KeyError, ValueError)
"""Errors of bytes that are not records."""
_MAX_CHUNK = 1 << 30
"""Bytes of a chunk, unpacked, at most; the program has the same limit."""

_own = threading.local()


def _unpack(data: memoryview, size: int) -> bytes:
    """One zstd frame; a context of libzstd serves one thread at a time."""
    context = getattr(_own, "context", None)
    if context is None:
        context = _own.context = zstandard.ZstdDecompressor()
    # The size in the frame's own head overrides ours: it could allocate all memory.
    if zstandard.frame_content_size(data) > size:
        raise zstandard.ZstdError("it is larger than it states")
    return bytes(context.decompress(data, max_output_size=size))


@lru_cache(maxsize=32)
def _schema(descriptors: bytes) -> Schema:
    """The message types of serialised descriptors: all shards of a dataset have the same ones."""
    return Schema(descriptors)


@dataclass(frozen=True)
class Channel:
    """A topic and the message type on it."""

    topic: str
    schema_name: str
    schema: Schema


@dataclass(frozen=True)
class Attachment:
    """A named file inside the file."""

    name: str
    media_type: str
    data: memoryview


@dataclass
class McapFile:
    """A finished MCAP file, of which the summary is in memory; it can be pickled, and is then opened again."""

    path: Path
    channels: dict[int, Channel] = field(default_factory=dict)
    first: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    """First time of each chunk (in shards: sample index), ascending."""
    last: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    offsets: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    """Offset of each chunk's record in the file [bytes]."""
    lengths: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    """Length of each chunk's record [bytes]."""

    def __post_init__(self) -> None:
        self._bytes = FileBytes(self.path)
        try:
            self._read_summary()
        except (*_BROKEN, OverflowError, RecursionError) as error:
            raise self.damaged(f"its summary cannot be read ({error})") from error

    def damaged(self, problem: str) -> DamagedFile:
        """An error about this file."""
        return DamagedFile(self.path, problem, VERIFY)

    def __getstate__(self) -> dict[str, object]:
        return {"path": self.path}

    def __setstate__(self, state: dict[str, Path]) -> None:
        self.__init__(state["path"])  # type: ignore[misc]

    def _read_summary(self) -> None:
        end = self._bytes.size - len(MAGIC)
        foot = self._bytes.read(end - 20, 28) if end >= _FOOTER else memoryview(b"")
        if self._bytes.read(0, 8) != MAGIC or foot[20:] != MAGIC:
            raise self.damaged("it is not a complete MCAP file")
        start, _, crc = _FOOT.unpack_from(foot)
        if not 8 <= start < end - _FOOTER:
            raise self.damaged("the checksum of its summary does not hold")
        # From here on offsets count from the start of the summary.
        data = self._bytes.read(start, end - start)
        if zlib.crc32(data[:-4]) != crc:
            raise self.damaged("the checksum of its summary does not hold")
        schemas: dict[int, tuple[str, memoryview]] = {}
        channels: dict[int, tuple[int, str]] = {}
        chunks: list[tuple[int, int, int, int]] = []
        self._attachments: list[tuple[int, int]] = []
        place = 0
        while place < len(data) - _FOOTER:
            op, length = _RECORD.unpack_from(data, place)
            place += 9
            if op == _OP_CHUNK_INDEX:
                chunks.append(_TIMES.unpack_from(data, place))
            elif op == _OP_SCHEMA:
                number = _U16.unpack_from(data, place)[0]
                name, at = _string(data, place + 2)
                _, at = _string(data, at)
                size = _U32.unpack_from(data, at)[0]
                schemas[number] = (name, data[at + 4 : at + 4 + size])
            elif op == _OP_CHANNEL:
                number, schema = struct.unpack_from("<HH", data, place)
                channels[number] = (schema, _string(data, place + 4)[0])
            elif op == _OP_ATTACHMENT_INDEX:
                self._attachments.append(_SIZES.unpack_from(data, place))
            place += length
        for number, (schema, topic) in channels.items():
            name, descriptors = schemas[schema]
            self.channels[number] = Channel(topic, name, _schema(bytes(descriptors)))
        table = np.array(chunks, np.int64).reshape(-1, 4)
        table = table[np.argsort(table[:, 0], kind="stable")]
        self.first, self.last, self.offsets, self.lengths = table.T.copy()

    def chunk_of(self, time: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """The chunk whose span holds each time; for a time between chunks, the chunk after it."""
        return np.searchsorted(self.last, time)

    def chunk(self, number: int) -> memoryview:
        """The records of a chunk, unpacked; its checksum is compared each time.

        Raises ``DamagedFile``.
        """
        place, length = int(self.offsets[number]), int(self.lengths[number])
        if place < 0 or not 0 <= length <= _MAX_CHUNK:
            raise self.damaged(f"chunk {number} has {length} bytes at byte {place}, at most {_MAX_CHUNK} are allowed")
        data = self._bytes.read(place, length)
        try:
            op, _ = _RECORD.unpack_from(data)
            if op != _OP_CHUNK:
                raise self.damaged(f"no chunk is at byte {place}")
            _, _, size, crc = _CHUNK.unpack_from(data, 9)
            codec, at = _string(data, 9 + 28)
            packed = _U64.unpack_from(data, at)[0]
        except _BROKEN as error:
            raise self.damaged(f"chunk {number} cannot be read ({error})") from error
        if size > _MAX_CHUNK:
            raise self.damaged(f"chunk {number} has {size} bytes, at most {_MAX_CHUNK} are allowed")
        records = data[at + 8 : at + 8 + packed]
        if codec == "zstd":
            try:
                # The size is only stated by the file: the checksum covers it.
                records = memoryview(_unpack(records, size))
            except zstandard.ZstdError as error:
                raise self.damaged(f"chunk {number} cannot be unpacked ({error})") from error
        elif codec:
            raise self.damaged(f"chunk {number} is packed by '{codec}'")
        if len(records) != size or (crc and zlib.crc32(records) != crc):
            raise self.damaged(f"the checksum of chunk {number} does not hold")
        return records

    def messages(self, records: memoryview) -> Iterator[tuple[int, int, memoryview]]:
        """Channel, time and payload of each message of a chunk's records.

        Raises ``DamagedFile``.
        """
        place, end = 0, len(records)
        while place < end:
            if end - place < 9:
                raise self.damaged("a chunk ends within a record")
            op, length = _RECORD.unpack_from(records, place)
            place += 9
            if length > end - place or (op == _OP_MESSAGE and length < 22):
                raise self.damaged("a chunk ends within a record")
            if op == _OP_MESSAGE:
                channel, _, time = _MESSAGE.unpack_from(records, place)
                yield channel, time, records[place + 22 : place + length]
            place += length

    def attachments(self) -> Iterator[Attachment]:
        """The attachments, each with its checksum compared.

        Raises ``DamagedFile``.
        """
        for place, length in self._attachments:
            try:
                yield self._attachment(place, length)
            except _BROKEN as error:
                raise self.damaged(f"an attachment cannot be read ({error})") from error

    def _attachment(self, place: int, length: int) -> Attachment:
        record = self._bytes.read(place, length)
        data = record[9:]
        if record[0] != _OP_ATTACHMENT or zlib.crc32(data[:-4]) != _U32.unpack(data[-4:])[0]:
            raise self.damaged("the checksum of an attachment does not hold")
        name, at = _string(data, 16)
        media_type, at = _string(data, at)
        size = _U64.unpack_from(data, at)[0]
        if size != len(data) - 4 - (at + 8):
            raise self.damaged(f"the attachment {name} has {len(data) - 12 - at} bytes and states {size}")
        return Attachment(name, media_type, data[at + 8 : at + 8 + size])


def _string(data: memoryview, place: int) -> tuple[str, int]:
    length = _U32.unpack_from(data, place)[0]
    if length > len(data) - place - 4:
        raise IndexError("a text ends behind its record")
    return str(data[place + 4 : place + 4 + length], "utf-8"), place + 4 + length
