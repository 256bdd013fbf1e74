"""Compares occluders in front of objects with Embree: the pixels that they hide, the remaining depth, the visibly free space.

occlusion.py OCCLUDED FREE SCANS. Two datasets of one job, with and without occluders, with depth images and visibility. An
occluder is the convex hull of its corners, made by trimesh. Prints one JSON object.
"""

import json
import sys
from pathlib import Path

import numpy as np
import trimesh
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from trimesh.ray.ray_pyembree import RayMeshIntersector

names = {}
meshes = {}


def records(data):
    """The messages of each sample by its subject and item, and by topic."""
    names.update({row["object"]: row["name"] for row in json.loads((data / "assets.json").read_text())["objects"]})
    found = {}
    for shard in sorted((data / "shards").glob("*.mcap")):
        with shard.open("rb") as file:
            for _, channel, _, record in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
                found.setdefault((record.sample.subject, record.sample.item), {})[channel.topic] = record
    return found


def mesh_of(subject):
    name = names[subject.hex()]
    if name not in meshes:
        meshes[name] = trimesh.load(Path(sys.argv[3]) / f"{name}.stl")
    return meshes[name]


def plane(bits, n):
    return np.unpackbits(np.frombuffer(bits, np.uint8), bitorder="little", count=n**3).reshape(n, n, n) > 0


def image(depth, camera):
    whole = np.full((camera.height, camera.width), np.nan)
    crop = np.frombuffer(depth.data, "<f4").reshape(depth.height, depth.width)
    whole[depth.top : depth.top + depth.height, depth.left : depth.left + depth.width] = crop
    return whole


def mask_of(occlusion, camera):
    whole = np.zeros((camera.height, camera.width), bool)
    bits = np.unpackbits(np.frombuffer(occlusion.mask, np.uint8), bitorder="little")
    crop = bits[: occlusion.height * occlusion.width].reshape(occlusion.height, occlusion.width) > 0
    whole[occlusion.top : occlusion.top + occlusion.height, occlusion.left : occlusion.left + occlusion.width] = crop
    return whole


def depth_by_embree(mesh, camera, rows, columns):
    """Depth of the first hit of the rays through pixel centres; NaN without one."""
    rays = np.stack([(columns + 0.5 - camera.cx) / camera.fx, (rows + 0.5 - camera.cy) / camera.fy, np.ones(len(rows))], 1)
    triangles = RayMeshIntersector(mesh).intersects_first(np.zeros_like(rays), rays)
    depth = np.full(len(rows), np.nan)
    hit = triangles >= 0
    # Exact plane hit: Embree's own distance is single precision.
    normals, corners = mesh.face_normals[triangles[hit]], mesh.triangles[triangles[hit], 0]
    depth[hit] = (normals * corners).sum(axis=1) / (normals * rays[hit]).sum(axis=1)
    return depth


def points_of(whole, camera):
    row, column = np.nonzero(np.isfinite(whole))
    z = whole[row, column]
    return np.stack([(column + 0.5 - camera.cx) / camera.fx * z, (row + 0.5 - camera.cy) / camera.fy * z, z], axis=1)


def cells_of(points, grid):
    n = grid.resolution
    centre = np.array([grid.centre_x, grid.centre_y, grid.centre_z])
    index = np.floor((points - centre) / grid.cell_size + np.array([0.5, 0.5, 0.45]) * n).astype(int)
    index = index[((index >= 0) & (index < n)).all(axis=1)]
    cells = np.zeros((n, n, n), bool)
    cells[tuple(index.T)] = True
    return cells


occluded, free = records(Path(sys.argv[1])), records(Path(sys.argv[2]))
facts = {"occluded": 0, "kinds": {}, "pixels": 0, "hits_unlike": 0, "mask_pixels": 0, "mask_unlike": 0, "worst_depth": 0.0}
facts |= {"counts_unlike": 0, "cells_added": 0, "partials_unlike": 0, "behind": 0, "free_behind": 0, "unseen_in_front": 0}
shares = []
for key, record in occluded.items():
    occlusion, pair = record["/completion/occlusion"], record["/completion/pair"]
    if occlusion.kind == "none" or key not in free:
        continue
    camera, alone = pair.camera, free[key]
    before, after = image(alone["/completion/depth"], camera), image(record["/completion/depth"], camera)
    mask = mask_of(occlusion, camera)
    facts["occluded"] += 1
    facts["kinds"][occlusion.kind] = facts["kinds"].get(occlusion.kind, 0) + 1

    # Object and occluder by Embree, in the camera's frame.
    pose = np.vstack([np.array(pair.camera_from_object).reshape(3, 4), [0, 0, 0, 1]])
    thing = mesh_of(key[0]).copy()
    thing.apply_transform(pose)
    front = trimesh.convex.convex_hull(np.frombuffer(occlusion.corners, "<f4").reshape(-1, 3).astype(float))
    rows, columns = np.nonzero(np.isfinite(before) | np.isfinite(after))
    of_thing, of_front = (depth_by_embree(mesh, camera, rows, columns) for mesh in (thing, front))
    seen = np.isfinite(of_thing) & ~(of_front < of_thing)
    stored = after[rows, columns]
    facts["pixels"] += len(rows)
    facts["hits_unlike"] += int((seen != np.isfinite(stored)).sum())
    both = seen & np.isfinite(stored)
    facts["worst_depth"] = max(facts["worst_depth"], float(abs(of_thing - stored)[both].max()))
    hidden = int((np.isfinite(before) & mask).sum())
    whole = int(np.isfinite(before).sum())
    counts = whole, hidden, int(np.isfinite(after).sum())
    stated = occlusion.object_pixels, occlusion.hidden_pixels, occlusion.object_pixels - occlusion.hidden_pixels
    facts["counts_unlike"] += int(counts != stated)
    shares.append(hidden / whole)

    # Every seventh pixel of the image sees the occluder or does not.
    rows, columns = (axis.ravel() for axis in np.mgrid[0 : camera.height : 7, 0 : camera.width : 7])
    of_front = depth_by_embree(front, camera, rows, columns)
    facts["mask_pixels"] += len(rows)
    facts["mask_unlike"] += int((np.isfinite(of_front) != mask[rows, columns]).sum())

    # Pixels that are left make the grid and the partial; on the grid of the whole it marks no cell that the whole does not.
    n, points = pair.grid.resolution, points_of(after, camera)
    low, high = points.min(axis=0), points.max(axis=0)
    near = abs(np.array([pair.grid.centre_x, pair.grid.centre_y, pair.grid.centre_z]) - (low + high) / 2).max() < 1e-12
    near &= abs(pair.grid.cell_size - (high - low).max() / (0.8 * n)) < 1e-12
    facts["partials_unlike"] += int(not near or (cells_of(points, pair.grid) != plane(pair.partial, n)).any())
    alone = alone["/completion/pair"]
    facts["cells_added"] += int((cells_of(points, alone.grid) & ~plane(alone.partial, n)).sum())

    # A cell whose pixel sees the occluder in front of its centre is not free; one in front of the occluder is.
    index = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
    centres = (index + 0.5 - np.array([0.5, 0.5, 0.45]) * n) * pair.grid.cell_size
    centres += np.array([pair.grid.centre_x, pair.grid.centre_y, pair.grid.centre_z])
    column = np.floor(centres[:, 0] / centres[:, 2] * camera.fx + camera.cx).astype(int)
    row = np.floor(centres[:, 1] / centres[:, 2] * camera.fy + camera.cy).astype(int)
    inside = (row >= 0) & (row < camera.height) & (column >= 0) & (column < camera.width)
    covered = np.zeros(n**3, bool)
    covered[inside] = mask[row[inside], column[inside]]
    where = np.nonzero(covered)[0]
    of_front = depth_by_embree(front, camera, row[where], column[where])
    seen_free = plane(record["/completion/visibility"].free, n).reshape(-1)[where]
    partial = plane(pair.partial, n).reshape(-1)[where]
    behind, in_front = of_front < centres[where, 2] - 1e-6, of_front > centres[where, 2] + 1e-6
    facts["behind"] += int(behind.sum())
    facts["free_behind"] += int((behind & seen_free).sum())
    facts["unseen_in_front"] += int((in_front & ~seen_free & ~partial).sum())
facts |= {"least_share": min(shares), "greatest_share": max(shares), "mean_share": float(np.mean(shares))}
print(json.dumps(facts))
