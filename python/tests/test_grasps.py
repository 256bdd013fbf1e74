"""Grasps, trials, patches and heatmaps: the arrays against the index and against each other's geometry."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import igl
import numpy as np
import pytest
import trimesh
from graspmill import (
    FREE_WAYS,
    TRIAL_VERDICTS,
    VERDICTS,
    WAYPOINTS,
    DamagedFile,
    Dataset,
    Folder,
    GraspSample,
    PatchSample,
    object_facts,
    object_meshes,
    resting_poses,
)


@pytest.fixture(scope="module")
def runs(data: Path) -> Dataset[GraspSample]:
    return Dataset(data / "set/grasps", GraspSample)


def test_verdicts_are_those_of_the_index(runs: Dataset[GraspSample]) -> None:
    for place, run in enumerate(runs):
        grasps = run.grasps
        counts = np.bincount(grasps["verdict"], minlength=len(VERDICTS))
        assert counts.tolist() == [runs.column(f"grasps_{verdict}")[place] for verdict in VERDICTS]
        assert (np.diff(grasps["energy"]) >= 0).all() and grasps["energy"][0] == runs.column("best_energy")[place]
        for name in ("object_from_approach", "object_from_base"):
            turn = grasps[name][:, :3, :3]
            assert np.allclose(turn @ turn.transpose(0, 2, 1), np.eye(3), atol=1e-9)
        assert grasps["joints"].shape == (len(grasps), len(run.run["joints"]))
        assert grasps["posture"].shape == (len(grasps), len(run.run["driven"]))
        assert np.isnan(grasps["clearances"][grasps["verdict"] == 1]).all()
        assert not np.isnan(grasps["clearances"][grasps["verdict"] != 1]).any()


def test_objects_rest_on_the_table(data: Path, runs: Dataset[GraspSample]) -> None:
    """In each resting pose the lowest vertex lies on the plane z = 0, and grasps have a clearance for each."""
    meshes, resting = object_meshes(data / "set/grasps"), resting_poses(data / "set/grasps")
    assert set(resting) == set(meshes)
    for name, poses in resting.items():
        assert poses and all(pose.height > 0 for pose in poses)
        chances = [pose.probability for pose in poses]
        assert chances == sorted(chances, reverse=True) and 0 < sum(chances) < 1 + 1e-9
        for pose in poses:
            heights = meshes[name].vertices @ pose.world_from_object[2, :3] + pose.world_from_object[2, 3]
            assert abs(heights.min()) < 1e-6, name
    for run, name in zip(runs, runs.column("object")):
        assert run.grasps["clearances"].shape[1] == run.run["resting_poses"] == len(resting[name])


def test_objects_weigh_what_trials_took(data: Path, runs: Dataset[GraspSample]) -> None:
    """Volume, centre and inertia are those of the prepared mesh, and symmetries move it onto itself."""
    facts, meshes = object_facts(data / "set/grasps"), object_meshes(data / "set/grasps")
    assert set(facts) == set(meshes)
    for name, fact in facts.items():
        mesh = trimesh.Trimesh(meshes[name].vertices, meshes[name].triangles, process=False)
        assert fact.object == meshes[name].object and fact.mass > 0
        assert abs(fact.solid_volume / mesh.volume - 1) < 0.05
        assert np.allclose(fact.centre_of_mass, mesh.center_mass, atol=2e-3)
        size = np.trace(fact.inertia_per_kilogram)
        assert np.allclose(fact.inertia_per_kilogram, mesh.moment_inertia / mesh.volume, atol=0.05 * size)
        assert np.allclose(fact.inertia, fact.mass * fact.inertia_per_kilogram)
        turns = [fact.symmetries_discrete]
        for axis, point in fact.symmetries_continuous:
            turn = trimesh.transformations.rotation_matrix(1.0, axis, point)
            turns.append(turn[None])
        for turn in np.concatenate(turns):
            moved = mesh.vertices[::7] @ turn[:3, :3].T + turn[:3, 3]
            distance = np.abs(igl.signed_distance(moved, np.array(mesh.vertices), np.array(mesh.faces))[0])
            assert np.mean(distance <= fact.symmetry_tolerance) > 0.9, name
        assert np.allclose(np.linalg.norm(fact.mirror_normals, axis=1), 1)
    for run, name in zip(runs, runs.column("object")):
        if run.has("trials"):
            trials = run.message("trials")
            assert (trials["mass"], trials["mass_from"]) == (facts[name].mass, facts[name].mass_from)
            assert trials["friction"] == facts[name].friction


def test_resting_poses_that_are_none_are_refused(data: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(data / "set/grasps", tmp_path / "copy"))
    path, manifest = copy / "assets.json", copy / "manifest.json"
    table = json.loads(path.read_text(encoding="utf-8"))
    del table["objects"][0]["resting"][0]["height"]
    path.write_text(json.dumps(table), encoding="utf-8")
    facts = json.loads(manifest.read_text(encoding="utf-8"))
    facts["files"]["assets.json"]["bytes"] = path.stat().st_size
    manifest.write_text(json.dumps(facts), encoding="utf-8")
    with pytest.raises(DamagedFile, match="assets.json.*resting poses"):
        resting_poses(copy)


def test_types_are_those_of_the_patches(data: Path, runs: Dataset[GraspSample]) -> None:
    """The table counts the tried grasps that have a type, and those without; the chosen ones are the most common that held."""
    types = Folder(data / "set/patches").types()
    kinds = np.concatenate([run.grasps["type"][run.trials["grasp"]] for run in runs])
    held = np.concatenate([[trial["label"] == 2 for trial in run.message("trials")["trials"]] for run in runs])
    found, counts = np.unique(kinds[kinds >= 0], return_counts=True)
    assert types["counts"] == {str(kind): count for kind, count in zip(found.tolist(), counts.tolist())}
    assert types["without"] == np.sum(kinds < 0)
    found, counts = np.unique(kinds[held & (kinds >= 0)], return_counts=True)
    assert types["chosen"] == found[np.argsort(-counts, kind="stable")][: len(types["chosen"])].tolist()
    assert Dataset(data / "set/patches", PatchSample)[0].types == types["chosen"]


def test_labels_of_patches_are_those_of_the_trials(data: Path, runs: Dataset[GraspSample]) -> None:
    patches = Dataset(data / "set/patches", PatchSample)
    for place, sample in enumerate(patches):
        found = np.flatnonzero(
            (runs.column("subject") == sample.id.subject) & (runs.column("item") == sample.patch["run"])
        )
        trials = runs[int(found[0])].message("trials")["trials"]
        label = next(trial["label"] for trial in trials if trial["grasp"] == sample.patch["rank"])
        assert sample.outcome == ["untested", "held", "failed", "borderline", "unconfirmed"][label - 1]
        assert patches.column("outcome")[place] == label
        value = {"held": -1.0, "failed": 1.0}.get(sample.outcome, 0.0)
        own = np.zeros(sample.labels.shape, bool)
        own[range(4), 4 * sample.type_index + np.arange(4)] = True
        assert (sample.labels[own] == value).all() and not sample.labels[~own].any()
        assert np.array_equal(sample.tested, own & (value != 0))


def test_points_behind_the_surface_and_squares_in_metres(data: Path) -> None:
    patches = Dataset(data / "set/patches", PatchSample)
    for place, sample in enumerate(patches):
        camera, image = sample.camera, sample.image
        whole = np.full((camera.height, camera.width), np.nan, np.float32)
        height, width = image.metres.shape
        whole[image.top : image.top + height, image.left : image.left + width] = image.metres
        column, row = np.floor(sample.pixels).astype(int).T
        assert np.array_equal(sample.surfaces, whole[row, column], equal_nan=True)
        points = sample.patch["points"].reshape(-1, 3)
        depth = points @ sample.camera_from_object[2, :3] + sample.camera_from_object[2, 3]
        assert np.array_equal(sample.visible, ~(depth > sample.surfaces.astype(float) + 0.005))
        assert patches.column("visible_points")[place] == sample.visible.sum()
        heatmap = sample.heatmap
        assert heatmap.visible is not None and len(heatmap.visible) == len(heatmap.points)
        known = ~np.isnan(heatmap.image())
        assert not (~np.isnan(heatmap.image(visible=True)) & ~known).any()
        side = sample.patch["side"]
        for (left, top, window), square, z in zip(sample.windows, sample.metric_depth, depth):
            assert abs(window - 0.12 * camera.fx / z) <= 0.5 + 1e-9
            picked = np.floor((np.arange(side) + 0.5) * window / side).astype(int)
            assert np.array_equal(square, whole[top + picked[:, None], left + picked], equal_nan=True)


def test_contacts_lie_on_the_objects_mesh(data: Path, runs: Dataset[GraspSample]) -> None:
    meshes = object_meshes(data / "set/grasps")
    names = runs.column("object")
    assert set(meshes) == set(names)
    for run, name in zip(runs, names):
        contacts, grasps = run.contacts, run.grasps
        assert np.bincount(contacts["grasp"], minlength=len(grasps)).tolist() == grasps["contacts"].tolist()
        mesh = meshes[name]
        corners = mesh.vertices.astype(np.float64)
        squared = igl.point_mesh_squared_distance(contacts["point"], corners, mesh.triangles)[0]
        assert len(contacts) and np.sqrt(squared.max()) < 1e-6
        assert contacts["link"].max() < len(run.run["links"])


def test_trials_are_counted_as_the_index_does(runs: Dataset[GraspSample]) -> None:
    tried = 0
    for place, run in enumerate(runs):
        trials = run.trials
        tried += len(trials)
        # Every state was tried whose closed hand touches with two links.
        untried = np.isin(run.grasps["verdict"], [VERDICTS.index(name) for name in ("penetrates", "open_hand")])
        assert trials["grasp"].tolist() == np.flatnonzero(~untried).tolist()
        assert len(trials) == runs.column("grasps_tried")[place]
        held = trials["verdict"] == TRIAL_VERDICTS.index("held")
        assert held.sum() == runs.column("grasps_held")[place]
        on_table = trials["table_pose"] >= 0
        assert on_table.sum() == runs.column("grasps_tried_on_table")[place]
        assert trials["held_on_table"].sum() == runs.column("grasps_held_on_table")[place]
        # On a table were those that stay above it, in the most likely pose of which that is true.
        clearances = run.grasps["clearances"][trials["grasp"]]
        for trial, lowest in zip(trials, clearances):
            above = np.flatnonzero(np.asarray(lowest) >= 0)
            likeliest = above[0] if len(above) else -1
            # A grasp that fails in the air may be left at that.
            is_left = trial["verdict"] != TRIAL_VERDICTS.index("held") and trial["table_pose"] == -1
            assert is_left or trial["table_pose"] == likeliest
        # A grasp that was not perturbed has no label held or failed.
        labels = np.array([trial["label"] for trial in run.message("trials")["trials"]], int)
        assert (trials["perturbed"][np.isin(labels, [2, 3])] == 1).all()
        contacts = run.trial_contacts
        assert set(contacts["grasp"]) <= set(trials["grasp"]) and (contacts["force"] >= 0).all()
    assert tried > 0


def test_trials_over_time_go_on_as_long_as_the_trial(runs: Dataset[GraspSample]) -> None:
    seen = set()
    for run in runs:
        series, message = run.series, run.message("trials")
        assert message["gravity"] == "lifted" and message["series_interval"] == 0.02
        for trial in message["trials"]:
            assert bool(trial["series"]) >= bool(trial["table"] and trial["table"]["series"])
            for on_table, stored in ((False, trial), (True, trial["table"] or {"series": None})):
                some = series[(series["grasp"] == trial["grasp"]) & (series["on_table"] == on_table)]
                if not stored["series"]:
                    assert len(some) == 0
                    continue
                seen.add(on_table)
                time = stored["outcome"]["time"]
                assert np.allclose(some["time"], 0.02 * np.arange(1, len(some) + 1))
                assert len(some) == int(time / 0.02 + 1e-6)
                assert np.bincount(some["phase"], minlength=3).tolist() == stored["series"]["samples"].tolist()
                silent = np.delete(some["forces"], stored["series"]["links"].astype(int), axis=1)
                assert some["forces"].shape[1] == len(message["links"]) and not silent.any()
                held = some[some["phase"] > 0]
                # A little more in the step that decided a trial than in the samples before it.
                assert (held["moved"] <= stored["outcome"]["farthest"] + 1e-6).all()
    assert seen == {False, True}


def test_hands_come_close_and_lift(data: Path, runs: Dataset[GraspSample]) -> None:
    resting, seen = resting_poses(data / "set/grasps"), set()
    for run, name in zip(runs, runs.column("object")):
        grasps, stand_off = run.grasps, run.run["stand_off"]
        up = resting[name][0].world_from_object[2, :3]
        way, free = run.waypoints(up), run.free_ways()
        assert way.shape == (len(grasps), len(WAYPOINTS)) and WAYPOINTS[0] == "pregrasp"
        # A way is free of the object where no part of it meets it, and of a table where the hand stays above.
        passes = (grasps["object_in_way"] == 0) & (grasps["verdict"] != VERDICTS.index("penetrates"))[:, None]
        assert np.array_equal(free, np.array(FREE_WAYS)[2 * passes[:, 0] + passes[:, 1]])
        on_table = np.stack([grasps["clearances"][:, 0], grasps["clearances_opened"][:, 0]], axis=1) >= 0
        assert np.array_equal(run.free_ways(0), np.array(FREE_WAYS)[(passes & on_table) @ [2, 1]])
        assert np.array_equal(np.isnan(run.waypoints(up, resting_pose=0)["driven"][:, 0, 0]), run.free_ways(0) == "none")
        seen |= set(free)
        # Without a way there is no row.
        is_free, opened = free != "none", np.isin(free, ("opened", "both"))
        assert all(np.isnan(way[field][~is_free]).all() for field in way.dtype.names)
        grasps, way, opened = grasps[is_free], way[is_free], opened[is_free]
        bases = way["object_from_base"]
        # In the approach frame the hand is straight back, without any other motion.
        back = np.linalg.inv(grasps["object_from_approach"]) @ bases[:, 0] @ np.linalg.inv(grasps["object_from_base"])
        back = back @ grasps["object_from_approach"]
        straight = np.eye(4)
        straight[2, 3] = -stand_off
        assert stand_off == 0.1 and np.allclose(back, straight, atol=1e-12)
        for place in (1, 2, 3):
            assert np.array_equal(bases[:, place], grasps["object_from_base"])
        world = resting[name][0].world_from_object
        raised = world @ bases[:, 4] - world @ bases[:, 3]
        assert np.allclose(raised[:, 2, 3], 0.1) and np.allclose(raised[:, :2, 3], 0, atol=1e-12)
        driven, joints = way["driven"], way["joints"]
        coming = np.where(opened[:, None], grasps["opening"], grasps["posture"])
        assert np.array_equal(driven[:, 0], coming) and np.array_equal(driven[:, 1], coming)
        assert np.array_equal(driven[:, 2], grasps["posture"]) and np.isnan(driven[:, 3:]).all()
        assert np.isnan(joints[opened, :2]).all()
        assert np.array_equal(joints[~opened, 0], grasps["joints_before"][~opened])
        assert np.array_equal(joints[:, 2], grasps["joints_before"]) and np.array_equal(joints[:, 4], grasps["joints"])
        with pytest.raises(ValueError, match="unit length"):
            run.waypoints((0.0, 0.0, 2.0))
        with pytest.raises(ValueError, match="resting_pose"):
            run.free_ways(len(resting[name]))
    assert "both" in seen


def test_patches_are_cut_from_their_images(data: Path, runs: Dataset[GraspSample]) -> None:
    patches = Dataset(data / "set/patches", PatchSample)
    assert len(patches)
    for sample in patches:
        camera, image = sample.camera, sample.image
        whole = np.full((camera.height, camera.width), np.nan, np.float32)
        height, width = image.metres.shape
        whole[image.top : image.top + height, image.left : image.left + width] = image.metres
        side = sample.patch["side"]
        for (column, row), patch in zip(sample.corners, sample.depth):
            assert np.array_equal(whole[row : row + side, column : column + side], patch, equal_nan=True)
        labels = sample.labels
        own = [k * labels.shape[1] + 4 * sample.type_index + k for k in range(4)]
        assert set(np.flatnonzero(labels)) in (set(own), set())
        assert sample.types[sample.type_index] == sample.patch["type"]
        # The points project to the pixels.
        points = (
            sample.patch["points"].reshape(-1, 3) @ sample.camera_from_object[:3, :3].T
            + sample.camera_from_object[:3, 3]
        )
        pixels = points[:, :2] / points[:, 2:] * [camera.fx, camera.fy] + [camera.cx, camera.cy]
        assert np.allclose(pixels, sample.pixels, atol=1e-6)
        with pytest.raises(KeyError, match="colour"):
            sample.rgb


def test_heatmaps_hold_the_patchs_own_grasp(data: Path, runs: Dataset[GraspSample]) -> None:
    patches = Dataset(data / "set/patches", PatchSample)
    for place, sample in enumerate(patches):
        heatmap, patch = sample.heatmap, sample.patch
        own = (heatmap.runs == patch["run"]) & (heatmap.ranks == patch["rank"])
        assert sorted(heatmap.points[own].tolist()) == [0, 1, 2, 3]
        image = heatmap.image()
        assert image.shape == (4 * len(sample.types), heatmap.height, heatmap.width)
        for k, (column, row) in enumerate(np.floor(sample.pixels).astype(int)):
            channel = 4 * sample.type_index + k
            if sample.labels[k, channel] != 0:
                assert image[channel, row, column] <= sample.labels[k, channel]
        # The grasp itself, in the dataset beside.
        found = np.flatnonzero((runs.column("subject") == sample.id.subject) & (runs.column("item") == patch["run"]))
        grasp = runs[int(found[0])].grasps[patch["rank"]]
        assert grasp["type"] == patch["type"] and grasp["energy"] == patch["energy"]
        assert np.allclose(grasp["object_from_approach"], sample.object_from_approach)
