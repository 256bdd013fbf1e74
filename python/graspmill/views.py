"""Samples of views: images of settled scenes, with the silhouette of every body alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .completion import Depth
from .geometry import Camera, Floats, container_mesh, pose
from .samples import Sample, as_array, content, expect_lengths

BETWEEN = 253
"""Number of a measured depth between two bodies."""
CONTAINER = 254
"""Number of the container in a map of instances."""
TABLE = 255
"""Number of the table in a map of instances."""


class ViewSample(Sample):
    """A settled scene as one camera sees it. Bodies are numbered from 1 in maps, in the order of the arrays."""

    product = "views"
    __slots__ = ()

    @content
    def camera(self) -> Camera:
        """The camera."""
        return Camera(**self.message("image")["camera"])

    @content
    def world_from_camera(self) -> Floats:
        """(4, 4) pose of the camera: z forward, y down."""
        return pose(self.message("image")["world_from_camera"])

    @content
    def container(self) -> tuple[str, Floats]:
        """``("plane", [x, y])``, ``("bin", [x, y, z, wall])`` or ``("mesh", [x, y, z])``, with the inner sides [m]; last the
        tilt [degree] of a tilted bin or mesh, whose side at positive y is raised. The world's origin is the middle of the
        floor."""
        message = self.message("image")
        return str(message["container"]), message["container_size"]

    @content
    def container_mesh(self) -> tuple[Floats, npt.NDArray[np.uint32]] | None:
        """Vertices (n, 3) in the world [m] and triangles (m, 3) of a container that is a mesh; ``None`` for others."""
        return container_mesh(self.message("image"))

    @content
    def table_size(self) -> Floats:
        """(2,) m: sides of the table along x and y, below the plane or the bin."""
        sides: Floats = self.message("image")["table_size"]
        return sides

    @content
    def objects(self) -> list[str]:
        """Digest of each body's object, 64 hexadecimal digits, as in ``assets.json``."""
        digests = bytes(self.message("image")["objects"])
        return [digests[start : start + 32].hex() for start in range(0, len(digests), 32)]

    @content
    def world_from_object(self) -> Floats:
        """(bodies, 4, 4) poses."""
        rows: Floats = self.message("image")["world_from_object"].reshape(-1, 3, 4)
        expect_lengths(len(self.objects), world_from_object=rows)
        poses = np.tile(np.eye(4), (len(rows), 1, 1))
        poses[:, :3] = rows
        return poses

    @content
    def depth(self) -> npt.NDArray[np.float32]:
        """(height, width) m along the optical axis, NaN = no return; after the sensor."""
        crop, camera = Depth.of(self, "depth"), self.camera
        image = np.full((camera.height, camera.width), np.nan, np.float32)
        height, width = crop.metres.shape
        image[crop.top : crop.top + height, crop.left : crop.left + width] = crop.metres
        return image

    @content
    def colour(self) -> npt.NDArray[np.uint8]:
        """(height, width, 3) red, green, blue (channel ``colour``)."""
        return as_array(self.message("colour")["rgb"], "u1", self.camera.height, self.camera.width, 3)

    @content
    def instances(self) -> npt.NDArray[np.uint8]:
        """(height, width): what each pixel sees of the true scene: 0 nothing, from 1 a body, ``CONTAINER``, ``TABLE``."""
        return as_array(self.message("image")["instances"], "u1", self.camera.height, self.camera.width)

    @content
    def point_instances(self) -> npt.NDArray[np.uint8]:
        """(height, width): what each depth belongs to, as ``instances``; ``BETWEEN`` two bodies; 0 without a return. Without a
        sensor it is ``instances``."""
        stored = self.message("image")["point_instances"]
        if len(stored) == 0:
            return self.instances
        return as_array(stored, "u1", self.camera.height, self.camera.width)

    @content
    def pixels_all(self) -> npt.NDArray[np.uint32]:
        """(bodies,) pixels of each body's silhouette alone, including those outside the image."""
        return self._per_body("pixels_all")

    @content
    def pixels_in_image(self) -> npt.NDArray[np.uint32]:
        """(bodies,) pixels of each body's silhouette alone, in the image."""
        return self._per_body("pixels_in_image")

    @content
    def pixels_visible(self) -> npt.NDArray[np.uint32]:
        """(bodies,) pixels that see each body."""
        return self._per_body("pixels_visible")

    @content
    def pixels_too_near(self) -> npt.NDArray[np.uint32]:
        """(bodies,) pixels that see each body nearer than the sensor measures, and have no depth; zeros without a sensor."""
        return self._measured("pixels_too_near", np.uint32)

    @content
    def nearest_depths(self) -> npt.NDArray[np.float32]:
        """(bodies,) m: smallest true depth of the pixels that see each body; 0 for an unseen body, and without a sensor."""
        return self._measured("nearest_depths", np.float32)

    @content
    def visible_shares(self) -> Floats:
        """(bodies,) visible share of each silhouette; 0 for a silhouette without a pixel."""
        return self.pixels_visible / np.maximum(self.pixels_all, 1)

    @content
    def truncated(self) -> npt.NDArray[np.bool_]:
        """(bodies,) whether each body extends beyond the image."""
        return np.asarray(self.pixels_in_image < self.pixels_all)

    @content
    def whole_boxes(self) -> npt.NDArray[np.int32]:
        """(bodies, 4) left, top, width, height of each whole silhouette; may extend beyond the image [px]."""
        return as_array(self.message("image")["whole_boxes"], "<i4", len(self.objects), 4)

    @content
    def visible_boxes(self) -> npt.NDArray[np.uint32]:
        """(bodies, 4) left, top, width, height of the pixels that see each body [px]."""
        return self._boxes("visible_boxes")

    def visible_mask(self, body: int) -> npt.NDArray[np.bool_]:
        """(height, width) pixels that see a body, from 1."""
        self._expect_body(body)
        return np.asarray(self.instances == body)

    def mask(self, body: int) -> npt.NDArray[np.bool_]:
        """(height, width) silhouette of a body alone, from 1, regardless of what is in front of it."""
        self._expect_body(body)
        boxes = self._boxes("mask_boxes").astype(np.int64)
        lengths = (boxes[:, 2] * boxes[:, 3] + 7) // 8
        first = int(lengths[: body - 1].sum())
        left, top, width, height = boxes[body - 1]
        own = np.frombuffer(bytes(self.message("image")["masks"]), np.uint8)[first : first + int(lengths[body - 1])]
        bits = np.unpackbits(own, bitorder="little")[: width * height].reshape(height, width)
        image = np.zeros((self.camera.height, self.camera.width), np.bool_)
        image[top : top + height, left : left + width] = bits
        return image

    def points(self, body: int) -> Floats:
        """(n, 3) points of a body, from 1, that were measured, in the camera's frame [m]."""
        self._expect_body(body)
        return self.points_of(self.point_instances == body)

    def points_of(self, mask: npt.NDArray[np.bool_]) -> Floats:
        """(n, 3) points that were measured in the pixels of a mask (height, width), in the camera's frame [m]."""
        camera = self.camera
        seen = mask & ~np.isnan(self.depth)
        rows, columns = np.nonzero(seen)
        depth = self.depth[seen].astype(np.float64)
        return np.stack(
            [(columns + 0.5 - camera.cx) / camera.fx * depth, (rows + 0.5 - camera.cy) / camera.fy * depth, depth], axis=1
        )

    def _expect_body(self, body: int) -> None:
        if not 1 <= body <= len(self.objects):
            raise IndexError(f"body {body} of {len(self.objects)}: bodies are numbered from 1")

    def _per_body(self, name: str) -> npt.NDArray[np.uint32]:
        found: npt.NDArray[np.uint32] = np.asarray(self.message("image")[name], np.uint32)
        expect_lengths(len(self.objects), **{name: found})
        return found

    def _measured(self, name: str, kind: Any) -> npt.NDArray[Any]:
        """A number per body of views with a sensor; zeros without a sensor."""
        stored: npt.NDArray[Any] = np.asarray(self.message("image")[name], kind)
        if len(self.message("image")["point_instances"]) == 0:
            return np.zeros(len(self.objects), kind)
        expect_lengths(len(self.objects), **{name: stored})
        return stored

    def _boxes(self, name: str) -> npt.NDArray[np.uint32]:
        found = np.asarray(self.message("image")[name], np.uint32).reshape(-1, 4)
        expect_lengths(len(self.objects), **{name: found})
        return found
