"""Quiet pixels, rays, and what Embree sees along them, for several comparisons of images."""

import numpy as np
import trimesh

NOTHING, CONTAINER, TABLE = 0, 254, 255
FAR = 1e9


def calm(labels):
    """Pixels whose neighbours, two pixels around, are alike."""
    same = np.ones(labels.shape, bool)
    for down in range(-2, 3):
        for right in range(-2, 3):
            same &= np.roll(labels, (down, right), (0, 1)) == labels
    same[:2] = same[-2:] = False
    same[:, :2] = same[:, -2:] = False
    return same


def directions(camera, world_from_camera):
    """(pixels, 3) directions of the rays through all pixels' centres in the world, as long as their depth is 1."""
    rows, columns = np.indices((camera.height, camera.width))
    x, y = (columns + 0.5 - camera.cx) / camera.fx, (rows + 0.5 - camera.cy) / camera.fy
    return np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3) @ world_from_camera[:3, :3].T


def walls_of(view):
    """Walls and floor of the container in the world, a bin's as boxes of our own, and the height below which the table is solid."""
    kind, sizes = view.container
    if kind == "plane":
        return [], 0.0
    if kind == "mesh":
        part = trimesh.Trimesh(*view.container_mesh, process=False)
        return [part], min(part.bounds[0][2], 0.0)
    x, y, z, wall = sizes[:4]
    tilt = np.radians(sizes[4]) if len(sizes) > 4 else 0.0
    shift = trimesh.transformations.translation_matrix
    parts = [trimesh.creation.box((x + 2 * wall, y + 2 * wall, wall), shift((0, 0, -wall / 2)))]
    for sign in (-1, 1):
        parts.append(trimesh.creation.box((wall, y + 2 * wall, z + wall), shift((sign * (x + wall) / 2, 0, (z - wall) / 2))))
        parts.append(trimesh.creation.box((x + 2 * wall, wall, z + wall), shift((0, sign * (y + wall) / 2, (z - wall) / 2))))
    for part in parts:
        part.apply_transform(trimesh.transformations.rotation_matrix(tilt, (1, 0, 0)))
    return parts, min(part.bounds[0][2] for part in parts)


def fixed_meshes(view):
    """Container and table, a bin out of boxes of our own, and a rectangle of our own."""
    parts, floor = walls_of(view)
    meshes = [(CONTAINER, trimesh.util.concatenate(parts))] if parts else []
    half = np.asarray(view.table_size) / 2
    corners = [(sx * half[0], sy * half[1], floor) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    meshes.append((TABLE, trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3)], process=False)))
    return meshes


def depth_of(mesh, camera, world_from_camera):
    """(height, width) depth along the optical axis by Embree, FAR where nothing is hit."""
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    rays = directions(camera, world_from_camera)
    origins = np.tile(world_from_camera[:3, 3], (len(rays), 1))
    triangles, ray_numbers, points = RayMeshIntersector(mesh).intersects_id(origins, rays, multiple_hits=False, return_locations=True)
    depth = np.full(len(rays), FAR)
    # Along the axis: the point in the plane of the triangle that was hit, in double precision.
    corners = mesh.triangles[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.einsum("ij,ij->i", normals, corners[:, 0] - origins[ray_numbers])
    speed = np.einsum("ij,ij->i", normals, rays[ray_numbers])
    exact = np.abs(speed) > 1e-15
    depth[ray_numbers[exact]] = along[exact] / speed[exact]
    return depth.reshape(camera.height, camera.width)
