"""Exports in ACRONYM's layout, read by h5py as ACRONYM's loaders read its files, against the shards."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import trimesh
from graspmill import VERDICTS, Dataset, GraspSample, object_meshes

# A gripper whose pads close along x, in the frame of the Panda's base, whose fingers slide along y.
BASE_FROM_GRIPPER = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], np.float64)


def labelled(runs: Dataset[GraspSample], name: str) -> list[dict[str, Any]]:
    """The grasps of an object with a label: those that were tried, or all where the dataset has no trials."""
    found = []
    for place in np.flatnonzero(runs.column("object") == name).tolist():
        run, item = runs[place], runs.column("item")[place]
        if run.has("trials"):
            rows = [(int(trial["grasp"]), trial["verdict"] == 0, trial["farthest"]) for trial in run.trials]
        else:
            kept = run.grasps["verdict"] == VERDICTS.index("kept")
            rows = [(rank, held, None) for rank, held in enumerate(kept)]
        for rank, held, farthest in rows:
            found.append({"item": item, "rank": rank, "held": held, "farthest": farthest, "grasp": run.grasps[rank]})
    return found


@pytest.mark.parametrize("name", ["pinched", "pads"])
def test_files_hold_the_grasps_of_each_object(data: Path, name: str) -> None:
    runs, folder = Dataset(data / name, GraspSample), data / "acronym" / name
    facts = json.loads((folder / "export.json").read_text(encoding="utf-8"))
    source = "trial" if name == "pinched" else "verdict"
    assert facts["root"] == runs.folder.root and facts["object_in_gripper"] == source
    meshes, count, labels = object_meshes(data / name), 0, set()
    for object_name, mesh in meshes.items():
        expected = labelled(runs, object_name)
        with h5py.File(folder / "grasps" / f"{object_name}.h5") as file:
            transforms = np.array(file["grasps/transforms"])
            success = np.array(file["grasps/qualities/flex/object_in_gripper"])
            own = {key: np.array(values) for key, values in file["grasps/qualities/graspmill"].items()}
            assert file["grasps/qualities/flex/object_in_gripper"].attrs["from"].decode() == source
            assert file["gripper/type"].asstr()[()] == runs[0].run["hand"]
            assert file["gripper/configuration"][()].tolist() == [0.04]
            assert file["object/id"].asstr()[()] == runs.objects[object_name]
            # As ACRONYM's loader finds the mesh.
            loaded = trimesh.load(folder / file["object/file"].asstr()[()], process=False)
            loaded.apply_scale(file["object/scale"][()])
            facts_of_object = {key: values[()] for key, values in file["object"].items()}
        count += len(expected)
        assert transforms.shape == (len(expected), 4, 4) and success.dtype == np.int64
        assert success.tolist() == [row["held"] for row in expected]
        assert own["item"].tolist() == [row["item"] for row in expected]
        assert own["rank"].tolist() == [row["rank"] for row in expected]
        for key in ("energy", "epsilon_force", "epsilon_wrench", "volume", "width"):
            assert np.array_equal(own[key], [row["grasp"][key] for row in expected], equal_nan=True)
        assert ("farthest" in own) == (name == "pinched")
        if name == "pinched":
            assert own["farthest"].tolist() == [row["farthest"] for row in expected]
        poses = np.array([row["grasp"]["object_from_base"] @ BASE_FROM_GRIPPER for row in expected])
        assert np.allclose(transforms, poses, atol=1e-12)
        approach = np.array([row["grasp"]["object_from_approach"][:3, 2] for row in expected])
        assert np.allclose(transforms[:, :3, 2], approach, atol=1e-9)
        assert np.allclose(loaded.vertices, mesh.vertices) and np.array_equal(loaded.faces, mesh.triangles)
        assert facts_of_object["volume"] == pytest.approx(loaded.volume, rel=0.03)
        assert np.allclose(facts_of_object["com"], loaded.center_mass, atol=2e-3)
        if name == "pinched":
            message = runs[int(np.flatnonzero(runs.column("object") == object_name)[0])].message("trials")
            assert facts_of_object["mass"] == message["mass"] and facts_of_object["friction"] == message["friction"]
            density = facts_of_object["mass"] / facts_of_object["volume"]
            assert facts_of_object["density"] == pytest.approx(density)
            inertia = loaded.moment_inertia * density
            assert np.allclose(facts_of_object["inertia"], inertia, atol=0.05 * np.abs(inertia).max())
        else:
            assert not {"mass", "density", "inertia"} & set(facts_of_object)
        labels |= set(success.tolist())
    assert facts["grasps"] == count and labels == ({0, 1} if name == "pads" else labels | {1})


def test_pads_close_on_the_object_along_x(data: Path) -> None:
    """Contacts of tried grasps lie on both sides of the gripper's plane x = 0, ahead of its base along z; kept ones face it."""
    runs = Dataset(data / "pinched", GraspSample)
    checked = 0
    for object_name in runs.objects:
        with h5py.File(data / "acronym/pinched/grasps" / f"{object_name}.h5") as file:
            transforms = np.array(file["grasps/transforms"])
        for row, object_from_gripper in zip(labelled(runs, object_name), transforms):
            of_run = (runs.column("object") == object_name) & (runs.column("item") == row["item"])
            run = runs[int(np.flatnonzero(of_run)[0])]
            contacts = run.contacts[run.contacts["grasp"] == row["rank"]]
            gripper_from_object = np.linalg.inv(object_from_gripper)
            points = contacts["point"] @ gripper_from_object[:3, :3].T + gripper_from_object[:3, 3]
            normals = contacts["normal"] @ gripper_from_object[:3, :3].T
            assert points[:, 0].min() < 0.0 < points[:, 0].max()
            # Between the palm's face and the fingertips of a Panda.
            assert (points[:, 2] > 0.05).all() and (points[:, 2] < 0.125).all()
            if row["grasp"]["verdict"] == VERDICTS.index("kept"):
                assert np.abs(normals[:, 0]).max() > 0.8
                checked += 1
    assert checked > 0


def test_the_layout_is_that_of_acronyms_own_files(data: Path) -> None:
    """Every dataset of ACRONYM's files that its loaders read is there, with the same rank and kind of numbers."""
    kinds = {
        "grasps/transforms": (3, "f"),
        "grasps/qualities/flex/object_in_gripper": (1, "i"),
        "gripper/configuration": (1, "f"),
        "gripper/type": (0, "O"),
        "object/com": (1, "f"),
        "object/density": (0, "f"),
        "object/file": (0, "O"),
        "object/friction": (0, "f"),
        "object/inertia": (2, "f"),
        "object/mass": (0, "f"),
        "object/scale": (0, "f"),
        "object/volume": (0, "f"),
    }
    for path in sorted((data / "acronym/pinched/grasps").glob("*.h5")):
        with h5py.File(path) as file:
            assert {key: (file[key].ndim, file[key].dtype.kind) for key in kinds} == kinds
