"""A reachability map: labels and signed distances of a grid of end-effector poses, and values between its cells.

Computes the values of ``graspmill query reach`` and the Rust runtime, vectorised over poses, equal within 1e-6.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .dataset import Dataset
from .errors import VERIFY, DamagedFile, UnfinishedDataset
from .geometry import Floats
from .healpix import DirectionMesh, angles
from .mcap import McapFile
from .reachability import LABELS, ReachabilitySample
from .wire import WireError

Ints = npt.NDArray[np.int64]

_AT_A_TIME = 8192


@dataclass(frozen=True)
class Axis:
    """One axis of the grid: cell i has its centre at ``first + i * step``."""

    name: str
    unit: str
    """``m``, ``rad``, or ``healpix`` (directions in ring order)."""
    first: float
    step: float
    count: int
    periodic: bool
    """The cell after the last one is cell 0."""

    def places(self, coordinates: Floats) -> Floats:
        """Steps from the centre of cell 0; wrapped into 0..count on a periodic axis."""
        place = (coordinates - self.first) / self.step
        if self.periodic:
            outside = ~((place >= 0.0) & (place < self.count))
            wrapped = place - np.floor(place / self.count) * self.count
            place = np.where(outside, np.clip(wrapped, 0.0, self.count), place)
        return place

    def nearest(self, coordinates: Floats) -> Ints:
        """The cell whose centre is nearest: wrapped on a periodic axis, clamped otherwise."""
        index = np.maximum(np.floor(self.places(coordinates) + 0.5), 0.0).astype(np.int64)
        return index % self.count if self.periodic else np.minimum(index, self.count - 1)


@dataclass(frozen=True)
class Nearest:
    """The cells nearest to poses."""

    cells: Ints
    """(poses,) in C order over the axes."""
    labels: npt.NDArray[np.uint8]
    """(poses,) indices into ``LABELS``: 0 no solution, 1 colliding, 2 reachable."""
    poses: Floats
    """(poses, 6) the cells' centres."""
    inside: npt.NDArray[np.bool_]
    """(poses,) whether the pose is in the grid."""

    @property
    def names(self) -> list[str]:
        """The labels' names."""
        return [LABELS[label] for label in self.labels]


class ReachabilityField:
    """The map of a reachability dataset, read only from ``field.mcap``.

    Poses are x, y, z [m], roll, pitch, yaw [rad] with rotation Rz(yaw) Ry(pitch) Rx(roll), of ``target`` in ``frame``.

    Raises ``DatasetError`` when the folder has no field, or it is damaged.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        path = self.folder / "field.mcap"
        if not os.path.lexists(path):
            remedy = "give the folder of a finished reachability dataset"
            raise UnfinishedDataset(self.folder, "it has no field.mcap", remedy)
        file = McapFile(path)
        messages = [found for chunk in range(len(file.offsets)) for found in file.messages(file.chunk(chunk))]
        if len(messages) != 1:
            raise file.damaged(f"{len(messages)} messages, where one field should be")
        try:
            self._read(file, *messages[0])
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise file.damaged(f"its field cannot be read ({error})") from error

    def _read(self, file: McapFile, number: int, _: int, payload: memoryview) -> None:
        channel = file.channels[number]
        field = channel.schema.decode(channel.schema_name, payload)
        self.axes = [Axis(**axis) for axis in field["axes"]]
        if len(self.axes) != (5 if any(axis.unit == "healpix" for axis in self.axes) else 6):
            raise WireError(f"{len(self.axes)} axes")
        if not len(field["labels"]):
            raise WireError("no cell")
        self.shape = tuple(axis.count for axis in self.axes)
        self.labels = np.frombuffer(field["labels"], np.uint8).reshape(self.shape)
        """Labels of the cells, indices into ``LABELS``; shape as the axes."""
        self.distances = np.frombuffer(field["distances"], "<f4").reshape(self.shape)
        """Signed distances of the cells' centres, negative inside the reachable set; shape as the axes."""
        self.robot: str = field["robot"]
        self.robot_digest: str = bytes(field["robot_digest"]).hex()
        self.joints: list[str] = field["joints"]
        self.target: str = field["target"]
        self.frame: str = field["frame"]
        self.profile: str = field["profile"]
        self.unit: str = field["unit"]
        """Unit of the distances: ``metres`` or ``cells``."""
        self.radian_weight: float = field["radian_weight"]
        self.on_sphere = self.axes[3].unit == "healpix"
        """Whether orientations are directions and rolls instead of roll, pitch and yaw."""

    def _scale(self, axis: Axis) -> float:
        """Field units per unit of an axis."""
        if self.unit == "cells":
            return 1.0 / axis.step
        return self.radian_weight if axis.unit == "rad" else 1.0

    def distance(self, poses: npt.ArrayLike) -> Floats:
        """Signed distance at poses (..., 6), negative inside: (...,)."""
        return self.distance_and_gradient(poses)[0]

    def distance_and_gradient(self, poses: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Signed distance (...,) and its gradient (..., 6), per metre and radian, at poses (..., 6).

        Between centres: multilinear on six axes; for directions, linear in position, in the triangle of directions and in
        roll. Beyond the box of the centres: the value at its border plus the distance to it. Where the gradient jumps
        (at centres) it is that of one side. A field without a border is infinite, with a zero gradient; a pose that is
        not finite gives NaN.
        """
        given = np.asarray(poses, np.float64)
        if given.shape[-1:] != (6,):
            raise ValueError(f"poses of shape {given.shape}; give (..., 6): x, y, z, roll, pitch, yaw")
        flat = given.reshape(-1, 6)
        values, gradients = np.full(len(flat), np.nan), np.full((len(flat), 6), np.nan)
        if np.isinf(self.distances.flat[0]):
            values[:], gradients[:] = self.distances.flat[0], 0.0
        else:
            finite = np.flatnonzero(np.isfinite(flat).all(axis=1))
            look_up = self._on_sphere if self.on_sphere else self._on_axes
            for first in range(0, len(finite), _AT_A_TIME):
                some = finite[first : first + _AT_A_TIME]
                values[some], gradients[some] = look_up(flat[some])
        return values.reshape(given.shape[:-1]), gradients.reshape(given.shape)

    def _corners(self, poses: Floats, axes: list[Axis]) -> tuple[list[Ints], list[Ints], list[Floats], Floats]:
        """Lower and upper cell and share between them on each axis; distance of poses beyond the grid, in field units."""
        low, high, share = [], [], []
        beyond = np.zeros((len(poses), len(axes)))
        for k, axis in enumerate(axes):
            place = axis.places(poses[:, k])
            inside = np.clip(place, 0.0, axis.count if axis.periodic else axis.count - 1)
            beyond[:, k] = (place - inside) * axis.step * self._scale(axis)
            top = axis.count - 1 if axis.periodic else max(axis.count - 2, 0)
            below = np.minimum(inside.astype(np.int64), top)
            low.append(below)
            high.append((below + 1) % axis.count if axis.periodic else np.minimum(below + 1, axis.count - 1))
            share.append(inside - below)
        return low, high, share, beyond

    def _on_axes(self, poses: Floats) -> tuple[Floats, Floats]:
        low, high, share, beyond = self._corners(poses, self.axes)
        # All 2^6 corners, then the axes are contracted one after another, the first one first.
        cells: Ints = np.zeros((len(poses),) + (1,) * 6, np.int64)
        for k, count in enumerate(self.shape):
            side = np.stack([low[k], high[k]], axis=1).reshape((len(poses),) + (1,) * k + (2,) + (1,) * (5 - k))
            cells = cells * count + side
        corners = self.distances.reshape(-1)[cells].astype(np.float64)
        slopes: list[Floats] = []
        for k in range(6):
            by = share[k].reshape((-1,) + (1,) * (5 - k))
            slopes = [slope[:, 0] + by * (slope[:, 1] - slope[:, 0]) for slope in slopes]
            slopes.append(corners[:, 1] - corners[:, 0])
            corners = corners[:, 0] + by * slopes[-1]
        gradient = np.stack([slope / axis.step for slope, axis in zip(slopes, self.axes)], axis=1)
        return self._add_beyond(corners, gradient, beyond)

    @cached_property
    def _mesh(self) -> DirectionMesh:
        return DirectionMesh(self._nside)

    @property
    def _nside(self) -> int:
        return int(round((self.axes[3].count / 12) ** 0.5))

    @cached_property
    def _frames(self) -> Floats:
        """(directions, 3, 3): columns are a direction, and the y and z axis of its end effector at roll 0."""
        elevation, azimuth = angles(self._nside).T
        return _rotations(np.zeros_like(elevation), -elevation, azimuth)

    def _on_sphere(self, poses: Floats) -> tuple[Floats, Floats]:
        places, roll = self.axes[:3], self.axes[4]
        low, high, share, beyond = self._corners(poses, places)
        rotation = _rotations(*poses[:, 3:].T)
        ahead, side = rotation[:, :, 0], rotation[:, :, 1]
        three, weights, slopes = self._mesh.around(ahead)
        value, along = np.zeros(len(poses)), np.zeros((len(poses), 3))
        turning = np.zeros((len(poses), 3))
        for k in range(3):
            frame = self._frames[three[:, k]]
            place = roll.places(_turn_about(frame, ahead, side))
            below = np.minimum(place.astype(np.int64), roll.count - 1)
            by = place - below
            ends = [self._blend(low, high, share, three[:, k], at) for at in (below, (below + 1) % roll.count)]
            own = ends[0] + by[:, None] * (ends[1] - ends[0])
            weight = weights[:, k]
            value += weight * own[:, 0]
            along += weight[:, None] * own[:, 1:]
            # The direction moves along x with unit velocity.
            turning += own[:, :1] * np.cross(ahead, slopes[:, k])
            # Carried along, the rotation about the other direction grows by: half the two axes' sum, over the cosine squared
            # of half the angle between them.
            towards = frame[:, :, 0]
            cosine = np.sum(ahead * towards, axis=1)
            by_turn = weight * (ends[1][:, 0] - ends[0][:, 0]) / roll.step / (1.0 + cosine)
            turning += by_turn[:, None] * (ahead + towards)
        yaw = poses[:, 5]
        by_pitch = turning[:, 1] * np.cos(yaw) - turning[:, 0] * np.sin(yaw)
        by_angle = np.stack([np.sum(turning * ahead, axis=1), by_pitch, turning[:, 2]], axis=1)
        return self._add_beyond(value, np.concatenate([along, by_angle], axis=1), beyond)

    def _blend(self, low: list[Ints], high: list[Ints], share: list[Floats], direction: Ints, roll: Ints) -> Floats:
        """Value at an orientation and its slopes along x, y, z: (poses, 4)."""
        x, y, z = (np.stack([low[k], high[k]], axis=1) for k in range(3))
        some = direction[:, None, None, None], roll[:, None, None, None]
        corners = self.distances[x[:, :, None, None], y[:, None, :, None], z[:, None, None, :], *some].astype(
            np.float64
        )
        slopes: list[Floats] = []
        for k in range(3):
            by = share[k].reshape((-1,) + (1,) * (2 - k))
            slopes = [slope[:, 0] + by * (slope[:, 1] - slope[:, 0]) for slope in slopes]
            slopes.append(corners[:, 1] - corners[:, 0])
            corners = corners[:, 0] + by * slopes[-1]
        return np.stack([corners, *(slope / axis.step for slope, axis in zip(slopes, self.axes))], axis=1)

    def _add_beyond(self, value: Floats, gradient: Floats, beyond: Floats) -> tuple[Floats, Floats]:
        """The offset from the box of the centres, for poses outside it."""
        distance = np.sqrt(np.sum(beyond**2, axis=1))
        far = distance > 0.0
        value[far] += distance[far]
        for k in range(beyond.shape[1]):
            out = beyond[:, k] != 0.0
            gradient[out, k] = beyond[out, k] / distance[out] * self._scale(self.axes[k])
        return value, gradient

    def nearest(self, poses: npt.ArrayLike) -> Nearest:
        """The cells nearest to finite poses (poses, 6).

        With six axes: axis by axis. With directions: by the angle between the rotations; positions are clamped.
        """
        given = np.atleast_2d(np.asarray(poses, np.float64))
        if given.ndim != 2 or given.shape[1] != 6 or not np.isfinite(given).all():
            raise ValueError(f"poses of shape {given.shape}; give finite (poses, 6): x, y, z, roll, pitch, yaw")
        plain = self.axes[:3] if self.on_sphere else self.axes
        places = [axis.nearest(given[:, k]) for k, axis in enumerate(plain)]
        if self.on_sphere:
            parts = [self._nearest_orientation(given[k : k + 1024]) for k in range(0, len(given), 1024)]
            places += list(np.concatenate(parts, axis=1)) if parts else [np.zeros(0, np.int64)] * 2
        inside = np.ones(len(given), np.bool_)
        for k, axis in enumerate(plain):
            steps = (given[:, k] - axis.first) / axis.step
            inside &= axis.periodic | ((steps >= -0.5) & (steps <= axis.count - 0.5))
        cells = np.ravel_multi_index(tuple(places), self.shape).astype(np.int64)
        return Nearest(cells, self.labels.reshape(-1)[cells], self.poses(cells), inside)

    def _nearest_orientation(self, poses: Floats) -> Ints:
        """Direction and roll nearest to each pose, (2, poses): the largest cosine of half the angle between
        rotations."""
        roll = self.axes[4]
        rotation = _rotations(*poses[:, 3:].T)
        ahead, side = rotation[:, None, :, 0], rotation[:, None, :, 1]
        turn = _turn_about(self._frames[None], ahead, side)
        rolls = roll.nearest(turn)
        swing = 0.5 * (1.0 + np.sum(self._frames[None, :, :, 0] * ahead, axis=2))
        cosine = np.cos(0.5 * (turn - (roll.first + rolls * roll.step)))
        best = np.argmax(swing * cosine**2, axis=1)
        return np.stack([best, rolls[np.arange(len(poses)), best]])

    def poses(self, cells: npt.ArrayLike) -> Floats:
        """The poses of cells' centres, (cells, 6): x, y, z [m], roll, pitch, yaw [rad]."""
        places = np.unravel_index(np.asarray(cells, np.int64), self.shape)
        centres = [axis.first + place * axis.step for axis, place in zip(self.axes, places)]
        if self.on_sphere:
            elevation, azimuth = angles(self._nside)[places[3]].T
            centres = [*centres[:3], centres[4], -elevation, azimuth]
        return np.stack(centres, axis=1)

    def witnesses(self) -> Floats:
        """Joint values [rad, m] of every cell, (cells, joints), NaN where it is not reachable; read from the shards.

        Raises ``DatasetError`` when the dataset is not finished, or is not this map's.
        """
        data = Dataset(self.folder, ReachabilitySample)
        if not len(data) or self.labels.size % len(data):
            raise DamagedFile(self.folder, f"{len(data)} samples for a map of {self.labels.size} cells", VERIFY)
        found = np.full((self.labels.size, len(self.joints)), np.nan)
        labels = self.labels.reshape(len(data), -1)
        by_position = found.reshape(len(data), labels.shape[1], -1)
        for place, block in enumerate(data):
            if not np.array_equal(block.labels, labels[place]):
                raise DamagedFile(self.folder, f"sample {block.index} is not of this map's field", VERIFY)
            witnesses = block.witnesses
            if witnesses.shape[1] != len(self.joints):
                raise DamagedFile(self.folder, f"sample {block.index} is of another robot", VERIFY)
            by_position[place, labels[place] == 2] = witnesses
        return found


def _rotations(roll: Floats, pitch: Floats, yaw: Floats) -> Floats:
    """Rz(yaw) Ry(pitch) Rx(roll), (poses, 3, 3)."""
    (sr, cr), (sp, cp), (sy, cy) = ((np.sin(angle), np.cos(angle)) for angle in (roll, pitch, yaw))
    return np.stack(
        [
            np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], axis=-1),
            np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], axis=-1),
            np.stack([-sp, cp * sr, cp * cr], axis=-1),
        ],
        axis=-2,
    )


def _turn_about(frame: Floats, x: Floats, y: Floats) -> Floats:
    """The rotation about a direction of an end effector whose x axis was moved onto it the shortest way [rad, -pi..pi].

    ``frame`` (..., 3, 3) holds the direction and the axes from which rotations count; ``x`` and ``y`` (..., 3) are the end
    effector's.
    """
    direction = frame[..., :, 0]
    # Straight back there is no shortest way: any rotation is valid.
    least = np.finfo(np.float64).tiny
    along = np.sum(y * direction, axis=-1) / np.maximum(1.0 + np.sum(x * direction, axis=-1), least)
    swung = y - along[..., None] * (x + direction)
    return np.asarray(np.arctan2(np.sum(swung * frame[..., :, 2], axis=-1), np.sum(swung * frame[..., :, 1], axis=-1)))
