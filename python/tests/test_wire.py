"""Every message of every product, field by field, against the official MCAP and protobuf packages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import FOLDERS
from google.protobuf.message import Message as Protobuf
from graspmill.mcap import McapFile
from graspmill.wire import Schema, WireError, varints
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def assert_equal(found: Any, expected: Any, where: str) -> None:
    if isinstance(expected, Protobuf):
        present = {field.name for field, _ in expected.ListFields()}
        assert set(found) == {field.name for field in expected.DESCRIPTOR.fields}, where
        for name, value in found.items():
            if value is None:
                assert name not in present, f"{where}.{name}"
            else:
                assert_equal(value, getattr(expected, name), f"{where}.{name}")
    elif isinstance(expected, (str, bool, bytes)):
        assert found == expected and type(found) is not int, where
    elif isinstance(expected, (int, float)):
        assert np.array_equal(found, expected, equal_nan=isinstance(expected, float)), where
    elif isinstance(found, np.ndarray):
        assert np.array_equal(found, np.array(list(expected), found.dtype), equal_nan=found.dtype.kind == "f"), where
    else:
        assert len(found) == len(expected), where
        for place, (one, other) in enumerate(zip(found, expected)):
            assert_equal(one, other, f"{where}[{place}]")


@pytest.mark.parametrize("name", FOLDERS)
def test_messages_are_what_the_official_packages_read(data: Path, name: str) -> None:
    paths = [*sorted((data / name / "shards").glob("*.mcap")), *(data / name).glob("field.mcap")]
    paths += list((data / name).glob("shapes.mcap"))
    kinds = set()
    for path in paths:
        ours = McapFile(path)
        found = [message for chunk in range(len(ours.offsets)) for message in ours.messages(ours.chunk(chunk))]
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            theirs = list(reader.iter_decoded_messages(log_time_order=False))
            attachments = {each.name: bytes(each.data) for each in reader.iter_attachments()}
        assert {each.name: bytes(each.data) for each in ours.attachments()} == attachments
        assert len(found) == len(theirs) > 0
        for (number, time, payload), (schema, channel, message, record) in zip(found, theirs):
            own = ours.channels[number]
            assert schema is not None
            assert (own.topic, own.schema_name, time) == (channel.topic, schema.name, message.log_time)
            assert payload == message.data
            if time % 7 == 0 or channel.topic not in kinds:
                kinds.add(channel.topic)
                assert_equal(own.schema.decode(own.schema_name, payload), record, channel.topic)
    assert kinds


def test_packed_numbers_of_every_length() -> None:
    numbers = [0, 1, 127, 128, 300, 2**14, 2**21 - 1, 2**32, 2**63, 2**64 - 1]
    data = bytearray()
    for number in numbers:
        while number >= 0x80:
            data.append(number & 0x7F | 0x80)
            number >>= 7
        data.append(number)
    assert varints(memoryview(data)).tolist() == numbers
    with pytest.raises(WireError):
        varints(memoryview(b"\x80"))


def test_cut_messages_are_refused(data: Path) -> None:
    file = McapFile(next((data / "set/grasps" / "shards").glob("*.mcap")))
    number, _, payload = next(iter(file.messages(file.chunk(0))))
    channel = file.channels[number]
    refused = 0
    for end in range(1, len(payload), 97):
        try:
            channel.schema.decode(channel.schema_name, payload[:end])
        except WireError:
            refused += 1
    # A cut between two fields is a message, too.
    assert refused > 0.8 * len(range(1, len(payload), 97))
    with pytest.raises(WireError):
        Schema(b"").decode("graspmill.VoxelPair", payload)


def message_of(*fields: bytes) -> memoryview:
    return memoryview(b"".join(fields))


def test_numbers_are_of_their_field_and_no_longer(data: Path) -> None:
    """Only the lower bits of a number count, by its type; a field of another kind than in the schema is refused."""
    file = McapFile(next((data / "pairs" / "shards").glob("*.mcap")))
    schema = next(channel.schema for channel in file.channels.values() if channel.topic == "/completion/pair")
    grid = lambda *fields: schema.decode("graspmill.Grid", message_of(*fields))  # noqa: E731
    assert grid(b"\x08\x85\x80\x80\x80\x10")["resolution"] == 5
    for wrong in (b"\x10\x01", b"\x0a\x01\x05", b"\x15\x00\x00\x00\x00", b"\x09" + bytes(8), b"\x08"):
        with pytest.raises(WireError):
            grid(wrong)
