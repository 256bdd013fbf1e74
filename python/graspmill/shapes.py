"""The objects of a dataset: physical properties, meshes, and resting poses on a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import VERIFY, DamagedFile
from .folder import Folder
from .geometry import Floats, pose
from .mcap import McapFile
from .samples import as_array
from .wire import Message, WireError

WITH_MESHES = ("grasps", "scenes", "views", "picks")
"""Products whose datasets have the meshes of their objects."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """An object's mesh as it was prepared, in the object's frame."""

    object: str
    """BLAKE3 of the prepared mesh, 64 hexadecimal digits."""
    name: str
    vertices: npt.NDArray[np.float32]
    """(n, 3) m"""
    triangles: npt.NDArray[np.int64]
    """(m, 3) indices into ``vertices``, counter-clockwise seen from outside."""


@dataclass(frozen=True, eq=False)
class RestingPose:
    """A pose in which an object rests on a table, the plane z = 0 of the world."""

    world_from_object: Floats
    """(4, 4) z up, the origin on the table below the centre of mass."""
    probability: float
    """Share of random drops that end in it."""
    height: float
    """m, of the centre of mass over the table."""


@dataclass(frozen=True, eq=False)
class ObjectFacts:
    """Weight and kind of an object, in its own frame."""

    object: str
    """BLAKE3 of the prepared mesh, 64 hexadecimal digits."""
    name: str
    category: str | None
    """Kind of object, if the job gives it."""
    material: str | None
    """Class of material, if the job gives it."""
    mass: float
    """kg"""
    mass_from: str
    """``job``, ``table``, ``material`` or ``hull`` (by the area of the convex hull)."""
    mass_source: str
    """Source of the mass in words; may be empty."""
    friction: float | None
    """Coefficient of friction against hands; ``None`` without trials."""
    solid_volume: float
    """m^3, by the cells of the solid; NaN for an object without inside, as are centre and inertia."""
    centre_of_mass: Floats
    """(3,) m"""
    inertia: Floats
    """(3, 3) kg m^2, about the centre of mass."""
    inertia_per_kilogram: Floats
    """(3, 3) m^2"""
    symmetry_group: str
    """``C1`` for none, ``C`` and ``D`` with the order of the main axis, ``T``, ``O``, ``I``, ``K`` for a ball."""
    symmetry_tolerance: float
    """m, largest distance from the surface at which a mapped point counts as on it."""
    symmetries_discrete: Floats
    """(n, 4, 4) rotations of the object onto itself, without the identity and those of ``symmetries_continuous``."""
    symmetries_continuous: Floats
    """(m, 2, 3) axes of rotation by any angle: direction, and a point on it (m)."""
    mirror_normals: Floats
    """(k, 3) normals of planes of reflection through the centre of mass."""


def object_facts(folder: str | Path) -> dict[str, ObjectFacts]:
    """Weight and kind of each object of a dataset, by name; two of one name are distinguished by the digest.

    Raises ``DatasetError`` if the dataset has no facts of objects, as reachability maps and older datasets, or is damaged.
    """
    dataset = Folder(folder)
    found: dict[str, ObjectFacts] = {}
    for row in dataset.objects():
        name = row["object"] if row["name"] in found else row["name"]
        try:
            found[name] = _facts(row)
        except (KeyError, TypeError, ValueError) as error:
            problem = f"the facts of {row['name']} cannot be read ({error})"
            raise DamagedFile(dataset.path / "assets.json", problem, VERIFY) from error
    return found


def _facts(row: dict[str, Any]) -> ObjectFacts:
    """From a row of ``assets.json``."""

    def numbers(key: str, *shape: int) -> Floats:
        return np.array(row.get(key, np.full(shape, np.nan)), np.float64).reshape(shape)

    nothing: dict[str, Any] = dict.fromkeys(("symmetries_discrete", "symmetries_continuous", "mirror_normals"), [])
    symmetry: dict[str, Any] = row.get("symmetry") or nothing
    axes = [[each["axis"], each["offset"]] for each in symmetry["symmetries_continuous"]]
    return ObjectFacts(
        object=row["object"],
        name=row["name"],
        category=row.get("category"),
        material=row.get("material"),
        mass=float(row["mass"]),
        mass_from=row["mass_from"],
        mass_source=row["mass_source"],
        friction=row.get("friction"),
        solid_volume=float(row.get("solid_volume", np.nan)),
        centre_of_mass=numbers("centre_of_mass", 3),
        inertia=numbers("inertia", 3, 3),
        inertia_per_kilogram=numbers("inertia_per_kilogram", 3, 3),
        symmetry_group=symmetry.get("group", "C1"),
        symmetry_tolerance=float(symmetry.get("tolerance", np.nan)),
        symmetries_discrete=np.array(symmetry["symmetries_discrete"], np.float64).reshape(-1, 4, 4),
        symmetries_continuous=np.array(axes, np.float64).reshape(-1, 2, 3),
        mirror_normals=np.array(symmetry["mirror_normals"], np.float64).reshape(-1, 3),
    )


def resting_poses(folder: str | Path) -> dict[str, list[RestingPose]]:
    """The stable poses of each object on a table, the most likely first, by name of the object; two of one name are
    distinguished by the digest. ``clearances`` of grasps have one value for each.

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
    """The meshes in ``shapes.mcap`` of a dataset of scenes, views, grasps or picks, by name of the object; two of one name are
    distinguished by the digest.

    Raises ``DatasetError`` when the dataset is of another product, or damaged.
    """
    dataset = Folder(folder)
    dataset.expect(*WITH_MESHES)
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
    """From an ``ObjectShape`` message."""
    digest = bytes(message["object"]).hex()
    vertices = as_array(message["vertices"], "<f4", -1, 3)
    triangles = message["triangles"].astype(np.int64).reshape(-1, 3)
    if triangles.max(initial=-1) >= len(vertices):
        raise WireError(f"a triangle names vertex {triangles.max()} of {len(vertices)}")
    return Mesh(digest, names.get(digest, digest), vertices, triangles)
