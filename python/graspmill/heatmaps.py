"""Samples of heatmaps: grasps of all bodies of a settled scene, as one image of the scene shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .completion import Depth
from .geometry import Camera, Floats, pose, poses
from .patches import Heatmap
from .samples import Sample, as_array, content, expect_lengths

PICK_STATES = ("untried", "held", "failed")
"""States of a free grasp by trials among the neighbours, by the numbers of ``states``."""

Points = npt.NDArray[np.float32]
Counts = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


class HeatmapSample(Sample):
    """One image of a settled scene with the grasps that come from its camera's side. Bodies are numbered from 1, in the order of
    the scene; grasps are rows of arrays; points of a hand are the palm, then the fingertips."""

    product = "heatmaps"
    __slots__ = ()

    @content
    def camera(self) -> Camera:
        """The camera."""
        return Camera(**self.message("grasps")["camera"])

    @content
    def world_from_camera(self) -> Floats:
        """(4, 4) pose of the camera: z forward, y down."""
        return pose(self.message("grasps")["world_from_camera"])

    @content
    def depth(self) -> Points:
        """(height, width) m along the optical axis, exact up to the step in which it is stored, NaN = no return."""
        crop, camera = Depth.of(self, "depth"), self.camera
        whole = np.full((camera.height, camera.width), np.nan, np.float32)
        height, width = crop.metres.shape
        whole[crop.top : crop.top + height, crop.left : crop.left + width] = crop.metres
        return whole

    @content
    def hand(self) -> str:
        """Name of the hand."""
        return str(self.message("grasps")["hand"])

    @content
    def point_names(self) -> list[str]:
        """Names of the hand's points: ``approach``, the palm, then contacts."""
        return [str(name) for name in self.message("grasps")["names"]]

    @content
    def types(self) -> list[int]:
        """The chosen grasp types, the most common first; empty for a hand without types, whose grasps count as one type."""
        return [int(kind) for kind in self.message("grasps")["types"]]

    @content
    def label(self) -> str:
        """Meaning of ``values``: ``trial`` or ``free``."""
        return str(self.message("grasps")["label"])

    @content
    def angle(self) -> float:
        """Largest angle between approaches and the camera's axis [rad]."""
        return float(self.message("grasps")["angle"])

    @content
    def evaluated(self) -> Flags:
        """(bodies,) whether the dataset of picks has grasps of the body; grasps of other bodies are unknown, not background."""
        return as_array(self.message("grasps")["evaluated"], "u1", -1).astype(bool)

    @content
    def bodies(self) -> Counts:
        """(grasps,) number of the body. The rows are free grasps of the chosen types."""
        return np.asarray(self.message("grasps")["bodies"], np.int64)

    @content
    def candidates(self) -> Counts:
        """(grasps,) index among the candidates of the body's sample of picks."""
        return self._per_grasp("candidates")

    @content
    def runs(self) -> Counts:
        """(grasps,) number of the run of the stored grasp."""
        return self._per_grasp("runs")

    @content
    def ranks(self) -> Counts:
        """(grasps,) index of the stored grasp in its run."""
        return self._per_grasp("ranks")

    @content
    def directions(self) -> Counts:
        """(grasps,) number of its direction; 0 is the stored grasp."""
        return self._per_grasp("directions")

    @content
    def type_indices(self) -> Counts:
        """(grasps,) index of its type in ``types``; 0 for a hand without types."""
        return self._per_grasp("type_indices")

    @content
    def states(self) -> npt.NDArray[np.uint8]:
        """(grasps,) state by trials, an index into ``PICK_STATES``."""
        return as_array(self.message("grasps")["states"], "u1", len(self.bodies))

    @content
    def values(self) -> Points:
        """(grasps,) labels, lower is better; with labels of trials, 0 without a conclusive trial."""
        return as_array(self.message("grasps")["values"], "<f4", len(self.bodies))

    @content
    def world_from_base(self) -> Floats:
        """(grasps, 4, 4) poses of the hand's base where it closes."""
        found = poses(self.message("grasps")["world_from_base"])
        expect_lengths(len(self.bodies), world_from_base=found)
        return found

    @content
    def points(self) -> Floats:
        """(grasps, points, 3) m: palm and fingertips of the closed hand in the world."""
        points: Floats = self.message("grasps")["points"].reshape(len(self.bodies), len(self.point_names), 3)
        return points

    @content
    def pixels(self) -> Floats:
        """(grasps, points, 2) px: their projections, in the image or not; NaN if nearer than the camera's near limit."""
        pixels: Floats = self.message("grasps")["pixels"].reshape(len(self.bodies), len(self.point_names), 2)
        return pixels

    @content
    def in_image(self) -> Flags:
        """(grasps, points) whether the projection is in the image."""
        return self._inside(self.pixels)

    @content
    def surfaces(self) -> Points:
        """(grasps, points) m: depth of the image in the pixel of each point, NaN = no return, or outside the image."""
        return as_array(self.message("grasps")["surfaces"], "<f4", len(self.bodies), len(self.point_names))

    @content
    def visible(self) -> Flags:
        """(grasps, points) whether the point is in the image and nothing is in front of it."""
        return as_array(self.message("grasps")["visible"], "u1", len(self.bodies), len(self.point_names)).astype(bool)

    @content
    def heatmap(self) -> Heatmap:
        """The labels of all points in the image, entry by entry; ``heatmap.image()`` makes maps of them."""
        grasp, point = np.nonzero(self.in_image)
        unsigned = {
            name: getattr(self, name)[grasp].astype(np.uint64) for name in ("runs", "ranks", "type_indices")
        }
        return Heatmap(
            width=self.camera.width,
            height=self.camera.height,
            types=max(1, len(self.types)),
            points=point.astype(np.uint64),
            pixels=self.pixels[grasp, point],
            values=self.values[grasp],
            visible=self.visible[grasp, point],
            hand_points=len(self.point_names),
            **unsigned,
        )

    @content
    def side(self) -> int:
        """Side of each patch [px]."""
        return int(self.message("grasps")["side"])

    @content
    def size(self) -> float | None:
        """Side of the squares that patches in metres show [m]; None without such squares."""
        return float(self.message("grasps")["size"]) or None

    @content
    def patch_grasps(self) -> Counts:
        """(patches,) indices of the grasps with a patch around each of their points."""
        return np.asarray(self.message("grasps")["patches"], np.int64)

    @content
    def corners(self) -> Counts:
        """(patches, points, 2) px, left and top pixel of each patch."""
        corners = np.asarray(self.message("grasps")["corners"], np.int64)
        return corners.reshape(len(self.patch_grasps), len(self.point_names), 2)

    @content
    def windows(self) -> Counts:
        """(patches, points, 3) px, left and top pixel and side of the square of one size in metres around each point; needs
        ``patches.metric`` in the job."""
        message, shape = self.message("grasps"), (len(self.patch_grasps), len(self.point_names))
        corners = np.asarray(message["window_corners"], np.int64).reshape(*shape, 2)
        return np.concatenate([corners, np.asarray(message["windows"], np.int64).reshape(*shape, 1)], axis=-1)

    @content
    def patch_depth(self) -> Points:
        """(patches, points, side, side) m: squares of ``side`` pixels of the image."""
        along = np.arange(self.side)
        columns, rows = self.corners[..., 0, None] + along, self.corners[..., 1, None] + along
        return np.asarray(self.depth[rows[..., :, None], columns[..., None, :]])

    @content
    def metric_depth(self) -> Points:
        """(patches, points, side, side) m: squares of one size in metres, each pixel the one of the image at its middle."""
        left, top, window = np.moveaxis(self.windows, -1, 0)
        along = (2 * np.arange(self.side) + 1) * window[..., None] // (2 * self.side)
        columns, rows = left[..., None] + along, top[..., None] + along
        return np.asarray(self.depth[rows[..., :, None], columns[..., None, :]])

    @content
    def labels(self) -> Points:
        """(patches, points, points types): rows like those of ``PatchSample.labels``, 0 except at points type_index + point."""
        count, types = len(self.point_names), max(1, len(self.types))
        labels = np.zeros((len(self.patch_grasps), count, count * types), np.float32)
        place = np.arange(count)
        for row, grasp in enumerate(self.patch_grasps):
            labels[row, place, count * self.type_indices[grasp] + place] = self.values[grasp]
        return labels

    @content
    def tested(self) -> Flags:
        """(patches, points, points types): a mask for ``labels``, true where trials determine a number."""
        count, types = len(self.point_names), max(1, len(self.types))
        tested = np.zeros((len(self.patch_grasps), count, count * types), bool)
        place = np.arange(count)
        for row, grasp in enumerate(self.patch_grasps):
            tested[row, place, count * self.type_indices[grasp] + place] = self.states[grasp] != 0
        return tested

    @content
    def forbidden_bodies(self) -> Counts:
        """(forbidden,) number of the body of each grasp that is not free: background, wherever it is."""
        return np.asarray(self.message("grasps")["forbidden_bodies"], np.int64)

    @content
    def forbidden_candidates(self) -> Counts:
        """(forbidden,) index among the candidates of the body's sample of picks."""
        found = np.asarray(self.message("grasps")["forbidden_candidates"], np.int64)
        expect_lengths(len(self.forbidden_bodies), forbidden_candidates=found)
        return found

    @content
    def obstacles(self) -> npt.NDArray[np.uint8]:
        """(forbidden,) its obstacle, an index into ``PICK_OBSTACLES``."""
        return as_array(self.message("grasps")["obstacles"], "u1", len(self.forbidden_bodies))

    @content
    def forbidden_pixels(self) -> Floats:
        """(forbidden, 2) px: projection of its palm, in the image or not; NaN if nearer than the camera's near limit."""
        pixels: Floats = self.message("grasps")["forbidden_pixels"].reshape(len(self.forbidden_bodies), 2)
        return pixels

    @content
    def background(self) -> Flags:
        """(height, width) pixels that contain the palm of a forbidden grasp, and no palm of a free one: no trial is needed to
        know that no such grasp works."""
        camera = self.camera
        mask = np.zeros((camera.height, camera.width), bool)
        for pixels, value in ((self.forbidden_pixels, True), (self.pixels[:, 0], False)):
            column, row = np.floor(pixels[self._inside(pixels)]).astype(np.int64).T
            mask[row, column] = value
        return mask

    def _inside(self, pixels: Floats) -> Flags:
        camera = self.camera
        with np.errstate(invalid="ignore"):
            return np.asarray(((pixels >= 0) & (pixels < [camera.width, camera.height])).all(-1))

    def _per_grasp(self, name: str) -> npt.NDArray[Any]:
        found: npt.NDArray[Any] = np.asarray(self.message("grasps")[name], np.int64)
        expect_lengths(len(self.bodies), **{name: found})
        return found
