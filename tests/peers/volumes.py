"""Volumes of a dataset against other programs: distances fused again from the views' depth, and what is at each voxel's centre.

    volumes.py RULE VOLUMES VIEWS COUNT

COUNT volumes, spread over the dataset, are examined. RULE selects the program that fuses:
- numpy: an implementation of our own, in double precision, of the rule in docs/format.md;
- open3d: Open3D's `UniformTSDFVolume`, with whole numbers as pixel centres, in single precision.
A voxel counts as a tie when its centre projects to within 0.002 px of the border between two pixels of a fused image, or lies within
1e-5 m of the truncation behind what a pixel sees: there rounding decides what is seen. Everywhere else weights must be equal.
With trimesh, each centre that is farther than 0.1 mm from every mesh must be inside the body that the truth names, and in no other.
Prints counts as JSON.
"""

import json
import sys

import graspmill
import numpy as np

TIE_PIXELS, TIE_DEPTH = 0.002, 1e-5


def projected(sample, index, centres):
    """Pixel coordinates, depth along the axis, and pixel of each centre in one image of a volume."""
    camera = sample.intrinsics[index]
    pose = np.linalg.inv(sample.world_from_camera[index]) @ sample.world_from_volume
    points = centres @ pose[:3, :3].T + pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = camera.fx * points[:, 0] / points[:, 2] + camera.cx
        v = camera.fy * points[:, 1] / points[:, 2] + camera.cy
    inside = (points[:, 2] > 0) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    return u, v, points[:, 2], inside


def image_of(sample, index, centres, depth):
    """Distance of each centre in units of the truncation, whether the image updates it, and whether it is a tie."""
    camera = sample.intrinsics[index]
    u, v, along, inside = projected(sample, index, centres)
    with np.errstate(invalid="ignore"):
        near_border = np.minimum(np.abs(u - np.round(u)), np.abs(v - np.round(v))) < TIE_PIXELS
    column, row = np.where(inside, u, 0).astype(int), np.where(inside, v, 0).astype(int)
    seen = np.where(inside, depth[row, column].astype(float), np.nan)
    length = np.sqrt(((column + 0.5 - camera.cx) / camera.fx) ** 2 + ((row + 0.5 - camera.cy) / camera.fy) ** 2 + 1)
    distance = (seen - along) * length / sample.truncation
    says = (seen > 0) & (distance > -1)
    near_cut = np.abs(distance + 1) < TIE_DEPTH / sample.truncation
    return np.minimum(distance, 1), says, (near_border & (along > 0)) | near_cut


def fuse_by_numpy(sample, centres, depths):
    total, weights = np.zeros(len(centres)), np.zeros(len(centres))
    for index, depth in enumerate(depths):
        distance, says, _ = image_of(sample, index, centres, depth)
        total[says] += distance[says]
        weights += says
    return total / np.maximum(weights, 1), weights


def fuse_by_open3d(sample, centres, depths):
    import open3d as o3d

    # A cube of its own at the origin of the volume's frame; colours are not fused.
    n = sample.resolution
    volume = o3d.pipelines.integration.UniformTSDFVolume(
        length=sample.size, resolution=n, sdf_trunc=sample.truncation, color_type=o3d.pipelines.integration.TSDFVolumeColorType.NoColor
    )
    for index, depth in enumerate(depths):
        camera = sample.intrinsics[index]
        metres = np.ascontiguousarray(np.nan_to_num(depth, nan=0.0).astype(np.float32))
        colour = o3d.geometry.Image(np.zeros(metres.shape, np.uint8))
        image = o3d.geometry.RGBDImage.create_from_color_and_depth(
            colour, o3d.geometry.Image(metres), depth_scale=1.0, depth_trunc=1e6, convert_rgb_to_intensity=False
        )
        intrinsic = o3d.camera.PinholeCameraIntrinsic(
            camera.width, camera.height, camera.fx, camera.fy, camera.cx - 0.5, camera.cy - 0.5
        )
        volume.integrate(image, intrinsic, np.linalg.inv(sample.world_from_camera[index]) @ sample.world_from_volume)
    # Rows of value and weight, voxel (x, y, z) at (x n + y) n + z.
    rows = np.asarray(volume.extract_volume_tsdf())
    return rows[:, 0], rows[:, 1]


def moved(points, pose):
    return points @ pose[:3, :3].T + pose[:3, 3]


def compare_truth(sample, centres, meshes, found):
    """Counts the centres where trimesh and the truth differ."""
    import igl
    import trimesh

    world = moved(centres, sample.world_from_volume)
    near, inside = np.zeros(len(world), bool), np.zeros((len(sample.objects), len(world)), bool)
    for body, (name, world_from_object) in enumerate(zip(sample.objects, sample.world_from_object)):
        mesh = trimesh.Trimesh(meshes[name].vertices, meshes[name].triangles, process=False)
        local = moved(world, np.linalg.inv(world_from_object))
        close = ((local > mesh.bounds[0] - 1e-3) & (local < mesh.bounds[1] + 1e-3)).all(1)
        if not close.any():
            continue
        faces = np.asarray(mesh.faces, np.int64)
        near[close] |= np.sqrt(igl.point_mesh_squared_distance(local[close], np.asarray(mesh.vertices), faces)[0]) < 1e-4
        inside[body, close] = np.abs(igl.winding_number(np.asarray(mesh.vertices, float), faces, local[close])) > 0.5
    truth = sample.instances.reshape(-1)
    bodies = np.where((truth > 0) & (truth < 254), truth, 0)
    expected = np.where(inside.any(0), inside.argmax(0) + 1, 0)
    found["near_meshes"] += int(near.sum())
    found["occupied"] += int((bodies > 0).sum())
    found["truth_differs"] += int(((bodies != expected) & ~near).sum())


def main():
    rule, volumes, views, count = sys.argv[1:]
    data = graspmill.Dataset(volumes, graspmill.VolumeSample)
    images = graspmill.Dataset(views, graspmill.ViewSample)
    place = {(image.id.subject, image.id.item): index for index, image in enumerate(images)}
    meshes = {mesh.object: mesh for mesh in graspmill.object_meshes(views).values()}
    fuse = {"numpy": fuse_by_numpy, "open3d": fuse_by_open3d}[rule]
    found = dict.fromkeys(
        ("volumes", "voxels", "observed", "ties", "weights_differ", "weights_differ_at_ties", "near_meshes", "occupied", "truth_differs"), 0
    )
    worst = worst_at_ties = 0.0
    total = min(int(count), len(data))
    for index in np.linspace(0, len(data) - 1, total).astype(int):
        sample = data[int(index)]
        centres = (np.stack(np.unravel_index(np.arange(sample.resolution**3), 3 * [sample.resolution]), -1) + 0.5) * sample.voxel
        depths = [images[place[(sample.id.subject, int(view))]].depth for view in sample.views]
        values, weights = fuse(sample, centres, depths)
        ties = np.zeros(len(centres), bool)
        for image, depth in enumerate(depths):
            ties |= image_of(sample, image, centres, depth)[2]
        own, own_weights = sample.tsdf.reshape(-1), sample.weights.reshape(-1)
        differ = own_weights != weights
        error = np.where((own_weights > 0) & (weights > 0), np.abs(own - values), 0)
        found["volumes"] += 1
        found["voxels"] += len(centres)
        found["observed"] += int((own_weights > 0).sum())
        found["ties"] += int(ties.sum())
        found["weights_differ"] += int((differ & ~ties).sum())
        found["weights_differ_at_ties"] += int((differ & ties).sum())
        worst = max(worst, float(error[~ties].max()))
        worst_at_ties = max(worst_at_ties, float(error[ties].max(initial=0)))
        if rule == "numpy":
            compare_truth(sample, centres, meshes, found)
    print(json.dumps({**found, "worst": worst, "worst_at_ties": worst_at_ties}))


main()
