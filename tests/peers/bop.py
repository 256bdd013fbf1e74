"""Reads an export in BOP's layout as a stranger would, and draws it again: vertices through `cam_K`, Embree through whole pixels.

    bop.py FOLDER COUNT

Uses no code of the project. Pixel centres are whole numbers. Prints, as JSON: by how many whole pixels `bbox_obj` and the box of the
projected vertices differ at most; by how much the middles of the two differ in the mean [px]; how many pixels of `mask` and `mask_visib`
differ from masks by Embree away from edges, and of `mask` in all, in the first two images; by how much depth differs [mm]; how far off its
surface a symmetry takes a model's points, as a share of its diameter, and how many models have one; and which of the format's rules are
broken. Names that end in `_unshifted` are of a `cam_K` whose centre is half a pixel farther right and down.
"""

import json
import sys
from pathlib import Path

import numpy as np
import trimesh
from images import decode, inclusive_box, picture
from pixels import calm
from trimesh.ray.ray_pyembree import RayMeshIntersector

FAR = 1e12


def depth_by_rays(mesh, matrix, shape):
    rows, columns = np.indices(shape)
    rays = np.stack([columns.ravel(), rows.ravel(), np.ones(rows.size)], axis=1) @ np.linalg.inv(matrix).T
    origins = np.zeros_like(rays)
    _, numbers, points = RayMeshIntersector(mesh).intersects_id(origins, rays, multiple_hits=False, return_locations=True)
    depth = np.full(rows.size, FAR)
    depth[numbers] = points[:, 2]
    return depth.reshape(shape)


def rotation(axis, angle):
    """The rotation about a unit axis (Rodrigues)."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def symmetries(info):
    """Poses (4, 4) [mm] that take a model into itself, after the description of the format."""
    for pose in info.get("symmetries_discrete", []):
        yield np.array(pose).reshape(4, 4)
    for symmetry in info.get("symmetries_continuous", []):
        axis, offset = np.array(symmetry["axis"]), np.array(symmetry["offset"])
        for angle in (0.4, 2.0, 4.5):
            pose = np.eye(4)
            pose[:3, :3] = rotation(axis, angle)
            pose[:3, 3] = offset - pose[:3, :3] @ offset
            yield pose


def check_models_for_errors(root, infos, result, broken):
    """`models_eval`: the same surfaces in short edges, which symmetries take into themselves."""
    folder = root / "models_eval"
    if json.loads((folder / "models_info.json").read_text()) != infos:
        broken.append("models_info of models_eval")
    for number, info in infos.items():
        dense = trimesh.load(folder / f"obj_{int(number):06}.ply", process=False)
        plain = trimesh.load(root / "models" / f"obj_{int(number):06}.ply", process=False)
        if dense.edges_unique_length.max() > 1.001 * info["diameter"] / 50 or abs(dense.area / plain.area - 1) > 1e-5:
            broken.append(f"models_eval of {number}")
        poses = list(symmetries(info))
        result["symmetric"] += bool(poses)
        for pose in poses:
            moved = trimesh.transform_points(plain.vertices, pose)
            off = trimesh.proximity.closest_point_naive(plain, moved[:200])[1].max()
            result["symmetry"] = max(result["symmetry"], float(off / info["diameter"]))


def check_lists(root, scenes, broken):
    """`camera.json` and the lists of targets, counted again."""
    first = json.loads((scenes[0] / "scene_camera.json").read_text())["0"]
    camera = json.loads((root / "camera.json").read_text())
    if [camera[key] for key in ("fx", "cx", "fy", "cy")] != [first["cam_K"][place] for place in (0, 2, 4, 5)]:
        broken.append("camera.json")
    found, images = [], []
    for scene in (scene for scene in scenes if scene.parent.name == "test"):
        poses, facts = (json.loads((scene / f"scene_{name}.json").read_text()) for name in ("gt", "gt_info"))
        for image in poses:
            images.append({"scene_id": int(scene.name), "im_id": int(image)})
            seen = [pose["obj_id"] for pose, fact in zip(poses[image], facts[image]) if fact["visib_fract"] >= 0.1]
            found += [images[-1] | {"obj_id": number, "inst_count": seen.count(number)} for number in sorted(set(seen))]
    for name, expected in (("bop19", found), ("bop24", images)):
        path = root / f"test_targets_{name}.json"
        if (json.loads(path.read_text()) if path.exists() else []) != expected:
            broken.append(path.name)


def main():
    root, limit = Path(sys.argv[1]), int(sys.argv[2])
    models = {int(path.stem.split("_")[1]): trimesh.load(path, process=False) for path in sorted((root / "models").glob("obj_*.ply"))}
    infos = json.loads((root / "models" / "models_info.json").read_text())
    broken = []
    for number, model in models.items():
        info = infos[str(number)]
        low = np.array([info["min_x"], info["min_y"], info["min_z"]])
        size = np.array([info["size_x"], info["size_y"], info["size_z"]])
        if np.abs(model.bounds[0] - low).max() > 1e-3 or np.abs(model.bounds[1] - low - size).max() > 1e-3:
            broken.append(f"models_info of {number}")
        hull = model.convex_hull.vertices
        widest = max(np.linalg.norm(hull - point, axis=1).max() for point in hull)
        if abs(widest - info["diameter"]) > 1e-3:
            broken.append(f"diameter of {number}: {widest} {info['diameter']}")
    result = {"images": 0, "bodies": 0, "box": 0.0, "mask_wrong": 0, "mask_differ": 0, "mask_differ_unshifted": 0, "visib_wrong": 0, "depth": 0.0}
    result |= {"symmetry": 0.0, "symmetric": 0}
    check_models_for_errors(root, infos, result, broken)
    offsets, unshifted = [], []
    scenes = sorted(path for split in ("train", "val_holdout", "val", "test") for path in (root / split).glob("*") if path.is_dir())
    check_lists(root, scenes, broken)
    for scene in scenes:
        cameras, poses, facts, coco, modal = (
            json.loads((scene / f"scene_{name}.json").read_text()) for name in ("camera", "gt", "gt_info", "gt_coco", "gt_coco_modal")
        )
        if not set(cameras) == set(poses) == set(facts):
            broken.append(f"images of {scene.name}")
        for name, camera in cameras.items():
            if result["images"] >= limit:
                break
            result["images"] += 1
            matrix = np.array(camera["cam_K"]).reshape(3, 3)
            depth = picture(scene / "depth" / f"{int(name):06}.png").astype(np.float64) * camera["depth_scale"]
            layers = []
            for index, (pose, fact) in enumerate(zip(poses[name], facts[name])):
                result["bodies"] += 1
                mask = picture(scene / "mask" / f"{int(name):06}_{index:06}.png")
                visible = picture(scene / "mask_visib" / f"{int(name):06}_{index:06}.png")
                if not set(np.unique(mask)) <= {0, 255} or not set(np.unique(visible)) <= {0, 255}:
                    broken.append("levels of masks")
                mask, visible = mask > 0, visible > 0
                placed = models[pose["obj_id"]].copy()
                transform = np.eye(4)
                transform[:3, :3] = np.array(pose["cam_R_m2c"]).reshape(3, 3)
                transform[:3, 3] = pose["cam_t_m2c"]
                placed.apply_transform(transform)
                layers.append(depth_by_rays(placed, matrix, mask.shape))
                result["mask_wrong"] += int(((mask != (layers[-1] < FAR)) & calm(layers[-1] < FAR)).sum())
                if result["images"] <= 2:
                    shifted = matrix + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
                    result["mask_differ"] += int((mask != (layers[-1] < FAR)).sum())
                    result["mask_differ_unshifted"] += int((mask != (depth_by_rays(placed, shifted, mask.shape) < FAR)).sum())
                seen = placed.vertices @ matrix.T
                pixels = seen[:, :2] / seen[:, 2:]
                # A silhouette's pixels are those whose centres lie in it: its box ends less than one pixel inside of that of its corners.
                low, high = np.ceil(pixels.min(0)), np.floor(pixels.max(0))
                left, top, width, height = fact["bbox_obj"]
                if fact["px_count_visib"] > 0:
                    drawn = np.array([left, top, left + width, top + height])
                    result["box"] = max(result["box"], float(np.abs(np.concatenate([low, high]) - drawn).max()))
                    if fact["px_count_all"] > 2000:
                        # Middle of the pixels against middle of the projected outline: signed, so that a shift adds up.
                        middle = (pixels.min(0) + pixels.max(0)) / 2 - (drawn[:2] + drawn[2:]) / 2
                        offsets.append(middle)
                        unshifted.append(middle + 0.5)
                elif fact["bbox_obj"] != [-1, -1, -1, -1] or fact["bbox_visib"] != [-1, -1, -1, -1]:
                    broken.append("boxes of what is not seen")
                if fact["bbox_visib"] != inclusive_box(visible) or fact["px_count_visib"] != int(visible.sum()):
                    broken.append("bbox_visib or px_count_visib")
                if fact["px_count_valid"] != int((mask & (depth > 0)).sum()):
                    broken.append("px_count_valid")
                if fact["px_count_all"] < int(mask.sum()) or (visible & ~mask).any():
                    broken.append("px_count_all or mask")
                if fact["px_count_all"] and abs(fact["visib_fract"] - fact["px_count_visib"] / fact["px_count_all"]) > 1e-12:
                    broken.append("visib_fract")
                for kind, notes, boxed in (("amodal", coco, mask), ("modal", modal, visible)):
                    own = [each for each in notes["annotations"] if each["image_id"] == int(name) and each["category_id"] == pose["obj_id"]]
                    if visible.any():
                        if not any((decode(each["segmentation"]) == visible).all() for each in own):
                            broken.append(f"COCO's segmentation, {kind}")
                        box = inclusive_box(boxed)
                        if not any(each["bbox"] == [box[0], box[1], box[2] + 1, box[3] + 1] for each in own):
                            broken.append(f"COCO's box, {kind}")
                for image in coco["images"]:
                    if not (scene / image["file_name"]).is_file():
                        broken.append("COCO's images")
            nearest = np.argmin(np.stack(layers), axis=0)
            reached = np.min(np.stack(layers), axis=0)
            for index in range(len(layers)):
                visible = picture(scene / "mask_visib" / f"{int(name):06}_{index:06}.png") > 0
                # Container and table may hide a body, too: what is seen of it is nearest of the bodies, at the stored depth.
                wrong = visible & calm(nearest) & (nearest != index)
                second = np.sort(np.stack(layers), axis=0)[1] if len(layers) > 1 else np.full(reached.shape, FAR)
                result["visib_wrong"] += int((wrong & (second - reached > 1e-2)).sum())
                inner = visible & calm(visible) & (nearest == index) & (depth > 0)
                if inner.any():
                    result["depth"] = max(result["depth"], float(np.abs(depth - reached)[inner].max()))
    result["offset"] = float(np.abs(np.mean(offsets, axis=0)).max())
    result["offset_unshifted"] = float(np.abs(np.mean(unshifted, axis=0)).min())
    result["broken"] = sorted(set(broken))
    print(json.dumps(result))


main()
