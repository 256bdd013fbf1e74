"""Samples of scenes: bodies at rest on their true meshes, in a bin or on a plane, or in imported poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .geometry import Floats
from .samples import as_array, content, expect_lengths
from .settled import SettledSample

CONTAINER = 0
"""Number of the container among the bodies of contacts and supports; bodies are numbered from 1."""
WALLS = 255
"""Instance of the container in a picture from above."""


@dataclass(frozen=True, eq=False)
class SceneContacts:
    """Points at which two bodies of a scene touch."""

    pairs: npt.NDArray[np.uint32]
    """(contacts, 2) numbers of the bodies, the lower first: ``CONTAINER``, or from 1."""
    points: Floats
    """(contacts, 3) m, half way between the two surfaces."""
    normals: Floats
    """(contacts, 3) outward from the first, unit length."""
    distances: Floats
    """(contacts,) m, negative where they overlap."""
    forces: Floats
    """(contacts, 3) N, of the first on the second."""
    torques: Floats
    """(contacts, 3) N m, of the first on the second about ``points``, by torsion and rolling friction."""


@dataclass(frozen=True, eq=False)
class Overview:
    """A scene from above, by a camera over the world's origin that points straight down: right is x, up is y."""

    instances: npt.NDArray[np.uint8]
    """(height, width): 0 floor or nothing, from 1 the body in front, ``WALLS`` the container."""
    depth: npt.NDArray[np.float32]
    """(height, width) m along the optical axis, NaN where nothing is."""
    focal: float
    """Focal length [px]; the principal point is the middle of the image, pixel centres at +0.5."""
    camera_z: float
    """Height of the camera above the floor [m]."""


class SceneSample(SettledSample):
    """Bodies of a scene in the order of their first release, with poses, contacts and supports."""

    product = "scenes"
    main = "scene"
    __slots__ = ()

    @content
    def scene_id(self) -> str:
        """Digest of container, objects and poses, 64 hexadecimal digits, which names the scene."""
        return bytes(self.message("scene")["scene"]).hex()

    @content
    def mode(self) -> str:
        """``table``, ``heap``, ``bin``, ``packed``, ``pile`` or ``imported``."""
        return str(self.message("scene")["mode"])

    @content
    def source(self) -> str:
        """Name of an imported scene among its files; empty for a settled scene."""
        return str(self.message("scene").get("source", ""))

    @content
    def world_from_source(self) -> Floats | None:
        """(4, 4) pose of the world of an imported scene's files in the scene's; None for a settled scene."""
        rows: Floats = self.message("scene").get("world_from_source", np.zeros(0))
        if len(rows) == 0:
            return None
        expect_lengths(12, world_from_source=rows)
        pose = np.eye(4)
        pose[:3] = rows.reshape(3, 4)
        return pose

    @content
    def crossed(self) -> int:
        """Pairs of bodies of an imported scene that intersect; 0 for a settled scene."""
        return int(self.message("scene").get("crossed", 0))

    @content
    def masses(self) -> Floats:
        """(bodies,) kg."""
        return self._per_body("masses")

    @content
    def centres_of_mass(self) -> Floats:
        """(bodies, 3) m, in the world: torques on a resting body balance about its own."""
        found: Floats = self.message("scene")["centres_of_mass"].reshape(-1, 3)
        expect_lengths(len(self.objects), centres_of_mass=found)
        return found

    @content
    def frictions(self) -> Floats:
        """(bodies,) coefficients of sliding friction; the larger one counts between two bodies."""
        return self._per_body("frictions")

    @content
    def drifts(self) -> Floats:
        """(bodies,) m: motion of the centre of mass when the scene is stepped again from rest."""
        return self._per_body("drifts")

    @content
    def resting_poses(self) -> npt.NDArray[np.int64]:
        """(bodies,) index of the resting pose of the object with the nearest upward direction; -1 if none is known."""
        found: npt.NDArray[np.int64] = np.asarray(self.message("scene")["resting_poses"], np.int64) - 1
        expect_lengths(len(self.objects), resting_poses=found)
        return found

    @content
    def resting_angles(self) -> Floats:
        """(bodies,) rad between the upward directions of the body and of its resting pose."""
        return self._per_body("resting_angles")

    @content
    def contacts(self) -> SceneContacts:
        """Contacts at these poses."""
        message = self.message("scene")
        pairs = np.stack([np.asarray(message[name], np.uint32) for name in ("touch_first", "touch_second")], axis=1)
        names = ("points", "normals", "forces", "torques")
        points, normals, forces, torques = (message[f"touch_{name}"].reshape(-1, 3) for name in names)
        distances = message["touch_distances"]
        expect_lengths(
            len(pairs), points=points, normals=normals, forces=forces, torques=torques, distances=distances
        )
        return SceneContacts(pairs, points, normals, distances, forces, torques)

    @content
    def supports(self) -> list[tuple[int, int, float]]:
        """Bodies that rest on others: ``(by, body, share)``, the share of the body's weight that the other carries."""
        message = self.message("scene")
        columns = [np.asarray(message[name]).tolist() for name in ("supporters", "supported", "shares")]
        expect_lengths(len(columns[0]), supported=columns[1], shares=columns[2])
        return list(zip(*columns))

    @content
    def overview(self) -> Overview:
        """The scene from above."""
        message = self.message("overview")
        shape = (message["height"], message["width"])
        depths = as_array(message["depths"], "<u2", *shape)
        depth = np.where(depths == 0, np.nan, depths * 1e-4).astype(np.float32)
        instances = as_array(message["instances"], "u1", *shape)
        return Overview(instances, depth, message["focal"], message["camera_z"])

    def _per_body(self, name: str) -> Floats:
        found: Floats = self.message("scene")[name]
        expect_lengths(len(self.objects), **{name: found})
        return found
