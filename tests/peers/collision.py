"""Results of MuJoCo's forward kinematics and coal's triangle meshes for configurations that a test leaves in a folder.

question.json: {scene, site, joints, fixed, pairs}, pairs of body names; values: a row of f64 a configuration. Writes
poses (f64: the site's origin, then its rotation, row-major) and collides (u8: 1 where a pair touches); prints JSON:
configurations, how many of coal's calls they took, and the microseconds a configuration of these calls, of the test of
balls before them, and of both.

A mesh is the triangles of its STL, as written, under oriented boxes and spheres (OBBRSS); every other geom is a box.
collision.py FOLDER
"""

import json
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import coal
import mujoco
import numpy as np


def triangles(path):
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return np.frombuffer(data, facet, count, 84)["corners"].astype(float)


def mesh(path):
    corners = triangles(path)
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(corners), 3 * len(corners))
    for triangle in corners:
        model.addTriangle(*triangle)
    model.endModel()
    return model, corners.reshape(-1, 3)


def bodies(scene):
    """Name of a body: its shape, corners, and place in the body. One geom a body, turned nowhere."""
    root = ElementTree.parse(scene).getroot()
    folder = scene.parent / root.find("compiler").get("meshdir")
    files = {asset.get("name"): folder / asset.get("file") for asset in root.iter("mesh")}
    found = {}
    for body in root.iter("body"):
        for geom in body.findall("geom"):
            assert body.get("name") not in found and not set(geom.attrib) & {"quat", "euler", "axisangle"}
            place = np.array([float(number) for number in geom.get("pos", "0 0 0").split()])
            if geom.get("type") == "box":
                half = np.array([float(number) for number in geom.get("size").split()])
                signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
                found[body.get("name")] = coal.Box(*(2 * half)), signs * half, place
            else:
                found[body.get("name")] = *mesh(files[geom.get("mesh")]), place
    return found


def main(folder):
    folder = Path(folder)
    question = json.loads((folder / "question.json").read_text())
    scene = Path(question["scene"])
    values = np.fromfile(folder / "values", "<f8").reshape(-1, len(question["joints"]))
    count = len(values)
    shapes = bodies(scene)
    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    for name, value in question["fixed"].items():
        data.qpos[model.jnt_qposadr[model.joint(name).id]] = value
    address = [model.jnt_qposadr[model.joint(name).id] for name in question["joints"]]
    site = model.site(question["site"]).id
    names = sorted({name for pair in question["pairs"] for name in pair})
    ids = [model.body(name).id for name in names]
    places, turns = np.empty((len(names), count, 3)), np.empty((len(names), count, 3, 3))
    poses = np.empty((count, 12))
    for row, q in enumerate(values):
        data.qpos[address] = q
        mujoco.mj_kinematics(model, data)
        poses[row, :3], poses[row, 3:] = data.site_xpos[site], data.site_xmat[site]
        places[:, row], turns[:, row] = data.xpos[ids], data.xmat[ids].reshape(-1, 3, 3)
    poses.tofile(folder / "poses")
    for name, place, turn in zip(names, places, turns):
        place += turn @ shapes[name][2]

    began = time.perf_counter()
    middle = {name: shapes[name][1].mean(axis=0) for name in names}
    radius = {name: np.linalg.norm(shapes[name][1] - middle[name], axis=1).max() + 1e-9 for name in names}
    balls = {name: place + turn @ middle[name] for name, place, turn in zip(names, places, turns)}
    near = []
    for one, other in question["pairs"]:
        apart = balls[one] - balls[other]
        near.append(np.einsum("ij,ij->i", apart, apart) <= (radius[one] + radius[other]) ** 2)
    near = np.array(near).T
    filtering = time.perf_counter() - began

    order = {name: place for place, name in enumerate(names)}
    pairs = [(order[one], shapes[one][0], order[other], shapes[other][0]) for one, other in question["pairs"]]
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    # By default coal calls what is less than a micrometre apart touching.
    request.gjk_tolerance = 1e-10
    collides = np.zeros(count, "u1")
    calls, searching = 0, 0.0
    for row in range(count):
        candidates = [pairs[place] for place in np.flatnonzero(near[row])]
        used = {body for one, _, other, _ in candidates for body in (one, other)}
        at = {body: coal.Transform3s(turns[body, row], places[body, row]) for body in used}
        began = time.perf_counter()
        for one, shape, other, its_shape in candidates:
            result.clear()
            calls += 1
            if coal.collide(shape, at[one], its_shape, at[other], request, result):
                collides[row] = 1
                break
        searching += time.perf_counter() - began
    collides.tofile(folder / "collides")
    each = 1e6 / count
    print(
        json.dumps(
            {
                "configurations": count,
                "calls": calls,
                "balls": filtering * each,
                "coal": searching * each,
                "both": (filtering + searching) * each,
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
