"""The objects of a dataset of grasps: their meshes, and how they rest on a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .errors import VERIFY, DamagedFile
from .folder import Folder
from .geometry import Floats, pose
from .mcap import McapFile
from .samples import as_array
from .wire import Message, WireError


@dataclass(frozen=True, eq=False)
class Mesh:
    """An object's mesh as it was prepared, in the object's frame."""

    object: str
    """BLAKE3 of the prepared mesh, 64 hexadecimal digits."""
    name: str
    vertices: npt.NDArray[np.float32]
    """(n, 3) m"""
    triangles: npt.NDArray[np.int64]
    """(m, 3) places in ``vertices``, counter-clockwise seen from outside."""


@dataclass(frozen=True, eq=False)
class RestingPose:
    """A pose in which an object rests on a table, the plane z = 0 of the world."""

    world_from_object: Floats
    """(4, 4) z up, the origin on the table below the centre of mass."""
    probability: float
    """Share of random drops that end so."""
    height: float
    """m, of the centre of mass over the table."""


def resting_poses(folder: str | Path) -> dict[str, list[RestingPose]]:
    """The stable poses of each object on a table, the most likely first, by name of the object; two of one name are
    told apart by the digest. ``clearances`` of grasps have one value for each.

    Raises ``DatasetError`` when the dataset is of another product, or damaged.
    """
    dataset = Folder(folder)
    dataset.expect("grasps")
    found: dict[str, list[RestingPose]] = {}
    for row in dataset.objects():
        name = row["object"] if row["name"] in found else row["name"]
        try:
            found[name] = [
                RestingPose(pose(np.array(each["world_from_object"], np.float64)), each["probability"], each["height"])
                for each in row["resting"]
            ]
        except (KeyError, TypeError, ValueError) as error:
            problem = f"the resting poses of {row['name']} cannot be read ({error})"
            raise DamagedFile(dataset.path / "assets.json", problem, VERIFY) from error
    return found


def object_meshes(folder: str | Path) -> dict[str, Mesh]:
    """The meshes in ``shapes.mcap`` of a dataset of grasps, by name of the object; two of one name are told apart by
    the digest.

    Raises ``DatasetError`` when the dataset is of another product, or damaged.
    """
    dataset = Folder(folder)
    dataset.expect("grasps")
    names = {row["object"]: row["name"] for row in dataset.objects()}
    file = McapFile(dataset.path / "shapes.mcap")
    meshes: dict[str, Mesh] = {}
    for chunk in range(len(file.offsets)):
        for number, _, payload in file.messages(file.chunk(chunk)):
            try:
                channel = file.channels[number]
                if channel.topic != "/grasps/object":
                    continue
                mesh = _mesh(channel.schema.decode(channel.schema_name, payload), names)
            except (KeyError, ValueError) as error:
                raise file.damaged(f"a mesh cannot be read ({error})") from error
            meshes[mesh.object if mesh.name in meshes else mesh.name] = mesh
    return meshes


def _mesh(message: Message, names: dict[str, str]) -> Mesh:
    """Out of an ``ObjectShape`` message."""
    digest = bytes(message["object"]).hex()
    vertices = as_array(message["vertices"], "<f4", -1, 3)
    triangles = message["triangles"].astype(np.int64).reshape(-1, 3)
    if triangles.max(initial=-1) >= len(vertices):
        raise WireError(f"a triangle names vertex {triangles.max()} of {len(vertices)}")
    return Mesh(digest, names.get(digest, digest), vertices, triangles)
