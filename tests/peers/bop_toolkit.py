"""Opens an export in BOP's layout with the loader of the BOP toolkit, and counts again what the toolkit's own scripts count.

    bop_toolkit.py FOLDER

Needs `bop_toolkit_lib`. The toolkit knows the challenge's datasets by name, so the export is opened as the one called `lm`. Paths, files,
masks, targets, boxes and symmetries are read and made by the toolkit; points of models that its transforms and its projection put into an
image are compared with the stored boxes and depths. Prints what was counted as JSON.
"""

import json
import math
import os
import sys
import tempfile

import numpy as np
from bop_toolkit_lib import dataset_params, inout, misc, pose_error, pycoco_utils
from scipy.spatial import cKDTree

NAME = "lm"
SPLITS = (("train", None), ("val", None), ("val", "holdout"), ("test", None))


def check_models(root, found):
    """Sizes and diameters of both sets of models, and symmetries that take each model into itself."""
    models = {}
    for kind in (None, "eval"):
        params = dataset_params.get_model_params(root, NAME, kind)
        infos = inout.load_json(params["models_info_path"], keys_to_int=True)
        for number, info in infos.items():
            model = inout.load_ply(params["model_tpath"].format(obj_id=number))
            points = model["pts"]
            box = misc.calc_3d_bbox(points[:, 0], points[:, 1], points[:, 2])
            stored = [info[key] for key in ("min_x", "min_y", "min_z", "size_x", "size_y", "size_z")]
            assert np.allclose(box, stored, atol=1e-3), f"box of {number}"
            assert np.allclose(np.array(box[:3]) + np.array(box[3:]) / 2, 0, atol=1e-3), f"centre of {number}"
            assert abs(misc.calc_pts_diameter2(points) - info["diameter"]) < 1e-3, f"diameter of {number}"
            if kind == "eval":
                corners = points[model["faces"].astype(int)]
                edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
                assert edges.max() < 1.001 * info["diameter"] / 50, f"edges of {number}"
                symmetries = misc.get_symmetry_transformations(info, 0.01)
                tree, worst = cKDTree(points), 0.0
                for symmetry in symmetries[:: max(1, len(symmetries) // 40)]:
                    moved = misc.transform_pts_Rt(points, symmetry["R"], symmetry["t"])
                    worst = max(worst, float(tree.query(moved)[0].max()))
                    # A pose that a symmetry turned is the same pose to the toolkit's error.
                    error = pose_error.mssd(symmetry["R"], symmetry["t"], np.eye(3), np.zeros((3, 1)), points[:50], symmetries)
                    assert error < 1e-6, f"symmetries of {number}"
                # Points of a surface in edges of a fiftieth are nearer than that to another of its points.
                found["symmetry"] = max(found["symmetry"], worst / (info["diameter"] / 50))
                found["symmetric"] += len(symmetries) > 1
                models[number] = points
    return models


def check_scene(split, scene, models, targets, found):
    """One scene: every file by the toolkit's names of it."""
    path = {name: value.format(scene_id=scene, im_id="{im_id:06d}", gt_id="{gt_id:06d}") if isinstance(value, str) else None
            for name, value in split.items() if name.endswith("_tpath") and "{im_id" not in value}
    cameras = inout.load_scene_camera(path["scene_camera_tpath"])
    truth = inout.load_scene_gt(path["scene_gt_tpath"])
    infos = inout.load_json(path["scene_gt_info_tpath"], keys_to_int=True)
    assert list(cameras) == list(truth) == list(infos)
    annotations = {"amodal": [], "modal": []}
    for image, camera in cameras.items():
        depth = inout.load_depth(split["depth_tpath"].format(scene_id=scene, im_id=image)) * camera["depth_scale"]
        size = (depth.shape[1], depth.shape[0])
        found["images"] += 1
        found["colours"] += os.path.exists(split["rgb_tpath"].format(scene_id=scene, im_id=image))
        own = inout.get_im_targets(truth[image], infos[image], 0.1)
        expected = {(obj, target["inst_count"]) for obj, target in own.items()}
        if targets is not None:
            assert expected == {(row["obj_id"], row["inst_count"]) for row in targets if (row["scene_id"], row["im_id"]) == (scene, image)}
        for number, (pose, info) in enumerate(zip(truth[image], infos[image])):
            masks = [
                inout.load_im(split[name].format(scene_id=scene, im_id=image, gt_id=number)).astype(bool)
                for name in ("mask_tpath", "mask_visib_tpath")
            ]
            whole, visible = masks
            # As calc_gt_info.py counts them.
            assert info["px_count_visib"] == visible.sum() and info["px_count_valid"] == (depth[whole] > 0).sum()
            share = info["px_count_visib"] / info["px_count_all"] if info["px_count_all"] else 0.0
            assert math.isclose(info["visib_fract"], share, abs_tol=1e-12)
            if not visible.any():
                assert info["bbox_visib"] == info["bbox_obj"] == [-1, -1, -1, -1]
                continue
            rows, columns = visible.nonzero()
            assert info["bbox_visib"] == [int(value) for value in misc.calc_2d_bbox(columns, rows, size)]
            points = models[pose["obj_id"]]
            pixels = misc.project_pts(points, camera["cam_K"], pose["cam_R_m2c"], pose["cam_t_m2c"])
            left, top, right, bottom = *np.ceil(pixels.min(0)), *np.floor(pixels.max(0))
            x, y, width, height = info["bbox_obj"]
            found["box"] = max(found["box"], float(np.abs(np.array([left, top, right, bottom]) - [x, y, x + width, y + height]).max()))
            # The nearest points of the model in pixels that see it lie at the stored depth.
            inside = np.round(pixels).astype(int)
            inside_image = ((inside >= 0) & (inside < size)).all(1)
            z = misc.transform_pts_Rt(points, pose["cam_R_m2c"], pose["cam_t_m2c"])[inside_image, 2]
            column, row = inside[inside_image].T
            seen = visible[row, column] & (depth[row, column] > 0)
            off = (z - depth[row, column])[seen]
            front = np.abs(off) < 5
            found["seen_points"] += int(front.sum())
            found["depth_sum"] += float(np.abs(off[front]).sum())
            for kind, mask in (("amodal", whole), ("modal", visible)):
                box = pycoco_utils.bbox_from_binary_mask(mask)
                note = pycoco_utils.create_annotation_info(
                    len(annotations[kind]) + 1, image, pose["obj_id"], visible, box, tolerance=2, ignore=info["visib_fract"] < 0.1
                )
                annotations[kind].append(note)
            found["bodies"] += 1
    for kind, ending in (("amodal", ""), ("modal", "_modal")):
        stored = inout.load_json(path["scene_gt_coco_tpath"].replace("scene_gt_coco", f"scene_gt_coco{ending}"))
        assert {image["id"] for image in stored["images"]} == set(cameras)
        for image in stored["images"]:
            file = os.path.join(os.path.dirname(path["scene_gt_coco_tpath"]), image["file_name"])
            assert inout.load_im(file).shape[:2] == (image["height"], image["width"])
        assert len(stored["annotations"]) == len(annotations[kind])
        for note, expected in zip(stored["annotations"], annotations[kind]):
            for key in ("id", "image_id", "category_id", "iscrowd", "area", "bbox", "segmentation", "width", "height", "ignore"):
                assert note[key] == expected[key], f"{kind}: {key} of {note['id']}: {note[key]} for {expected[key]}"


def main():
    found = {"images": 0, "bodies": 0, "colours": 0, "box": 0.0, "seen_points": 0, "depth_sum": 0.0, "symmetry": 0.0, "symmetric": 0, "splits": []}
    with tempfile.TemporaryDirectory() as root:
        folder = os.path.join(root, NAME)
        os.symlink(os.path.abspath(sys.argv[1]), folder)
        camera = dataset_params.get_camera_params(root, NAME)
        models = check_models(root, found)
        for name, kind in SPLITS:
            split = dataset_params.get_split_params(root, NAME, name, kind)
            scenes = dataset_params.get_present_scene_ids(split)
            if not scenes:
                continue
            found["splits"].append(os.path.basename(split["split_path"]))
            targets = inout.load_json(os.path.join(folder, "test_targets_bop19.json")) if name == "test" else None
            before = found["images"]
            for scene in scenes:
                check_scene(split, scene, models, targets, found)
            if name == "test":
                images = [(row["scene_id"], row["im_id"]) for row in inout.load_json(os.path.join(folder, "test_targets_bop24.json"))]
                assert len(set(images)) == len(images) == found["images"] - before
            first = inout.load_scene_camera(split["scene_camera_tpath"].format(scene_id=scenes[0]))[0]
            found["same_camera"] = bool(np.allclose(first["cam_K"], camera["K"])) and camera["depth_scale"] in (0.1, 1.0)
    found["depth"] = found.pop("depth_sum") / max(found["seen_points"], 1)
    print(json.dumps(found))


main()
