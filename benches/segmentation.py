"""Objects in depth images with known labels: how many `graspmill segment` finds, beside DBSCAN with 1 cm.

    segmentation.py [--views DATASET]... [--graspmill PROGRAM]

--views names datasets of views of scenes with a sensor. GRASPMILL_SAMPLES may name a folder that contains labelled clouds of the Object
Segmentation Database (`*learn*.pcd`: organised, with fields z and label, 20 for the first object, then in steps of 10).

Printed per source, for objects with at least 100 points:
  found   share of the objects whose intersection over union with one part is at least 0.6
  merged  objects of which more than half is in a part that has more than half of another object
  split   objects of which a tenth is in each of two parts or more
  F       mean F-score with the best part
  ms      time of the segmentation per image, median and longest
Then the share of the parts that are an object (intersection over union of at least 0.6), by their confidence.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from graspmill import Dataset, ViewSample
from graspmill.segmenting import CONTAINER_LABEL, PLANE_LABEL, Segmentation, read_segmentation

LEAST = 100
"""Smallest objects and parts [points]."""
STEP = 0.01
"""Largest step between points of one cluster of DBSCAN [m]."""
LEVELS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.01)
"""Limits of the confidences that are counted together."""


class Frame(NamedTuple):
    """An image with its labels and the results of the program."""

    truth: NDArray[np.int64]
    points: NDArray[np.float64]
    scene: Segmentation
    milliseconds: float


def lzf(data: bytes, size: int) -> bytes:
    """Decompresses a block of LZF (Lehmann): literal runs, and copies of what was written before."""
    out, at = bytearray(), 0
    while at < len(data):
        control = data[at]
        at += 1
        if control < 32:
            out += data[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[at]
            at += 1
        start = len(out) - ((control & 31) << 8 | data[at]) - 1
        at += 1
        for offset in range(length + 2):
            out.append(out[start + offset])
    if len(out) != size:
        raise ValueError(f"{len(out)} bytes, not {size}")
    return bytes(out)


def read_cloud(path: Path) -> dict[str, NDArray[Any]]:
    """Fields of an organised PCD with compressed data, each of shape (height, width)."""
    content = path.read_bytes()
    end = content.index(b"\n", content.index(b"DATA binary_compressed")) + 1
    head = {words[0]: words[1:] for words in map(str.split, content[:end].decode("ascii").splitlines()) if words}
    width, height = int(head["WIDTH"][0]), int(head["HEIGHT"][0])
    packed, size = np.frombuffer(content, "<u4", 2, end).tolist()
    data = lzf(content[end + 8 : end + 8 + packed], size)
    fields, at = {}, 0
    for name, bytes_of, kind in zip(head["FIELDS"], head["SIZE"], head["TYPE"], strict=True):
        values = np.frombuffer(data, f"<{kind.lower()}{bytes_of}", width * height, at)
        fields[name], at = values.reshape(height, width), at + values.nbytes
    return fields


def segmented(command: list[str]) -> tuple[Segmentation, float]:
    """Results of the program, and its time for the segmentation [ms]."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "scene"
        done = subprocess.run([*command, "--out", str(out)], capture_output=True, text=True, check=False)
        if done.returncode not in (0, 3):
            sys.exit(done.stderr)
        times = json.loads((out / "scene.json").read_text(encoding="utf-8"))["milliseconds"]
        return read_segmentation(out), times["segment"]


def of_views(program: str, folder: str) -> Iterator[Frame]:
    """Images of a dataset of views."""
    for sample in Dataset(folder, ViewSample):
        camera, depth = sample.camera, np.asarray(sample.depth, dtype="<f4")
        truth = sample.point_instances.astype(np.int64)
        # From 253: between two bodies, container, table.
        truth[truth >= 253] = 0
        with tempfile.TemporaryDirectory() as place:
            image = Path(place) / "depth.npy"
            np.save(image, depth)
            numbers = f"{camera.fx!r},{camera.fy!r},{camera.cx!r},{camera.cy!r}"
            command = [program, "segment", str(image), f"--intrinsics={numbers}", "--pixel-centre", "0.5"]
            scene, milliseconds = segmented(command)
        rows, columns = np.indices(depth.shape) + 0.5
        points = np.stack([(columns - camera.cx) / camera.fx * depth, (rows - camera.cy) / camera.fy * depth, depth], -1)
        yield Frame(truth, points.astype(np.float64), scene, milliseconds)


def of_clouds(program: str, folder: str) -> Iterator[Frame]:
    """Labelled clouds of a folder."""
    for path in sorted(Path(folder).rglob("*learn*.pcd")):
        fields = read_cloud(path)
        truth = fields["label"].astype(np.int64)
        truth = np.where(truth < 20, 0, truth // 10)
        points = np.stack([fields[name] for name in "xyz"], -1).astype(np.float64)
        yield Frame(truth, points, *segmented([program, "segment", str(path)]))


def dbscan(frame: Frame) -> NDArray[np.int64]:
    """Clusters of DBSCAN whose points are all core points (`min_points = 1`): chains of steps. Points on the plane and the container
    belong to none, as those up to 8 mm above the plane in the program."""
    parts = np.zeros(frame.truth.shape, np.int64)
    used = np.isfinite(frame.points).all(axis=-1) & ~np.isin(frame.scene.labels, (PLANE_LABEL, CONTAINER_LABEL))
    if (plane := frame.scene.plane) is not None:
        used &= np.nan_to_num(frame.points) @ plane.normal + plane.offset > 0.008
    points = frame.points[used]
    pairs = cKDTree(points).query_pairs(STEP, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    names = connected_components(graph, directed=False)[1] + 1
    names[np.bincount(names)[names] < LEAST] = 0
    parts[used] = names
    return parts


def overlaps(frame: Frame, parts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Counts of points: shared by each object (rows) and part (columns), of each object, and of each part."""
    seen = np.isfinite(frame.points).all(axis=-1)
    truth, parts = frame.truth[seen], parts[seen]
    table = np.zeros((truth.max(initial=0) + 1, parts.max(initial=0) + 1), np.int64)
    np.add.at(table, (truth, parts), 1)
    return table[1:, 1:], table[1:].sum(axis=1), table[:, 1:].sum(axis=0)


def ious(shared: NDArray[np.int64], objects: NDArray[np.int64], parts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Intersection over union of each object and part."""
    union = objects[:, None] + parts[None, :] - shared
    return np.asarray(shared / np.maximum(union, 1), dtype=np.float64)


def report(name: str, frames: list[Frame]) -> None:
    """Prints the scores of a source."""

    def ours(frame: Frame) -> NDArray[np.int64]:
        labels = frame.scene.labels.astype(np.int64)
        return np.where(labels >= CONTAINER_LABEL, 0, labels)

    times = np.array([frame.milliseconds for frame in frames])
    print(f"{name}: {len(frames)} images, {np.median(times):.0f} ms in the median, {times.max():.0f} ms at most")
    for method, parts_of in (("graspmill", ours), ("DBSCAN, 1 cm", dbscan)):
        count = found = merged = split = 0
        scores = 0.0
        for frame in frames:
            shared, objects, parts = overlaps(frame, parts_of(frame))
            best = ious(shared, objects, parts).max(axis=1, initial=0.0)
            holds = (2 * shared > objects[:, None]) & (objects[:, None] > 0)
            large = objects >= LEAST
            count += int(large.sum())
            found += int((best[large] >= 0.6).sum())
            merged += int((holds[:, holds.sum(axis=0) > 1].any(axis=1) & large).sum())
            split += int((((10 * shared >= objects[:, None]).sum(axis=1) > 1) & large).sum())
            scores += float((2 * best[large] / (1 + best[large])).sum())
        rates = f"{found} found ({found / max(count, 1):.3f}), {merged} merged, {split} split, F {scores / max(count, 1):.3f}"
        print(f"  {method}: {count} objects, {rates}")
    rows = []
    for frame in frames:
        shared, objects, parts = overlaps(frame, ours(frame))
        right = ious(shared, objects, parts).max(axis=0, initial=0.0) >= 0.6
        rows += [(row.confidence, bool(right[row.label - 1])) for row in frame.scene.objects if row.label <= len(right)]
    for low, high in zip(LEVELS, LEVELS[1:], strict=False):
        some = [right for confidence, right in rows if low <= confidence < high]
        if some:
            print(f"  confidence from {low} to below {high}: {len(some)} parts, {np.mean(some):.2f} of them objects")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", action="append", default=[], metavar="DATASET")
    parser.add_argument("--graspmill", default=str(ROOT / "target/release/graspmill"), metavar="PROGRAM")
    given = parser.parse_args()
    if samples := os.environ.get("GRASPMILL_SAMPLES"):
        report("labelled clouds", list(of_clouds(given.graspmill, samples)))
    for folder in given.views:
        report(folder, list(of_views(given.graspmill, folder)))


if __name__ == "__main__":
    main()
