"""One sample of any product: its payloads, decoded on demand."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from .errors import VERIFY, DamagedFile
from .geometry import SampleId
from .mcap import Channel
from .wire import Message, WireError

if TYPE_CHECKING:
    # In the standard library from 3.11 on; 3.10 needs it only for type checkers.
    from typing_extensions import Self

    content = property
else:

    class content(property):
        """A property that is read from stored messages: invalid content raises a ``DamagedFile``."""

        def __get__(self, sample: Any, owner: Any = None) -> Any:
            if sample is None:
                return self
            with sample.reading():
                return super().__get__(sample, owner)


class NotRead(KeyError):
    """A channel that is not stored, or not selected."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Layout that all samples of a dataset share: the channels that are read, by short name."""

    channels: dict[str, Channel]
    places: dict[str, int]
    """Index of each channel's payload in ``Sample.payloads``."""
    folder: Path
    """The dataset's."""


class Sample:
    """The payloads of one sample index, decoded channel by channel on demand.

    A channel is called by the last part of its topic: ``pair``, ``depth``, ``run``, ``patch``, ...
    """

    product: ClassVar[str] = ""

    __slots__ = ("_messages", "index", "layout", "payloads")

    def __init__(self, index: int, layout: Layout, payloads: list[memoryview]) -> None:
        self.index = index
        """The sample index."""
        self.layout = layout
        self.payloads = payloads
        self._messages: dict[str, Message] = {}

    def __getstate__(self) -> tuple[int, Layout, list[bytes]]:
        return self.index, self.layout, [bytes(payload) for payload in self.payloads]

    def __setstate__(self, state: tuple[int, Layout, list[bytes]]) -> None:
        self.index, self.layout = state[:2]
        self.payloads = [memoryview(payload) for payload in state[2]]
        self._messages = {}

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.index}: {', '.join(self.layout.places)}>"

    def copy(self) -> Self:
        """Copies the sample without a reference to its chunk, which may be much larger."""
        return type(self)(self.index, self.layout, [memoryview(bytes(payload)) for payload in self.payloads])

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Converts errors in a message's content to a ``DamagedFile`` that names the sample."""
        try:
            yield
        except NotRead:
            raise
        except (ValueError, TypeError, KeyError, IndexError, OverflowError) as error:
            raise self.damaged(error) from error

    def damaged(self, error: Exception) -> DamagedFile:
        """The error of a message with invalid content."""
        problem = f"sample {self.index}: a message is invalid ({error})"
        return DamagedFile(self.layout.folder, problem, VERIFY)

    def has(self, channel: str) -> bool:
        """Whether the dataset stores this channel, and the selection reads it."""
        return channel in self.layout.places

    def payload(self, channel: str) -> memoryview:
        """The message on a channel as it is stored; its BLAKE3 is in the index.

        Raises ``KeyError`` if the channel is not stored or not selected.
        """
        try:
            return self.payloads[self.layout.places[channel]]
        except KeyError:
            known = ", ".join(self.layout.places)
            raise NotRead(
                f"no channel '{channel}' is read, only {known}; the job or `channels=` leaves it out"
            ) from None

    def message(self, channel: str) -> Message:
        """The message on a channel, every field by its name in ``proto/``. It is decoded once and must not be changed.

        Raises ``DamagedFile`` if the payload is not a valid message.
        """
        if channel in self._messages:
            return self._messages[channel]
        kind = self.layout.channels[channel] if channel in self.layout.channels else None
        payload = self.payload(channel)
        assert kind is not None
        with self.reading():
            message = kind.schema.decode(kind.schema_name, payload)
        self._messages[channel] = message
        return message

    @content
    def id(self) -> SampleId:
        """The sample's name."""
        return SampleId.of(self.message(next(iter(self.layout.places)))["sample"])


def as_array(data: memoryview, kind: str, *shape: int) -> npt.NDArray[Any]:
    """The numbers of a ``bytes`` field, without a copy; not writable."""
    return np.frombuffer(data, kind).reshape(shape)


def expect_lengths(count: int, **columns: Any) -> None:
    """Raises ``WireError`` unless each of these, by name, has this number of rows."""
    for name, column in columns.items():
        if len(column) != count:
            raise WireError(f"{name} has {len(column)} rows, {count} are expected")
