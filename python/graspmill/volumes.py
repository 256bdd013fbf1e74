"""Samples of volumes: truncated signed distances fused from images of settled scenes, with the body that each voxel is in."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .geometry import Camera, Floats, pose
from .samples import Sample, as_array, content, expect_lengths
from .views import CONTAINER, TABLE


def _poses(rows: Floats) -> Floats:
    """(k, 4, 4) poses, out of twelve stored numbers each."""
    rows = rows.reshape(-1, 3, 4)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = rows
    return poses


class VolumeSample(Sample):
    """One fusion of some images of a settled scene. Arrays over voxels are (n, n, n), indexed (x, y, z) in the volume's frame, whose
    origin is a corner of the cube and whose z points up."""

    product = "volumes"
    __slots__ = ()

    @content
    def resolution(self) -> int:
        """Voxels along each edge of the cube."""
        return int(self.message("fusion")["resolution"])

    @content
    def size(self) -> float:
        """Edge of the cube [m]."""
        return float(self.message("fusion")["size"])

    @content
    def truncation(self) -> float:
        """Distances are cut at this [m]."""
        return float(self.message("fusion")["truncation"])

    @property
    def voxel(self) -> float:
        """Edge of a voxel [m]."""
        return self.size / self.resolution

    @content
    def world_from_volume(self) -> Floats:
        """(4, 4) pose of the cube in the scene."""
        return pose(self.message("fusion")["world_from_volume"])

    @content
    def views(self) -> npt.NDArray[np.uint64]:
        """(images,) number of each fused view of the scene, ascending."""
        views: npt.NDArray[np.uint64] = self.message("fusion")["views"]
        return views

    @content
    def cameras(self) -> npt.NDArray[np.uint64]:
        """(images,) entry of the views' cameras that made each."""
        cameras: npt.NDArray[np.uint64] = self.message("fusion")["cameras"]
        expect_lengths(len(self.views), cameras=cameras)
        return cameras

    @content
    def intrinsics(self) -> list[Camera]:
        """Camera of each image."""
        cameras = [Camera(**camera) for camera in self.message("fusion")["intrinsics"]]
        expect_lengths(len(self.views), intrinsics=cameras)
        return cameras

    @content
    def world_from_camera(self) -> Floats:
        """(images, 4, 4) poses: z forward, y down."""
        poses = _poses(self.message("fusion")["world_from_camera"])
        expect_lengths(len(self.views), world_from_camera=poses)
        return poses

    @content
    def steps(self) -> npt.NDArray[np.int16]:
        """(n, n, n) mean signed distance / truncation * 32767, as stored: positive in front of what is seen; 0 where ``weights``
        is."""
        return as_array(self.message("fusion")["values"], "<i2", *3 * [self.resolution])

    @content
    def tsdf(self) -> npt.NDArray[np.float32]:
        """(n, n, n) mean signed distance in units of the truncation, -1 to 1."""
        return np.asarray(self.steps * np.float32(1 / 32767.0))

    @content
    def weights(self) -> npt.NDArray[np.uint8]:
        """(n, n, n) images that each distance is the mean of; 0: no image says anything."""
        return as_array(self.message("fusion")["weights"], "u1", *3 * [self.resolution])

    @content
    def instances(self) -> npt.NDArray[np.uint8]:
        """(n, n, n) what is at each centre: 0 free, from 1 inside a body, ``CONTAINER``, or ``TABLE``: below the table."""
        return as_array(self.message("truth")["instances"], "u1", *3 * [self.resolution])

    @content
    def occupied(self) -> npt.NDArray[np.bool_]:
        """(n, n, n) whether each centre is inside a body; the container is none."""
        return np.asarray((self.instances > 0) & (self.instances < CONTAINER) & (self.instances < TABLE))

    @content
    def objects(self) -> list[str]:
        """Digest of each body's object, 64 hexadecimal digits, as in ``assets.json``."""
        digests = bytes(self.message("truth")["objects"])
        return [digests[start : start + 32].hex() for start in range(0, len(digests), 32)]

    @content
    def world_from_object(self) -> Floats:
        """(bodies, 4, 4) poses."""
        poses = _poses(self.message("truth")["world_from_object"])
        expect_lengths(len(self.objects), world_from_object=poses)
        return poses

    @content
    def centres(self) -> npt.NDArray[np.float32]:
        """(n, n, n, 3) m: centre of each voxel in the volume's frame."""
        along = (np.arange(self.resolution) + 0.5) * self.voxel
        return np.stack(np.meshgrid(along, along, along, indexing="ij"), -1).astype(np.float32)
