"""Samples of volumes: truncated signed distances fused from images of settled scenes, with the body of each voxel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .geometry import Camera, Floats, pose, poses
from .samples import Sample, as_array, content, expect_lengths
from .views import CONTAINER, TABLE


@dataclass(frozen=True, eq=False)
class Affordance:
    """Grasps of a scene over the voxels of a volume. Arrays are (n, n, n, ...), indexed (x, y, z)."""

    quality: npt.NDArray[np.float32]
    """(n, n, n) 1 if a grasp with its centre in the voxel held, 0 if all tried grasps failed; NaN if none was tried."""
    rotation: npt.NDArray[np.float32]
    """(n, n, n, 4) rotation of that grasp as x, y, z, w: x closing, z approach, in the volume's frame; NaN without a grasp."""
    width: npt.NDArray[np.float32]
    """(n, n, n) m: width of that grasp; NaN without a grasp."""
    count: npt.NDArray[np.uint32]
    """(n, n, n) free grasps with their centre in the voxel."""
    known: npt.NDArray[np.bool_]
    """(n, n, n) whether one of them was tried. Without a trial nothing is known: such a voxel is not a negative."""


class VolumeSample(Sample):
    """One fusion of some images of a settled scene. Arrays over voxels are (n, n, n), indexed (x, y, z) in the volume's frame,
    whose origin is a corner of the cube and whose z points up."""

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
        """Distance at which values are truncated [m]."""
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
        """(images,) index of the camera of the views that made each."""
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
        found = poses(self.message("fusion")["world_from_camera"])
        expect_lengths(len(self.views), world_from_camera=found)
        return found

    @content
    def steps(self) -> npt.NDArray[np.int16]:
        """(n, n, n) mean signed distance / truncation * 32767, as stored: positive in front of the observed surface; 0 where
        ``weights`` is 0."""
        return as_array(self.message("fusion")["values"], "<i2", *3 * [self.resolution])

    @content
    def tsdf(self) -> npt.NDArray[np.float32]:
        """(n, n, n) mean signed distance in units of the truncation, -1 to 1."""
        return np.asarray(self.steps * np.float32(1 / 32767.0))

    @content
    def weights(self) -> npt.NDArray[np.uint8]:
        """(n, n, n) number of images averaged in each distance; 0: not observed."""
        return as_array(self.message("fusion")["weights"], "u1", *3 * [self.resolution])

    @content
    def instances(self) -> npt.NDArray[np.uint8]:
        """(n, n, n) what is at each centre: 0 free, from 1 inside a body, ``CONTAINER``, or ``TABLE``: below the table."""
        return as_array(self.message("truth")["instances"], "u1", *3 * [self.resolution])

    @content
    def occupied(self) -> npt.NDArray[np.bool_]:
        """(n, n, n) whether each centre is inside a body; the container is not a body."""
        return np.asarray((self.instances > 0) & (self.instances < CONTAINER) & (self.instances < TABLE))

    @content
    def objects(self) -> list[str]:
        """Digest of each body's object, 64 hexadecimal digits, as in ``assets.json``."""
        digests = bytes(self.message("truth")["objects"])
        return [digests[start : start + 32].hex() for start in range(0, len(digests), 32)]

    @content
    def world_from_object(self) -> Floats:
        """(bodies, 4, 4) poses."""
        found = poses(self.message("truth")["world_from_object"])
        expect_lengths(len(self.objects), world_from_object=found)
        return found

    @content
    def centres(self) -> npt.NDArray[np.float32]:
        """(n, n, n, 3) m: centre of each voxel in the volume's frame."""
        along = (np.arange(self.resolution) + 0.5) * self.voxel
        return np.stack(np.meshgrid(along, along, along, indexing="ij"), -1).astype(np.float32)

    @content
    def grasp_bodies(self) -> npt.NDArray[np.int64]:
        """(grasps,) number of the body of each free grasp with its centre in the cube, from 1 (channel ``affordance``)."""
        return np.asarray(self.message("affordance")["bodies"], np.int64)

    @content
    def grasp_candidates(self) -> npt.NDArray[np.int64]:
        """(grasps,) index among the candidates of the body's sample of picks."""
        found = np.asarray(self.message("affordance")["candidates"], np.int64)
        expect_lengths(len(self.grasp_bodies), candidates=found)
        return found

    @content
    def grasp_voxels(self) -> npt.NDArray[np.int64]:
        """(grasps, 3) the voxel that contains each centre, as an index of the arrays over voxels."""
        voxels = np.asarray(self.message("affordance")["voxels"], np.int64)
        expect_lengths(len(self.grasp_bodies), voxels=voxels)
        return np.stack(np.unravel_index(voxels, 3 * [self.resolution]), -1)

    @content
    def grasp_states(self) -> npt.NDArray[np.uint8]:
        """(grasps,) state by trials, an index into ``PICK_STATES``."""
        return as_array(self.message("affordance")["states"], "u1", len(self.grasp_bodies))

    @content
    def grasp_centres(self) -> Floats:
        """(grasps, 3) m in the volume's frame: middle between the pads of a closed gripper."""
        centres: Floats = self.message("affordance")["centres"].reshape(len(self.grasp_bodies), 3)
        return centres

    @content
    def grasp_rotations(self) -> Floats:
        """(grasps, 4) x, y, z, w in the volume's frame: x closing, z approach."""
        rotations: Floats = self.message("affordance")["rotations"].reshape(len(self.grasp_bodies), 4)
        return rotations

    @content
    def grasp_widths(self) -> Floats:
        """(grasps,) m between the pads of the closed hand; 0 for a hand without a width."""
        widths: Floats = self.message("affordance")["widths"]
        expect_lengths(len(self.grasp_bodies), widths=widths)
        return widths

    @content
    def forbidden(self) -> npt.NDArray[np.int64]:
        """(4,) number of grasps of the scene that collide with ground, container, own object and neighbour."""
        return np.asarray(self.message("affordance")["forbidden"], np.int64)

    @content
    def affordance(self) -> Affordance:
        """Grasps over the voxels (channel ``affordance``): the best of several in one voxel counts, the first of equals."""
        n = self.resolution
        quality = np.full((n, n, n), np.nan, np.float32)
        rotation, width = np.full((n, n, n, 4), np.nan, np.float32), np.full((n, n, n), np.nan, np.float32)
        count = np.zeros((n, n, n), np.uint32)
        rows = zip(self.grasp_voxels.tolist(), self.grasp_states.tolist())
        for row, (voxel, state) in enumerate(rows):
            place = (voxel[0], voxel[1], voxel[2])
            count[place] += 1
            held = float(state == 1)
            if state and not quality[place] >= held:
                quality[place], rotation[place], width[place] = held, self.grasp_rotations[row], self.grasp_widths[row]
        return Affordance(quality, rotation, width, count, ~np.isnan(quality))
