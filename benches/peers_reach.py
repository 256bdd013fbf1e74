"""TRAC-IK and coal beside graspmill on the Fetch, in one run.

Poses: graspmill labels all 675,840 of the grid without collisions, on one thread. TRAC-IK (speed mode, 5 ms, 1e-6, the
start drawn at random; it takes two threads, a Newton method and an optimiser side by side) gets 2,000 of those that have a
solution, and 2,000 of those that have none: time a query, and how many of the first it misses. The poses of the second sort
are proved to have none, so what it found there would be wrong.

Collisions: coal's triangle meshes on 20,000 random configurations of the mesh Fetch; graspmill's time a check is that of
`cargo bench --bench reachability -- collision`. The whole map: graspmill's program with the meshes.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from trac_ik import TracIK

ROOT = Path(__file__).parent.parent
JOB, SCENE = ROOT / "jobs/fetch-reachability.toml", ROOT / "scenes/fetch.xml"
MESH_JOB, MESH_SCENE = ROOT / "jobs/fetch-reachability-meshes.toml", ROOT / "scenes/fetch_meshes.xml"
CELLS = 2000
CONFIGURATIONS = 20_000


def urdf(model: mujoco.MjModel, joints: list[str]) -> str:
    """The arm as a chain of links: every joint turns about an axis through its body's origin."""
    text = ['<robot name="arm"><link name="root"/>']
    parent, place = "root", np.zeros(3)
    first = model.jnt_bodyid[model.joint(joints[0]).id]
    above = model.body_parentid[first]
    while above:
        place, above = place + model.body_pos[above], model.body_parentid[above]
    for name in joints:
        joint = model.joint(name).id
        body = model.jnt_bodyid[joint]
        assert np.array_equal(model.body_quat[body], [1, 0, 0, 0]) and not model.jnt_pos[joint].any()
        x, y, z = (place + model.body_pos[body]).tolist()
        low, high = model.jnt_range[joint].tolist()
        limited = model.jnt_limited[joint]
        limit = f'lower="{low!r}" upper="{high!r}" ' if limited else ""
        text.append(
            f'<link name="{name}_link"/><joint name="{name}" type="{"revolute" if limited else "continuous"}">'
            f'<parent link="{parent}"/><child link="{name}_link"/><origin xyz="{x!r} {y!r} {z!r}" rpy="0 0 0"/>'
            f'<axis xyz="{" ".join(map(str, model.jnt_axis[joint]))}"/><limit {limit}effort="1" velocity="1"/></joint>'
        )
        parent, place = f"{name}_link", np.zeros(3)
    return "".join(text) + "</robot>"


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    def about(axis: int, angle: float) -> np.ndarray:
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
        return turn

    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--graspmill", type=Path, required=True)
    program = parser.parse_args().graspmill.resolve()
    joints = poses(program)
    collisions(program, joints)


def seconds_of(command: list) -> float:
    began = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - began


def poses(program: Path) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        run = [program, "run", JOB, "--out", f"{folder}/map", "--threads", "1", "--set", "collisions=none"]
        seconds = seconds_of(run)
        with open(f"{folder}/map/field.mcap", "rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            field = next(message for *_, message in reader.iter_decoded_messages())
        labels = np.frombuffer(field.labels, "u1").reshape([axis.count for axis in field.axes])
        axes = [axis.first + axis.step * np.arange(axis.count) for axis in field.axes]
        model = mujoco.MjModel.from_xml_path(str(SCENE))
        (Path(folder) / "arm.urdf").write_text(urdf(model, list(field.joints)))
        tip = f"{field.joints[-1]}_link"
        solver = TracIK("root", tip, f"{folder}/arm.urdf", timeout=0.005, epsilon=1e-6, solver_type="Speed")
    ours = 1e6 * seconds / labels.size
    print(f"graspmill, whole program, labels without collisions: {ours:.2f} us a pose, {(labels > 0).sum()} with a solution")

    draw = np.random.default_rng(1)
    low = np.where(model.jnt_limited, model.jnt_range[:, 0], -np.pi)
    high = np.where(model.jnt_limited, model.jnt_range[:, 1], np.pi)
    places = [model.joint(name).id for name in field.joints]
    for solvable, name in [(True, "with a solution"), (False, "without one")]:
        cells = draw.choice(np.flatnonzero((labels > 0) == solvable), CELLS, replace=False)
        found, times = 0, []
        for cell in np.stack(np.unravel_index(cells, labels.shape), -1):
            pose = [axis[place] for axis, place in zip(axes, cell)]
            start = draw.uniform(low[places], high[places])
            turn = rotation(*pose[3:])
            began = time.perf_counter()
            q = solver.ik(np.array(pose[:3]), turn, seed_jnt_values=start)
            times.append(time.perf_counter() - began)
            if q is not None:
                data = mujoco.MjData(model)
                data.qpos[model.jnt_qposadr[places]] = q
                mujoco.mj_kinematics(model, data)
                site = model.site(field.target).id
                off = np.abs(data.site_xpos[site] - pose[:3]).max()
                turned = np.abs(data.site_xmat[site].reshape(3, 3) - turn).max()
                found += bool(off < 1e-5 and turned < 1e-5)
        times = 1e6 * np.array(times)
        print(
            f"TRAC-IK, {CELLS} poses {name}: {found} found, {times.mean():.0f} us a query (half of them below "
            f"{np.median(times):.0f} us)"
        )
    return list(field.joints)


def collisions(program: Path, joints: list[str]) -> None:
    model = mujoco.MjModel.from_xml_path(str(MESH_SCENE))
    check = [program, "robot", "check", MESH_SCENE, "--joints", ",".join(joints), "--target", "wrist_roll_link"]
    facts = json.loads(subprocess.run([*check, "--samples", "1", "--json"], check=True, capture_output=True).stdout)
    pairs = [pair["bodies"] for pair in facts["pairs"] if pair["rule"] == "checked"]
    draw = np.random.default_rng(2)
    values = np.empty((CONFIGURATIONS, len(joints)))
    for column, name in zip(values.T, joints):
        joint = model.joint(name).id
        low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.pi, np.pi)
        column[:] = draw.uniform(low, high, CONFIGURATIONS)
    question = {"scene": str(MESH_SCENE), "site": "wrist_roll_link", "joints": joints, "fixed": {}, "pairs": pairs}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "question.json").write_text(json.dumps(question))
        values.tofile(f"{folder}/values")
        command = [sys.executable, ROOT / "tests/peers/collision.py", folder]
        facts = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        colliding = np.fromfile(f"{folder}/collides", "u1").mean()
        print(
            f"coal, {len(pairs)} pairs, {100 * colliding:.1f} % collide: {facts['coal']:.1f} us a configuration in "
            f"{facts['calls'] / CONFIGURATIONS:.1f} calls, after {facts['balls']:.1f} us of numpy for the balls around links"
        )
        for threads in [1, 2]:
            seconds = seconds_of([program, "run", MESH_JOB, "--out", f"{folder}/map{threads}", "--threads", str(threads)])
            print(f"graspmill, the map with meshes, whole program, {threads} threads: {seconds:.1f} s")


main()
