"""Heatmaps of scenes against another program: every row made anew out of scenes, views, picks and the hand's description.

    heatmaps.py HEATMAPS SCENES VIEWS PICKS HAND.xml

The hand's description is read by MuJoCo: palm and fingertips are its sites at the closed joints. Poses of cameras are those of the
views, poses of bodies those of the scenes, grasps, verdicts and outcomes those of the picks. Which grasps an image has,
where their points are, and how each is labelled is decided here by the rules in docs/format.md, with double precision; a grasp within
1e-9 of the largest angle counts as a tie. The depth is compared with Embree's on the meshes beside the views, away from edges.
Prints counts as JSON.
"""

import json
import sys

import graspmill
import numpy as np
import trimesh
from handsites import Hand, states_of
from pixels import FAR, calm, depth_of, fixed_meshes

TIE = 1e-9
VISIBLE = 5e-3


def expected_rows(image, scene_picks, hand):
    """Free and forbidden grasps of an image by body and candidate, and the keys at whose angle rounding decides."""
    axis = image.world_from_camera[:3, 2]
    free, forbidden, ties = {}, {}, set()
    for body, picks in scene_picks.items():
        states, joints = states_of(picks), picks.closed_joints
        for candidate, world_from_base in enumerate(picks.world_from_base):
            is_free = picks.verdicts[candidate] == 0
            # A hand that something stops has no joints in the record; its palm is fixed to its base.
            values = joints[candidate] if is_free else np.zeros(len(picks.joint_names))
            frames = world_from_base @ hand.frames(dict(zip(picks.joint_names, values)))
            cosine = frames[0, :3, 2] @ axis - np.cos(image.angle)
            key = (body, candidate)
            if abs(cosine) < TIE:
                ties.add(key)
            if cosine < 0:
                continue
            if is_free:
                stored = tuple(int(rows[candidate]) for rows in (picks.runs, picks.ranks, picks.directions))
                free[key] = (states[candidate], frames[:, :3, 3], world_from_base, stored)
            else:
                forbidden[key] = (int(picks.verdicts[candidate]), frames[0, :3, 3])
    return free, forbidden, ties


def project(image, points):
    camera = image.camera
    seen = (points - image.world_from_camera[:3, 3]) @ image.world_from_camera[:3, :3]
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = np.stack([camera.fx * seen[..., 0] / seen[..., 2] + camera.cx, camera.fy * seen[..., 1] / seen[..., 2] + camera.cy], -1)
    pixels[seen[..., 2] < camera.near] = np.nan
    return pixels, seen[..., 2]


def square(pixel, side):
    return np.floor(pixel - side / 2 + 0.5).astype(int)


def window_of(image, depth):
    """Side in pixels of the square of one size in metres at a depth."""
    return max(1, int(np.floor(image.size * image.camera.fx / depth + 0.5)))


def check_grasp(image, row, expected, found):
    """Compares one row with what it should be."""
    state, points, world_from_base, stored = expected
    assert (image.runs[row], image.ranks[row], image.directions[row]) == stored
    assert image.states[row] == state
    value = {"trial": (0.0, -1.0, 1.0)[state], "free": -1.0}[image.label]
    assert image.values[row] == value, (image.values[row], state)
    assert np.abs(image.world_from_base[row] - world_from_base).max() < 1e-12
    found["worst_point"] = max(found["worst_point"], float(np.abs(image.points[row] - points).max()))
    pixels, depths = project(image, image.points[row])
    assert np.allclose(image.pixels[row], pixels, rtol=1e-9, atol=1e-6, equal_nan=True)
    camera, depth = image.camera, image.depth
    whole = True
    for point, (pixel, along) in enumerate(zip(pixels, depths)):
        inside = not np.isnan(pixel).any() and (pixel >= 0).all() and pixel[0] < camera.width and pixel[1] < camera.height
        found["points"] += int(inside)
        surface = image.surfaces[row, point]
        if inside:
            column, line = np.floor(pixel).astype(int)
            stored_depth = depth[line, column]
            assert np.isnan(surface) == np.isnan(stored_depth) and not abs(surface - stored_depth) > 6e-5, (surface, stored_depth)
        else:
            assert np.isnan(surface)
        visible = inside and (np.isnan(surface) or along <= float(surface) + VISIBLE)
        assert image.visible[row, point] == visible
        found["visible"] += int(visible)
        if np.isnan(pixel).any():
            whole = False
            continue
        for side in (image.side, window_of(image, along)):
            first = square(pixel, side)
            whole &= bool((first >= 0).all() and first[0] + side <= camera.width and first[1] + side <= camera.height)
    return whole


def check_patches(image, found):
    """Corners, windows and cuts of the grasps with patches."""
    for place, row in enumerate(image.patch_grasps):
        _, depths = project(image, image.points[row])
        for point, pixel in enumerate(image.pixels[row]):
            corner = square(pixel, image.side)
            assert (image.corners[place, point] == corner).all()
            cut = image.depth[corner[1] : corner[1] + image.side, corner[0] : corner[0] + image.side]
            assert np.array_equal(image.patch_depth[place, point], cut, equal_nan=True)
            window = window_of(image, depths[point])
            left, top, side = image.windows[place, point]
            assert side == window and ([left, top] == square(pixel, window)).all()
            middle = np.floor((np.arange(image.side) + 0.5) * window / image.side).astype(int)
            metric = image.depth[top + middle][:, left + middle]
            assert np.array_equal(image.metric_depth[place, point], metric, equal_nan=True)
        labels, tested = image.labels[place], image.tested[place]
        assert np.count_nonzero(labels) == (len(labels) if image.values[row] else 0)
        assert tested.sum() == (len(labels) if image.states[row] else 0)
        found["patches"] += 1


def check_background(image, forbidden, found):
    """A forbidden grasp is no row, and no map has a label where its palm alone is."""
    rows = set(zip(image.bodies.tolist(), image.candidates.tolist()))
    assert not rows & forbidden.keys()
    palms = {tuple(np.floor(image.pixels[row, 0]).astype(int)) for row in range(len(image.bodies)) if image.in_image[row, 0]}
    maps = image.heatmap.image()[:: len(image.point_names)]
    for (column, line), inside in zip(image.forbidden_pixels, image._inside(image.forbidden_pixels)):
        if inside and (int(column), int(line)) not in palms:
            assert np.isnan(maps[:, int(line), int(column)]).all() and image.background[int(line), int(column)]
            found["background"] += 1


def compare_depth(image, view, meshes, found):
    """Depth by rays of Embree against all meshes at once, away from edges."""
    placed = [trimesh.Trimesh(meshes[name].vertices, meshes[name].triangles, process=False) for name in view.objects]
    placed = [mesh.apply_transform(pose) for mesh, pose in zip(placed, view.world_from_object)]
    placed += [mesh for _, mesh in fixed_meshes(view)]
    expected = np.minimum.reduce([depth_of(mesh, image.camera, image.world_from_camera) for mesh in placed])
    quiet = calm(view.instances) & (expected < FAR)
    found["depth_pixels"] += int(quiet.sum())
    found["worst_depth"] = max(found["worst_depth"], float(np.nanmax(np.abs(image.depth - expected)[quiet])))
    found["depth_missing"] += int(np.isnan(image.depth[quiet]).sum())


def main():
    heatmaps, scenes, views, picks, hand_file = sys.argv[1:]
    images = graspmill.Dataset(heatmaps, graspmill.HeatmapSample)
    view_of = {(view.id.subject, view.id.item): view.copy() for view in graspmill.Dataset(views, graspmill.ViewSample)}
    scene_of = {scene.scene_id: scene.copy() for scene in graspmill.Dataset(scenes, graspmill.SceneSample)}
    picks_of = {}
    for sample in graspmill.Dataset(picks, graspmill.PickSample):
        picks_of.setdefault(sample.id.subject, {})[sample.body] = sample.copy()
    meshes = {mesh.object: mesh for mesh in graspmill.object_meshes(views).values()}
    names = ("images", "grasps", "forbidden", "ties", "points", "visible", "patches", "background", "depth_pixels", "depth_missing")
    found = dict.fromkeys(names, 0) | {"untried": 0, "held": 0, "failed": 0, "worst_point": 0.0, "worst_depth": 0.0}
    hand = None
    for number, image in enumerate(images):
        hand = hand or Hand(hand_file, image.point_names)
        view, scene = view_of[image.id.subject, image.id.item], scene_of[image.id.subject]
        assert np.array_equal(image.world_from_camera, view.world_from_camera) and image.camera == view.camera
        assert scene.objects == view.objects and np.array_equal(scene.world_from_object, view.world_from_object)
        scene_picks = picks_of.get(image.id.subject, {})
        for sample in scene_picks.values():
            assert np.array_equal(sample.world_from_object, scene.world_from_object)
        assert [body + 1 for body in np.flatnonzero(image.evaluated)] == sorted(scene_picks)
        free, forbidden, ties = expected_rows(image, scene_picks, hand)
        rows = {key: row for row, key in enumerate(zip(image.bodies.tolist(), image.candidates.tolist()))}
        assert rows.keys() - ties == free.keys() - ties, (rows.keys() ^ free.keys())
        with_patches = set(image.patch_grasps.tolist())
        for key, row in rows.items():
            if key in free:
                assert check_grasp(image, row, free[key], found) == (row in with_patches), (key, row)
                found[graspmill.PICK_STATES[image.states[row]]] += 1
        stopped = dict(zip(zip(image.forbidden_bodies.tolist(), image.forbidden_candidates.tolist()), range(10**6)))
        assert stopped.keys() - ties == forbidden.keys() - ties
        for key in stopped.keys() & forbidden.keys():
            obstacle, palm = forbidden[key]
            assert image.obstacles[stopped[key]] == obstacle
            pixel, _ = project(image, palm)
            assert np.allclose(image.forbidden_pixels[stopped[key]], pixel, rtol=1e-6, atol=1e-6, equal_nan=True)
        check_patches(image, found)
        check_background(image, forbidden, found)
        if number % 3 == 0:
            compare_depth(image, view, meshes, found)
        found["images"] += 1
        found["grasps"] += len(rows)
        found["forbidden"] += len(stopped)
        found["ties"] += len(ties)
    print(json.dumps(found))


main()
