"""One sample of any product: its payloads, and what they mean once they are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from .geometry import SampleId
from .mcap import Channel
from .wire import Message

if TYPE_CHECKING:
    # Of the standard library from 3.11 on; 3.10 needs it for type checkers alone.
    from typing_extensions import Self


@dataclass(frozen=True, eq=False)
class Layout:
    """Layout that all samples of a dataset share: the channels that are read, by short name."""

    channels: dict[str, Channel]
    places: dict[str, int]
    """Place of each channel's payload in ``Sample.payloads``."""


class Sample:
    """The payloads of one sample index, decoded channel by channel when they are asked for.

    A channel is called by the last part of its topic: ``pair``, ``depth``, ``run``, ``patch``, ...
    """

    product: ClassVar[str] = ""

    __slots__ = ("index", "layout", "payloads")

    def __init__(self, index: int, layout: Layout, payloads: list[memoryview]) -> None:
        self.index = index
        """The sample index."""
        self.layout = layout
        self.payloads = payloads

    def __getstate__(self) -> tuple[int, Layout, list[bytes]]:
        return self.index, self.layout, [bytes(payload) for payload in self.payloads]

    def __setstate__(self, state: tuple[int, Layout, list[bytes]]) -> None:
        self.index, self.layout = state[:2]
        self.payloads = [memoryview(payload) for payload in state[2]]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.index}: {', '.join(self.layout.places)}>"

    def copy(self) -> Self:
        """Copies the sample without ties to the chunk that it came from, which may be much larger."""
        return type(self)(self.index, self.layout, [memoryview(bytes(payload)) for payload in self.payloads])

    def has(self, channel: str) -> bool:
        """Whether the dataset stores this channel, and the selection reads it."""
        return channel in self.layout.places

    def payload(self, channel: str) -> memoryview:
        """The message on a channel as it is stored; its BLAKE3 stands in the index.

        Raises ``KeyError`` where the channel is not stored or not selected.
        """
        try:
            return self.payloads[self.layout.places[channel]]
        except KeyError:
            known = ", ".join(self.layout.places)
            raise KeyError(
                f"no channel '{channel}' is read here, only {known}; the job or `channels=` leaves it out"
            ) from None

    def message(self, channel: str) -> Message:
        """The message on a channel, every field by its name in ``proto/``."""
        kind = self.layout.channels[channel] if channel in self.layout.channels else None
        payload = self.payload(channel)
        assert kind is not None
        return kind.schema.decode(kind.schema_name, payload)

    @property
    def id(self) -> SampleId:
        """The sample's name."""
        return SampleId.of(self.message(next(iter(self.layout.places)))["sample"])


def as_array(data: memoryview, kind: str, *shape: int) -> npt.NDArray[Any]:
    """The numbers of a ``bytes`` field, without a copy; not writable."""
    return np.frombuffer(data, kind).reshape(shape)
