"""Reads all that the Python package can read of each folder, and prints one line for each: `read`, `refused` with the
error, or `broken` with an error that the package does not promise."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Any

import graspmill
import numpy as np
from graspmill import completion

PROPERTIES = {
    "completion": {
        "pair": ("id", "pair", "partial", "complete"),
        "visibility": ("free",),
        **{name: (name,) for name in ("depth", "cloud", "tsdf", "coverage", "implicit", "occlusion")},
        **{name: ("touch", "tactile", "seen_or_touched") for name in completion.TOUCH},
    },
    "reachability": {"block": ("id", "labels", "proofs", "witnesses")},
    "grasps": {"run": ("id", "run", "grasps", "contacts"), "trials": ("trials", "trial_contacts")},
    "patches": {
        "patch": ("id", "camera", "camera_from_object", "object_from_approach", "depth", "labels", "corners", "pixels")
        + ("type_index", "types"),
        "colour": ("rgb", "rgbd"),
        **{name: (name,) for name in ("image", "image_colour", "heatmap")},
    },
}


def steps(folder: str) -> Iterator[Callable[[], Any]]:
    """Queries of a reader, each run separately: a refused one hides no other."""
    yield lambda: graspmill.Dataset(folder)
    with contextlib.suppress(graspmill.DatasetError):
        data = graspmill.Dataset(folder)
        samples = []
        for place in range(len(data)):
            yield lambda: data[place]
            with contextlib.suppress(graspmill.DatasetError):
                samples.append(data[place])
        for sample in samples:
            for channel, names in PROPERTIES.get(data.folder.product, {}).items():
                for name in names if sample.has(channel) else ():
                    yield lambda: getattr(sample, name)
        yield lambda: data.gather(range(len(data)))
        yield lambda: (data.objects, data.frame(), data.index.frame(), data.folder.objects(), data.folder.splits())
        yield lambda: list(graspmill.ShuffledChunks(data))
        if data.folder.product == "completion":
            yield lambda: graspmill.PairBatch.of(samples) if samples else None
        if data.folder.product == "grasps":
            yield lambda: graspmill.grasp_frame(data)
            yield lambda: graspmill.object_meshes(folder)
            yield lambda: graspmill.resting_poses(folder)
        if data.folder.product == "patches":
            yield lambda: data.folder.types()
        if data.folder.product == "reachability":
            poses = np.zeros((3, 6))
            yield lambda: graspmill.ReachabilityField(folder).distance_and_gradient(poses)
            yield lambda: graspmill.ReachabilityField(folder).nearest(poses)
            yield lambda: graspmill.ReachabilityField(folder).witnesses()


def read(folder: str) -> str:
    """Outcome of reading a folder, in a line."""
    refused = None
    for step in steps(folder):
        try:
            step()
        except graspmill.DatasetError as error:
            refused = refused or error
        except (MemoryError, Exception) as error:
            place = error.__traceback__
            while place is not None and place.tb_next is not None:
                place = place.tb_next
            where = f"{place.tb_frame.f_code.co_filename}:{place.tb_lineno}" if place else ""
            return f"broken {type(error).__name__} at {where}: {error}"
    return f"refused {refused}" if refused else "read"


for given in sys.argv[1:]:
    print(read(given).replace("\n", " "), flush=True)
