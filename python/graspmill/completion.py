"""Samples of completion datasets: pairs of grids, further channels, and touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from .geometry import Camera, Floats, Grid, SampleId, bytes_of_cells, pack, pose, unpack
from .samples import Sample, as_array, content, expect_lengths
from .wire import WireError, find_bytes

Bits = npt.NDArray[np.uint8]
Cells = npt.NDArray[np.bool_]
Points = npt.NDArray[np.float32]

# Fields of VoxelPair and Visibility in proto/graspmill.proto: the hot path of batches skips all others.
_PARTIAL, _COMPLETE, _FREE = 7, 8, 3

TOUCH = ("touch_rays", "touch_exploration", "touch_grasp")
"""The channels of touch."""


@dataclass(frozen=True, eq=False)
class Pair:
    """A ``VoxelPair`` without its bits."""

    sample: SampleId
    grid: Grid
    camera: Camera
    camera_from_object: Floats
    """(4, 4)"""
    world_from_object: Floats
    """(4, 4)"""
    world_from_camera: Floats
    """(4, 4)"""
    partial_cells: int
    complete_cells: int
    both_cells: int
    solid_share: float
    """Share of the solid's volume inside the grid, 0 to 1."""


@dataclass(frozen=True, eq=False)
class Depth:
    """A crop of a depth image."""

    left: int
    """First column of the image in the crop, px."""
    top: int
    """First row of the image in the crop, px."""
    metres: Points
    """(height, width) m along the optical axis, NaN = no return."""

    @classmethod
    def of(cls, sample: Sample, channel: str) -> Depth:
        """From a ``Depth`` message."""
        message = sample.message(channel)
        shape = message["height"], message["width"]
        if message["step"] == 0.0:
            return cls(message["left"], message["top"], as_array(message["data"], "<f4", *shape))
        steps = as_array(message["data"], "<u2", *shape)
        metres = np.where(steps == 0, np.float32(np.nan), (steps * message["step"]).astype(np.float32))
        return cls(message["left"], message["top"], metres)


@dataclass(frozen=True, eq=False)
class Occlusion:
    """The occluder between the camera and the object."""

    kind: str
    """``none``, ``neighbour`` or ``half_space``."""
    object_pixels: int
    """Pixels of a perfect image that would see the object without the occluder."""
    hidden_pixels: int
    """Pixels of these that see the occluder instead."""
    corners: Points
    """(corners, 3) m in the camera's frame: the occluder is their convex hull."""
    left: int
    """First column of the image in the crop of the mask, px."""
    top: int
    """First row of the image in the crop of the mask, px."""
    mask: Cells
    """(height, width): pixels that see the occluder."""

    @property
    def hidden_share(self) -> float:
        """Share of the object's pixels that are hidden, 0 to 1."""
        return float(self.hidden_pixels / max(self.object_pixels, 1))


@dataclass(frozen=True, eq=False)
class Tsdf:
    """Truncated signed distances to the mesh at the cell centres, negative inside."""

    steps: npt.NDArray[np.int16]
    """(n, n, n), indexed (x, y, z): distance / truncation * 32767."""
    truncation: float
    """m"""

    @property
    def metres(self) -> Points:
        """(n, n, n) m."""
        return self.steps * np.float32(self.truncation / 32767.0)


@dataclass(frozen=True, eq=False)
class Implicit:
    """Points for implicit networks, in the camera's frame [m]."""

    surface_points: Points
    """(s, 3)"""
    surface_normals: Points
    """(s, 3), outward, unit length."""
    space_points: Points
    """(p, 3), in the grid's box."""
    space_distances: Points
    """(p,), negative inside."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Where the object was touched, in the camera's frame; one row per contact, in the order of the probes."""

    probes: int
    """Number of probes: rays, or approaches of a hand."""
    probe: npt.NDArray[np.uint64]
    """(contacts,) index of the probe that made each."""
    positions: Points
    """(contacts, 3) m"""
    normals: Points
    """(contacts, 3) outward, unit length."""
    distances: Points
    """(contacts,) m, distance that the probe moved."""
    visible: Cells
    """(contacts,) whether no surface is between it and the camera; in clutter, no surface of the whole scene."""
    cells: npt.NDArray[np.uint64]
    """(contacts,) cell (x n + y) n + z of the pair's grid; n^3: outside."""
    misses: Points
    """(probes that touched nothing and were not stopped, 3) m: where each started."""
    blocked_probe: npt.NDArray[np.uint64] = field(default_factory=lambda: np.zeros(0, np.uint64))
    """(blocked,) index of each probe that an obstacle stopped; empty for single objects, as all of ``blocked``."""
    blocked_by: Bits = field(default_factory=lambda: np.zeros(0, np.uint8))
    """(blocked,) obstacle: the number of a body from 1, 254 the container, 255 the table."""
    blocked_positions: Points = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    """(blocked, 3) m"""
    hand: str = ""
    """Name of the hand; empty for rays, as all attributes below."""
    links: list[str] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    link: npt.NDArray[np.uint64] = field(default_factory=lambda: np.zeros(0, np.uint64))
    """(contacts,) index into ``links``."""
    forces: Points = field(default_factory=lambda: np.zeros(0, np.float32))
    """(contacts,) N along the normal."""
    gaps: Points = field(default_factory=lambda: np.zeros(0, np.float32))
    """(contacts,) m from the mesh to the link, negative where it presses in."""
    camera_from_hand: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))
    """(approaches, 4, 4) pose of the hand's base at the end."""
    joint_values: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    """(approaches, joints) rad or m at the end."""
    ends: Bits = field(default_factory=lambda: np.zeros(0, np.uint8))
    """(approaches,) 0 at rest, 1 timed out, 2 missed, 3 unstable, 4 overloaded, 5 blocked."""

    @classmethod
    def of(cls, sample: Sample, channel: str) -> Contacts:
        """From a ``TactileContacts``, a ``HandContacts`` or a ``ClutterContacts`` message."""
        message = sample.message(channel)
        rays = {
            "probes": message["probes"],
            "probe": message["probe"],
            "positions": as_array(message["positions"], "<f4", -1, 3),
            "normals": as_array(message["normals"], "<f4", -1, 3),
            "distances": as_array(message["distances"], "<f4", -1),
            "visible": as_array(message["visible"], "u1", -1) == 1,
            "cells": message["cells"],
            "misses": as_array(message["misses"], "<f4", -1, 3),
        }
        count = len(message["probe"])
        rows = ("positions", "normals", "distances", "visible", "cells")
        expect_lengths(count, **{name: rays[name] for name in rows})
        if "blocked_probe" in message:
            rays["blocked_probe"] = message["blocked_probe"]
            rays["blocked_by"] = as_array(message["blocked_by"], "u1", -1)
            rays["blocked_positions"] = as_array(message["blocked_positions"], "<f4", -1, 3)
            blocked = {name: rays[name] for name in ("blocked_by", "blocked_positions")}
            expect_lengths(len(rays["blocked_probe"]), **blocked)
        if not message.get("hand"):
            return cls(**rays)
        poses = message["camera_from_hand"].reshape(-1, 12)
        forces, gaps = as_array(message["forces"], "<f4", -1), as_array(message["gaps"], "<f4", -1)
        expect_lengths(count, link=message["link"], forces=forces, gaps=gaps)
        expect_lengths(len(poses), ends=message["ends"])
        return cls(
            **rays,
            hand=message["hand"],
            links=message["links"],
            joints=message["joints"],
            link=message["link"],
            forces=forces,
            gaps=gaps,
            camera_from_hand=np.array([pose(rows) for rows in poses]).reshape(-1, 4, 4),
            joint_values=message["joint_values"].reshape(len(poses), len(message["joints"])),
            ends=as_array(message["ends"], "u1", -1),
        )


class CompletionSample(Sample):
    """A pair of grids and its further channels, in the camera's frame."""

    product = "completion"
    __slots__ = ()

    @content
    def pair(self) -> Pair:
        """Grid, camera, poses and counts."""
        message = self.message("pair")
        return Pair(
            sample=SampleId.of(message["sample"]),
            grid=Grid.of(message["grid"]),
            camera=Camera(**message["camera"]),
            camera_from_object=pose(message["camera_from_object"]),
            world_from_object=pose(message["world_from_object"]),
            world_from_camera=pose(message["world_from_camera"]),
            partial_cells=message["partial_cells"],
            complete_cells=message["complete_cells"],
            both_cells=message["both_cells"],
            solid_share=message["solid_share"],
        )

    @content
    def resolution(self) -> int:
        """Cells along each axis, n."""
        message = self.message("pair")
        n = int(message["grid"]["resolution"])
        expect_lengths(bytes_of_cells(n), partial=message["partial"], complete=message["complete"])
        return n

    @content
    def partial_bits(self) -> Bits:
        """Cells that hold a point the camera saw, packed: (ceil(n^3 / 8),)."""
        return np.frombuffer(_bits(self, "pair", _PARTIAL), np.uint8)

    @content
    def complete_bits(self) -> Bits:
        """Cells of the solid object, packed: (ceil(n^3 / 8),)."""
        return np.frombuffer(_bits(self, "pair", _COMPLETE), np.uint8)

    @content
    def partial(self) -> Cells:
        """Cells that hold a point the camera saw: (n, n, n), indexed (x, y, z)."""
        return unpack(self.partial_bits, self.resolution)

    @content
    def complete(self) -> Cells:
        """Cells of the solid object: (n, n, n), indexed (x, y, z)."""
        return unpack(self.complete_bits, self.resolution)

    @content
    def free_bits(self) -> Bits:
        """Cells that the camera saw to be free, packed (channel ``visibility``)."""
        return np.frombuffer(_bits(self, "visibility", _FREE), np.uint8)

    @content
    def free(self) -> Cells:
        """Cells that the camera saw to be free: (n, n, n) (channel ``visibility``)."""
        n = self.resolution
        expect_lengths(bytes_of_cells(n), free=self.free_bits)
        return unpack(self.free_bits, n)

    @content
    def depth(self) -> Depth:
        """The crop of the depth image."""
        return Depth.of(self, "depth")

    @content
    def cloud(self) -> Points:
        """The points that the camera saw, (points, 3) m."""
        return as_array(self.message("cloud")["points"], "<f4", -1, 3)

    @content
    def tsdf(self) -> Tsdf:
        """Truncated signed distances at the cell centres."""
        message = self.message("tsdf")
        n = message["resolution"]
        return Tsdf(as_array(message["values"], "<i2", n, n, n), message["truncation"])

    @content
    def coverage(self) -> Bits:
        """Share of each cell that is solid, times 255: (n, n, n)."""
        message = self.message("coverage")
        n = message["resolution"]
        return as_array(message["share"], "u1", n, n, n)

    @content
    def implicit(self) -> Implicit:
        """Points on and around the surface."""
        message = self.message("implicit")
        found = Implicit(
            surface_points=as_array(message["surface_points"], "<f4", -1, 3),
            surface_normals=as_array(message["surface_normals"], "<f4", -1, 3),
            space_points=as_array(message["space_points"], "<f4", -1, 3),
            space_distances=as_array(message["space_distances"], "<f4", -1),
        )
        expect_lengths(len(found.surface_points), surface_normals=found.surface_normals)
        expect_lengths(len(found.space_points), space_distances=found.space_distances)
        return found

    @content
    def occlusion(self) -> Occlusion:
        """The occluder between the camera and the object, and which pixels see it."""
        message = self.message("occlusion")
        height, width = int(message["height"]), int(message["width"])
        bits = np.frombuffer(message["mask"], np.uint8)
        if len(bits) != (height * width + 7) // 8:
            raise self.damaged(WireError(f"{len(bits)} bytes of mask for {height} x {width} pixels"))
        return Occlusion(
            kind=message["kind"],
            object_pixels=message["object_pixels"],
            hidden_pixels=message["hidden_pixels"],
            corners=as_array(message["corners"], "<f4", -1, 3),
            left=message["left"],
            top=message["top"],
            mask=np.unpackbits(bits, bitorder="little", count=height * width).reshape(height, width) == 1,
        )

    @content
    def touch(self) -> dict[str, Contacts]:
        """The contacts of each kind of touch that is stored, by channel."""
        return {channel: Contacts.of(self, channel) for channel in TOUCH if self.has(channel)}

    @content
    def tactile(self) -> Cells:
        """Cells with a contact of any kind of touch: (n, n, n)."""
        n = self.resolution
        cells = np.zeros(n**3 + 1, np.bool_)
        for channel in TOUCH:
            if self.has(channel):
                cells[self.message(channel)["cells"].astype(np.int64)] = True
        return cells[:-1].reshape(n, n, n)

    @content
    def seen_or_touched(self) -> Cells:
        """``partial | tactile``: a network's input."""
        return self.partial | self.tactile


@dataclass(frozen=True, eq=False)
class PairBatch:
    """Pairs of one resolution, packed: a tenth of the bytes on the way to a device."""

    resolution: int
    indices: npt.NDArray[np.int64]
    """(samples,) sample indices."""
    partial: Bits
    """(samples, ceil(n^3 / 8))"""
    complete: Bits
    """(samples, ceil(n^3 / 8))"""
    free: Bits | None = None
    """(samples, ceil(n^3 / 8)), where visibility is read."""
    tactile: Bits | None = None
    """(samples, ceil(n^3 / 8)), where touch is read."""

    def __len__(self) -> int:
        return len(self.indices)

    def cells(self, plane: str) -> Cells:
        """A plane (``partial``, ``complete``, ``free``, ``tactile``) as (samples, n, n, n)."""
        bits: Bits | None = getattr(self, plane)
        if bits is None:
            raise KeyError(f"no '{plane}' in this batch: its channel is not stored, or not read")
        return unpack(bits, self.resolution)

    @classmethod
    def of(cls, samples: Sequence[CompletionSample]) -> PairBatch:
        """Stacks samples, which must be of one resolution.

        Raises ``ValueError`` if they are not, or without any.
        """
        if not samples:
            raise ValueError("a batch of no samples")
        resolution = samples[0].resolution
        size = bytes_of_cells(resolution)
        parts: list[memoryview] = []
        place = samples[0].layout.places["pair"]
        for sample in samples:
            payload = sample.payloads[place]
            try:
                partial, at = find_bytes(payload, _PARTIAL)
                complete, _ = find_bytes(payload, _COMPLETE, at)
            except WireError as error:
                raise sample.damaged(error) from error
            if len(partial) != size or len(complete) != size:
                # Raises the error of the sample itself; otherwise it has another resolution.
                _ = sample.resolution
            parts += (partial, complete)
        planes = _planes(parts, size).reshape(len(samples), 2, size)
        free = tactile = None
        if samples[0].has("visibility"):
            found = [_bits(sample, "visibility", _FREE) for sample in samples]
            for sample, part in zip(samples, found):
                if len(part) != size:
                    _ = sample.free
            free = _planes(found, size)
        if any(samples[0].has(channel) for channel in TOUCH):
            tactile = np.stack([pack(sample.tactile) for sample in samples])
        indices = np.fromiter((sample.index for sample in samples), np.int64, len(samples))
        return cls(resolution, indices, planes[:, 0], planes[:, 1], free, tactile)


def _bits(sample: Sample, channel: str, number: int) -> memoryview:
    """The ``bytes`` field of this number of a message."""
    with sample.reading():
        return find_bytes(sample.payload(channel), number)[0]


def _planes(parts: list[memoryview], size: int) -> Bits:
    if any(len(part) != size for part in parts):
        raise ValueError("samples of different resolutions; batch them apart")
    return np.frombuffer(bytearray().join(parts), np.uint8).reshape(-1, size)
