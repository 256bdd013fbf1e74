"""Reads an export of views as COCO instances, and compares images, masks and boxes with what the Python package reads in the shards.

    coco.py EXPORT DATASET

Masks are decoded by pycocotools where it is there, and by arithmetic of our own in any case. Prints what was counted as JSON.
"""

import json
import sys
from pathlib import Path

import graspmill
import numpy as np
from images import decode, inclusive_box, picture

try:
    from pycocotools import mask as pycocotools_mask
except ImportError:
    pycocotools_mask = None


def mask_of(annotation, key):
    found = decode(annotation[key])
    if pycocotools_mask is not None:
        height, width = annotation[key]["size"]
        assert (pycocotools_mask.decode(pycocotools_mask.frPyObjects(annotation[key], height, width)) == found).all()
    return found


def check_image(root, image, sample):
    """The file that is named holds the image: its colours, or its depth in whole millimetres."""
    levels = picture(root / image["file_name"])
    assert levels.shape[:2] == (image["height"], image["width"]) == (sample.camera.height, sample.camera.width)
    assert [image[key] for key in ("fx", "fy", "cx", "cy")] == [getattr(sample.camera, key) for key in ("fx", "fy", "cx", "cy")]
    if sample.has("colour"):
        assert (levels == sample.colour).all() and image["file_name"].startswith("rgb/")
        levels = picture(root / image["depth_file_name"])
    assert levels.dtype == np.uint16 and image["depth_scale"] == 1.0
    measured = ~np.isnan(sample.depth)
    assert ((levels > 0) == measured).all()
    return float(np.abs(levels[measured] - 1000.0 * sample.depth[measured]).max())


def main():
    root, dataset = Path(sys.argv[1]), graspmill.Dataset(sys.argv[2], graspmill.ViewSample)
    coco = json.loads((root / "instances.json").read_text(encoding="utf-8"))
    categories = {row["id"]: row for row in coco["categories"]}
    assert list(categories) == list(range(1, len(categories) + 1))
    assert len({note["id"] for note in coco["annotations"]}) == len(coco["annotations"])
    of_image = {}
    for note in coco["annotations"]:
        of_image.setdefault(note["image_id"], []).append(note)
    result = {"images": 0, "annotations": 0, "depth_mm": 0.0, "pycocotools": pycocotools_mask is not None}
    for image, sample in zip(coco["images"], dataset, strict=True):
        result["depth_mm"] = max(result["depth_mm"], check_image(root, image, sample))
        notes = of_image.get(image["id"], [])
        assert [note["instance"] for note in notes] == (np.flatnonzero(sample.pixels_visible) + 1).tolist()
        for note in notes:
            body = note["instance"]
            seen, alone = mask_of(note, "segmentation"), mask_of(note, "amodal_segmentation")
            assert (seen == sample.visible_mask(body)).all() and (alone == sample.mask(body)).all()
            left, top, width, height = inclusive_box(seen)
            assert note["bbox"] == [left, top, width + 1, height + 1] and note["area"] == seen.sum()
            assert note["amodal_bbox"] == sample.whole_boxes[body - 1].tolist()
            assert note["amodal_area"] == sample.pixels_all[body - 1]
            assert categories[note["category_id"]]["object"] == sample.objects[body - 1] and note["iscrowd"] == 0
        result["images"] += 1
        result["annotations"] += len(notes)
    print(json.dumps(result))


main()
