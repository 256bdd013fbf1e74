"""Amodal pairs of a dataset against trimesh and libigl: points on the body's own mesh, cells of solids, cells of what is seen.

    amodal.py PAIRS VIEWS COUNT

COUNT pairs, spread over the dataset, are examined:
- every point of the cloud, moved into the object's frame: largest distance to the mesh [m];
- cells of the partial grid that hold no point, and points in no cell of it;
- cells whose centre trimesh finds inside the whole body and that `complete` lacks, and cells of it that lie farther from the mesh than
  half their diagonal and outside;
- the same of `others_solid` against all other bodies, the container's walls as boxes of our own, and the half-space below the table;
- cells of `others_seen` against the depth of the view's other pixels.
Meshes and images come out of the dataset of views. Prints counts as JSON.
"""

import json
import sys

import graspmill
import igl
import numpy as np
import trimesh
from pixels import walls_of


def moved(points, pose):
    return points @ pose[:3, :3].T + pose[:3, 3]


def distances(mesh, points):
    """Distance of each point to a mesh, by libigl: trimesh's own is off by 0.1 mm beside tiny triangles."""
    return np.sqrt(igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)[0])


def compare(cells, solids, centres, half):
    """Count of centres inside a solid whose cell is not set; which set cells reach no solid."""
    flat = cells.reshape(-1)
    inside, near = np.zeros(len(centres), bool), np.zeros(len(centres), bool)
    for mesh, to_mesh in solids:
        local = moved(centres, to_mesh)
        low, high = mesh.bounds
        close = ((local > low - half) & (local < high + half)).all(1)
        if mesh.is_watertight and close.any():
            inside[close] |= mesh.contains(local[close])
        asked = close & flat & ~inside & ~near
        if asked.any():
            near[asked] |= distances(mesh, local[asked]) <= half
    return int((inside & ~flat).sum()), flat & ~inside & ~near


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.AmodalSample)
    views = graspmill.Dataset(sys.argv[2], graspmill.ViewSample)
    by_id = {(view.id.subject, view.id.item): place for place, view in enumerate(views)}
    meshes = {
        mesh.object: trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        for mesh in graspmill.object_meshes(sys.argv[2]).values()
    }
    names = ("pairs", "points", "empty_cells", "stray_points", "missing", "excess", "others_missing", "others_excess", "seen_differ")
    result = dict.fromkeys(names, 0) | {"worst_point": 0.0}
    for index in np.linspace(0, len(data) - 1, min(int(sys.argv[3]), len(data))).round().astype(int):
        sample = data[int(index)]
        pair, clutter = sample.pair, sample.clutter
        view = views[by_id[pair.sample.subject, pair.sample.item]]
        grid, n = pair.grid, sample.resolution
        own = meshes[clutter.object]
        assert view.objects[clutter.instance - 1] == clutter.object
        assert clutter.pixels_visible == view.pixels_visible[clutter.instance - 1]
        assert clutter.pixels_all == view.pixels_all[clutter.instance - 1]

        cloud = sample.cloud.astype(np.float64)
        object_from_camera = np.linalg.inv(pair.camera_from_object)
        apart = distances(own, moved(cloud, object_from_camera))
        result["pairs"] += 1
        result["points"] += len(cloud)
        result["worst_point"] = max(result["worst_point"], float(apart.max()))

        corner, side = np.asarray(grid.lower_corner), grid.cell_size
        # Stored points are rounded to single precision: below 1 m by up to 2^-25 m.
        held = np.floor((cloud - corner + 2**-25) / side).astype(int)
        below = np.floor((cloud - corner - 2**-25) / side).astype(int)
        fits = ((held >= 0) & (held < n)).all(1)
        filled = np.zeros((n, n, n), bool)
        filled[tuple(held[fits].T)] = True
        either = filled.copy()
        fits = ((below >= 0) & (below < n)).all(1)
        either[tuple(below[fits].T)] = True
        result["empty_cells"] += int((sample.partial & ~either).sum())
        result["stray_points"] += int((filled & either & ~sample.partial & ~rim(held, below, n)).sum())

        cells = np.indices((n, n, n)).reshape(3, -1).T
        centres = corner + (cells + 0.5) * side
        half = side * np.sqrt(3) / 2 + 1e-6
        missing, excess = compare(sample.complete, [(own, object_from_camera)], centres, half)
        result["missing"] += missing
        result["excess"] += int(excess.sum())

        world_from_camera = pair.world_from_camera
        solids = [
            (meshes[digest], np.linalg.inv(pose) @ world_from_camera)
            for number, (digest, pose) in enumerate(zip(view.objects, view.world_from_object), 1)
            if number != clutter.instance
        ]
        parts, table = walls_of(view)
        solids += [(part, world_from_camera) for part in parts]
        missing, excess = compare(clutter.others_solid, solids, centres, half)
        heights = moved(centres, world_from_camera)[:, 2]
        reach = np.abs(world_from_camera[2, :3]).sum() * side / 2
        result["others_missing"] += missing + int(((heights - reach < table - 1e-9) & ~clutter.others_solid.reshape(-1)).sum())
        result["others_excess"] += int((excess & (heights - reach > table + 1e-9)).sum())

        camera, depth = view.camera, view.depth.astype(np.float64)
        seen = (view.point_instances != clutter.instance) & ~np.isnan(depth)
        rows, columns = np.nonzero(seen)
        depth = depth[seen]
        points = np.stack(
            [(columns + 0.5 - camera.cx) / camera.fx * depth, (rows + 0.5 - camera.cy) / camera.fy * depth, depth], axis=1
        )
        at = np.floor((points - corner) / side).astype(int)
        at = at[((at >= 0) & (at < n)).all(1)]
        expected = np.zeros((n, n, n), bool)
        expected[tuple(at.T)] = True
        result["seen_differ"] += int((expected != clutter.others_seen).sum())
    print(json.dumps(result))


def rim(held, below, n):
    """Cells at whose border a point lies: rounding puts it on either side."""
    cells = np.zeros((n, n, n), bool)
    apart = held[(held != below).any(1)]
    apart = apart[((apart >= 0) & (apart < n)).all(1)]
    cells[tuple(apart.T)] = True
    return cells


if __name__ == "__main__":
    main()
