"""Samples of patch datasets: what a camera sees around palm and fingertips of one grasp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .completion import Depth
from .geometry import Camera, Floats, pose
from .samples import Sample, as_array, content, expect_lengths
from .wire import Message

Bytes = npt.NDArray[np.uint8]
Points = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class ImageColour:
    """A colour image of which a box is stored; outside of it all is ``background``."""

    left: int
    """px"""
    top: int
    """px"""
    rgb: Bytes
    """(height, width, 3) of the box."""
    background: Bytes
    """(3,)"""

    def whole(self, camera: Camera) -> Bytes:
        """The whole image, (height, width, 3)."""
        image = np.empty((camera.height, camera.width, 3), np.uint8)
        image[:] = self.background
        height, width = self.rgb.shape[:2]
        image[self.top : self.top + height, self.left : self.left + width] = self.rgb
        return image


@dataclass(frozen=True, eq=False)
class Heatmap:
    """The truth for heatmaps over a whole image: where palm and fingertips of grasps would be, and how good each is."""

    width: int
    """px"""
    height: int
    """px"""
    types: int
    """Count of chosen types."""
    runs: npt.NDArray[np.uint64]
    """(entries,) with ``ranks`` the grasp in the dataset of grasps."""
    ranks: npt.NDArray[np.uint64]
    type_indices: npt.NDArray[np.uint64]
    """(entries,) indices into the chosen types."""
    points: npt.NDArray[np.uint64]
    """(entries,) 0 palm, 1 to 3 the fingertips."""
    pixels: Floats
    """(entries, 2) px"""
    values: Points
    """(entries,) labels of the grasps, lower is better; 0 if trials do not decide."""
    visible: npt.NDArray[np.bool_] | None = None
    """(entries,) whether nothing in the image hides the point; None if the dataset marks none."""
    hand_points: int = 4
    """Count of the points of a hand."""

    def image(self, visible: bool = False) -> Points:
        """(hand_points types, height, width): the lowest label of a pixel, channel hand_points type_index + point; NaN where no
        label is known.

        Pixels with NaN are untested, not bad. ``visible`` omits points that the surface hides.
        """
        image = np.full((self.hand_points * self.types, self.height, self.width), np.inf, np.float32)
        column, row = np.floor(self.pixels).astype(np.int64).T
        channel = (self.hand_points * self.type_indices + self.points).astype(np.int64)
        inside = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height) & (self.values != 0)
        if visible:
            if self.visible is None:
                raise KeyError("the dataset marks no visible points (patches.visibility)")
            inside &= self.visible
        np.minimum.at(image, (channel[inside], row[inside], column[inside]), self.values[inside])
        return np.where(np.isinf(image), np.float32(np.nan), image)


class PatchSample(Sample):
    """Four patches (palm, F0, F1, F2) of one view of one grasp, and their labels."""

    product = "patches"
    __slots__ = ()

    @content
    def patch(self) -> Message:
        """Every field of ``HeatmapPatch`` by name; poses as twelve numbers."""
        return self.message("patch")

    @content
    def camera(self) -> Camera:
        """The camera."""
        return Camera(**self.patch["camera"])

    @content
    def camera_from_object(self) -> Floats:
        """(4, 4)"""
        return pose(self.patch["camera_from_object"])

    @content
    def object_from_approach(self) -> Floats:
        """(4, 4) of the grasp, before closing."""
        return pose(self.patch["object_from_approach"])

    @content
    def depth(self) -> Points:
        """(4, side, side) m along the optical axis, NaN = no return."""
        patch = self.patch
        return as_array(patch["depth"], "<f4", 4, patch["side"], patch["side"])

    @content
    def rgb(self) -> Bytes:
        """(4, side, side, 3) red, green, blue (channel ``colour``)."""
        message = self.message("colour")
        return as_array(message["rgb"], "u1", 4, message["side"], message["side"], 3)

    @content
    def rgbd(self) -> Points:
        """(4, side, side, 4): red, green, blue from 0 to 1, and depth in metres, NaN = no return."""
        return np.concatenate([self.rgb / np.float32(255.0), self.depth[..., None]], axis=-1)

    @content
    def labels(self) -> Points:
        """(4, 4 types): row k is 0 except at 4 type_index + k, which has the grasp's label; lower is better."""
        return as_array(self.patch["labels"], "<f4", 4, -1)

    @content
    def type_index(self) -> int:
        """The grasp's type, an index into ``types``."""
        return int(self.patch["type_index"])

    @content
    def types(self) -> list[int]:
        """The chosen types, the most common first."""
        return [int(kind) for kind in self.patch["types"]]

    @content
    def corners(self) -> npt.NDArray[np.int64]:
        """(4, 2) px, left and top pixel of each patch."""
        corners: npt.NDArray[np.int64] = self.patch["corners"].astype(np.int64).reshape(4, 2)
        return corners

    @content
    def pixels(self) -> Floats:
        """(4, 2) px, projections of palm and fingertips."""
        pixels: Floats = self.patch["pixels"].reshape(4, 2)
        return pixels

    @content
    def image(self) -> Depth:
        """The box of the depth image that contains the object (channel ``image``)."""
        return Depth.of(self, "image")

    @content
    def image_colour(self) -> ImageColour:
        """Box of the image in colour (channel ``image_colour``)."""
        message = self.message("image_colour")
        rgb = as_array(message["rgb"], "u1", message["height"], message["width"], 3)
        return ImageColour(message["left"], message["top"], rgb, as_array(message["background"], "u1", 3))

    @content
    def heatmap(self) -> Heatmap:
        """The labels of all grasps from the camera's side (channel ``heatmap``)."""
        message = self.message("heatmap")
        lists = {name: message[name] for name in ("runs", "ranks", "type_indices", "points")}
        lists |= {"pixels": message["pixels"].reshape(-1, 2), "values": as_array(message["values"], "<f4", -1)}
        if self.has("visibility"):
            lists["visible"] = as_array(self.message("visibility")["heatmap_visible"], "u1", -1).astype(bool)
        expect_lengths(len(message["runs"]), **lists)
        return Heatmap(width=message["width"], height=message["height"], types=message["types"], **lists)

    @content
    def trial(self) -> Message:
        """Every field of ``PatchTrial`` by name (channel ``trial``): ``outcome``, ``trial`` and ``verdict`` are words."""
        return self.message("trial")

    @content
    def outcome(self) -> str:
        """The combined label of all trials of the grasp: held, failed, borderline, unconfirmed or untested (channel
        ``trial``)."""
        return str(self.trial["outcome"])

    @content
    def tested(self) -> npt.NDArray[np.bool_]:
        """(4, 4 types): a mask for ``labels``, true where trials determine a number (channel ``trial``)."""
        return as_array(self.trial["tested"], "u1", 4, -1).astype(bool)

    @content
    def visible(self) -> npt.NDArray[np.bool_]:
        """(4,) whether nothing in the image hides the point (channel ``visibility``)."""
        return as_array(self.message("visibility")["visible"], "u1", 4).astype(bool)

    @content
    def surfaces(self) -> Points:
        """(4,) m, depth of the image in the pixel of each point, NaN = no return (channel ``visibility``)."""
        return as_array(self.message("visibility")["surfaces"], "<f4", 4)

    @content
    def metric_depth(self) -> Points:
        """(4, side, side) m, depth in squares of one size in metres around the points, NaN = no return (channel ``metric``)."""
        message = self.message("metric")
        return as_array(message["depth"], "<f4", 4, message["side"], message["side"])

    @content
    def metric_rgb(self) -> Bytes:
        """(4, side, side, 3) red, green, blue of these squares (channel ``metric_colour``)."""
        message = self.message("metric_colour")
        return as_array(message["rgb"], "u1", 4, message["side"], message["side"], 3)

    @content
    def windows(self) -> npt.NDArray[np.int64]:
        """(4, 3) px, left and top pixel and side of each square in the image (channel ``metric``)."""
        message = self.message("metric")
        corners = message["corners"].astype(np.int64).reshape(4, 2)
        return np.column_stack([corners, message["windows"].astype(np.int64)])

    @content
    def camera_from_table(self) -> Floats:
        """(4, 4) of the table under the object, whose top is the plane z = 0 (channel ``table``)."""
        return pose(self.message("table")["camera_from_table"])
