"""Protobuf's wire format, read by the schemas in the files themselves.

Every MCAP file of graspmill contains the ``FileDescriptorSet`` of its messages, so this module repeats no field number, and
a channel that is newer than this package still decodes. A ``bytes`` field is a slice of the payload,
not a copy; a packed list of numbers is a NumPy array.

Source: Protocol Buffers, "Encoding" and ``descriptor.proto``.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Message = dict[str, Any]
"""Field name -> value; absent fields have their defaults: 0, "", empty, and None for messages."""

# FieldDescriptorProto.Type
DOUBLE, FLOAT, FIXED64, FIXED32, BOOL, STRING, MESSAGE, BYTES, UINT32 = 1, 2, 6, 7, 8, 9, 11, 12, 13
_VARINTS = {3, 4, 5, BOOL, UINT32, 14}
_FIXED: dict[int, np.dtype[Any]] = {
    DOUBLE: np.dtype("<f8"),
    FLOAT: np.dtype("<f4"),
    FIXED64: np.dtype("<u8"),
    FIXED32: np.dtype("<u4"),
}
_REPEATED = 3
_MAX_UINT32 = 0xFFFF_FFFF
"""Only the lower 32 bits of a longer number count, as in every reader of the format."""


class WireError(ValueError):
    """Bytes that are not a message of the schema."""


@dataclass(frozen=True)
class Field:
    """One field of a message type."""

    name: str
    number: int
    kind: int
    repeated: bool
    message: str
    """Full name of the message type of a field that holds messages."""


class MessageType:
    """The fields of one message type, by number, and the content of an empty message."""

    def __init__(self, name: str, fields: list[Field]) -> None:
        self.name = name
        self.fields = {field.number: field for field in fields}
        self.by_name = {field.name: field for field in fields}
        self.scalars: Message = {}
        self.lists: list[Field] = []
        for field in fields:
            if field.repeated:
                self.lists.append(field)
            else:
                self.scalars[field.name] = _default(field.kind)


def _default(kind: int) -> Any:
    if kind == STRING:
        return ""
    if kind == BYTES:
        return memoryview(b"")
    if kind == MESSAGE:
        return None
    if kind == BOOL:
        return False
    return 0.0 if kind in (DOUBLE, FLOAT) else 0


def _dtype(field: Field) -> np.dtype[Any]:
    """Type of a list of numbers."""
    return _FIXED.get(field.kind, np.dtype("<u8"))


def varint(data: memoryview | bytes, place: int) -> tuple[int, int]:
    """The number at offset ``place``, of 64 bits, and the offset behind it."""
    value = shift = 0
    while True:
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFF_FFFF_FFFF_FFFF, place
        shift += 7
        if shift > 63:
            raise WireError("a number of more than ten bytes")


def varints(data: memoryview) -> npt.NDArray[np.uint64]:
    """All numbers of a packed list."""
    raw = np.frombuffer(data, np.uint8)
    ends = np.flatnonzero(raw < 0x80)
    if len(raw) and (not len(ends) or ends[-1] != len(raw) - 1):
        raise WireError("a packed list ends within a number")
    starts = np.concatenate([[0], ends[:-1] + 1])[: len(ends)]
    lengths = ends - starts + 1
    values = np.zeros(len(ends), np.uint64)
    for k in range(int(lengths.max(initial=0))):
        more = lengths > k
        values[more] |= (raw[starts[more] + k] & np.uint64(0x7F)).astype(np.uint64) << np.uint64(7 * k)
    return values


class Schema:
    """Message types by full name, from a serialised ``FileDescriptorSet``."""

    def __init__(self, descriptors: bytes | memoryview) -> None:
        self._descriptors = bytes(descriptors)
        self.types: dict[str, MessageType] = {}
        for file in _children(memoryview(descriptors), 1):
            package = _text(file, 2)
            for message in _children(file, 4):
                self._add(package, message)

    def __reduce__(self) -> tuple[type[Schema], tuple[bytes]]:
        return Schema, (self._descriptors,)

    def _add(self, scope: str, message: memoryview) -> None:
        name = f"{scope}.{_text(message, 1)}" if scope else _text(message, 1)
        fields = [
            Field(
                name=_text(field, 1),
                number=_number(field, 3),
                kind=_number(field, 5),
                repeated=_number(field, 4) == _REPEATED,
                message=_text(field, 6).lstrip("."),
            )
            for field in _children(message, 2)
        ]
        self.types[name] = MessageType(name, fields)
        for nested in _children(message, 3):
            self._add(name, nested)

    def decode(self, name: str, data: memoryview) -> Message:
        """A message of this type.

        Raises ``WireError`` if the bytes are not such a message.
        """
        try:
            return self._decode(self.types[name], data)
        except (IndexError, struct.error, UnicodeDecodeError, KeyError, RecursionError) as error:
            raise WireError(f"no {name}: {error}") from error

    def _decode(self, kind: MessageType, data: memoryview) -> Message:
        message = dict(kind.scalars)
        lists: dict[str, list[Any]] = {}
        place, end = 0, len(data)
        while place < end:
            tag, place = varint(data, place)
            field = kind.fields.get(tag >> 3)
            wire = tag & 7
            if wire == 2:
                length, place = varint(data, place)
                part = data[place : place + length]
                place += length
                if place > end:
                    raise WireError(f"{kind.name} ends within a field")
                if field is None:
                    continue
                value = self._part(field, part)
            elif wire == 0:
                value, place = varint(data, place)
                if field is None:
                    continue
                if field.kind not in _VARINTS:
                    raise WireError(f"{kind.name}.{field.name} has wire type {wire}")
                if field.kind == BOOL:
                    value = bool(value)
                elif field.kind == UINT32:
                    value &= _MAX_UINT32
            elif wire in (1, 5):
                size = 8 if wire == 1 else 4
                part = data[place : place + size]
                place += size
                if field is None:
                    continue
                if size != _FIXED[field.kind].itemsize:
                    raise WireError(f"{kind.name}.{field.name} has wire type {wire}")
                value = np.frombuffer(part, _FIXED[field.kind])[0].item()
            else:
                raise WireError(f"{kind.name}: wire type {wire}")
            if field.repeated:
                lists.setdefault(field.name, []).append(value)
            else:
                message[field.name] = value
        for field in kind.lists:
            message[field.name] = _joined(field, lists.get(field.name))
        return message

    def _part(self, field: Field, part: memoryview) -> Any:
        if field.kind == BYTES:
            return part
        if field.kind == STRING:
            return str(part, "utf-8")
        if field.kind == MESSAGE:
            return self._decode(self.types[field.message], part)
        if not field.repeated:
            raise WireError(f"{field.name} is a list, where one number should be")
        if field.kind == UINT32:
            return varints(part) & np.uint64(_MAX_UINT32)
        if field.kind in _VARINTS:
            return varints(part)
        return np.frombuffer(part, _FIXED[field.kind])


def _joined(field: Field, parts: list[Any] | None) -> Any:
    """A list's parts as one value: encoders may send a packed list in pieces, or number by number."""
    if field.kind in (STRING, BYTES, MESSAGE):
        return [] if parts is None else parts
    if parts is None:
        joined = np.zeros(0, _dtype(field))
    elif len(parts) == 1 and isinstance(parts[0], np.ndarray):
        joined = parts[0]
    else:
        joined = np.concatenate([np.atleast_1d(np.asarray(part, _dtype(field))) for part in parts])
    # A sample's messages are decoded once, for all readers.
    joined.setflags(write=False)
    return joined


def fields_of(data: memoryview) -> list[tuple[int, Any]]:
    """Field numbers and raw values of one message, without a schema: numbers, and slices."""
    found: list[tuple[int, Any]] = []
    place = 0
    while place < len(data):
        tag, place = varint(data, place)
        value: Any
        if tag & 7 == 2:
            length, place = varint(data, place)
            value = data[place : place + length]
            place += length
        elif tag & 7 == 0:
            value, place = varint(data, place)
        else:
            size = 8 if tag & 7 == 1 else 4
            value = data[place : place + size]
            place += size
        found.append((tag >> 3, value))
    return found


def find_bytes(data: memoryview, number: int, place: int = 0) -> tuple[memoryview, int]:
    """The ``bytes`` field of this number, by steps over the fields from offset ``place`` on, and the offset behind it; empty if
    it is absent.

    The hot path of batches: no other field is decoded.

    Raises ``WireError`` if the bytes are not a message.
    """
    try:
        found, behind = _find_bytes(data, number, place)
    except IndexError as error:
        raise WireError("a message ends within a field") from error
    if behind > len(data):
        raise WireError("a message ends within a field")
    return found, behind


def _find_bytes(data: memoryview, number: int, place: int) -> tuple[memoryview, int]:
    end = len(data)
    while place < end:
        tag = data[place]
        place += 1
        if tag >= 0x80:
            tag, place = varint(data, place - 1)
        wire = tag & 7
        if wire == 2:
            length = data[place]
            place += 1
            if length >= 0x80:
                length, place = varint(data, place - 1)
            if tag >> 3 == number:
                return data[place : place + length], place + length
            place += length
        elif wire == 0:
            while data[place] >= 0x80:
                place += 1
            place += 1
        elif wire == 1:
            place += 8
        elif wire == 5:
            place += 4
        else:
            raise WireError(f"wire type {wire}")
    return data[:0], place


def _children(data: memoryview, number: int) -> list[memoryview]:
    return [value for field, value in fields_of(data) if field == number]


def _text(data: memoryview, number: int) -> str:
    parts = _children(data, number)
    return str(parts[-1], "utf-8") if parts else ""


def _number(data: memoryview, number: int) -> int:
    return int(next((value for field, value in fields_of(data) if field == number), 0))
