#!/usr/bin/env python3
"""Simulates scenes in plain MuJoCo, from their stored poses and at rest, and reports how far each body moves.

    pip install mujoco==3.17.0 numpy
    python replay.py                      every scene here, for 2 s; writes agreement.json
    python replay.py 12 --view            one scene by its index in the dataset, in MuJoCo's viewer
    python replay.py --processes 8        8 scenes at a time
    python replay.py --contacts sdf       by MuJoCo's octrees of distances, several times slower; writes agreement_sdf.json

`scenes/<index>.xml` is a scene: its container, and each body as a rigid flex of the object's own triangles in `objects`, with
MuJoCo's own contacts, which are not those that the scene settled with. `scenes_sdf/<index>.xml` is the same scene with an octree
of distances for each body, which MuJoCo descends to contacts from random points: thin walls and sharp edges may get none. A scene
that is an equilibrium stays where it is: its bodies' centres of mass move by less than 5 mm. `scenes.json` has the same numbers
for programs. Lengths are metres.
"""

import argparse
import json
import multiprocessing
import sys
import time
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent


def states(scene, contacts, starts, seconds):
    """Model and state after each step."""
    spec = mujoco.MjSpec.from_file(str(HERE / scene["file_sdf" if contacts == "sdf" else "file"]))
    for mesh in spec.meshes:
        # Finer than by default; no attribute of a file sets this.
        mesh.octree_maxdepth = 8
    spec.option.sdf_initpoints = starts
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for _ in range(round(seconds / model.opt.timestep) + 1):
        yield model, data
        mujoco.mj_step(model, data)


def replay(work):
    """Distances by which the bodies of a scene, by name, have moved at the end: of their centres of mass [m]."""
    scene, *how = work
    names, before = [body["name"] for body in scene["bodies"]], None
    for model, data in states(scene, *how):
        if before is None:
            bodies = [model.body(name).id for name in names]
            before = data.xipos[bodies].copy()
    moved = np.linalg.norm(data.xipos[bodies] - before, axis=1)
    unstable = bool(sum(warning.number for warning in data.warning))
    return {"index": scene["index"], "moved": dict(zip(names, moved.tolist())), "unstable": unstable}


def view(scene, *how):
    from mujoco import viewer

    window = None
    for model, data in states(scene, *how):
        window = window or viewer.launch_passive(model, data)
        window.sync()
        time.sleep(model.opt.timestep)
    window.close()


def results(chosen, how, processes):
    work = [(scene, *how) for scene in chosen]
    if processes > 1:
        with multiprocessing.Pool(processes) as pool:
            yield from pool.imap(replay, work)
    else:
        yield from map(replay, work)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", type=int, help="indices of scenes (default: all)")
    parser.add_argument("--seconds", type=float, default=2.0, help="time to step [s]")
    parser.add_argument("--within", type=float, default=0.005, help="distance that still counts as rest [m]")
    parser.add_argument("--contacts", choices=["surface", "sdf"], default="surface", help="MuJoCo's own contacts: triangles, or distances")
    parser.add_argument("--starts", type=int, default=40, help="with sdf: points that MuJoCo begins its descents to contacts from")
    parser.add_argument("--processes", type=int, default=1, help="scenes at a time")
    parser.add_argument("--view", action="store_true", help="show the scenes in MuJoCo's viewer")
    arguments = parser.parse_args()
    scenes = json.loads((HERE / "scenes.json").read_text())
    chosen = [scene for scene in scenes if not arguments.scenes or scene["index"] in arguments.scenes]
    missing = set(arguments.scenes) - {scene["index"] for scene in chosen}
    if missing:
        known = ", ".join(str(scene["index"]) for scene in scenes[:20])
        sys.exit(f"no scene {min(missing)} here: {known}{' ...' if len(scenes) > 20 else ''}")
    how = (arguments.contacts, arguments.starts, arguments.seconds)
    if arguments.view:
        for scene in chosen:
            view(scene, *how)
        return
    found, whole, bodies, resting = [], 0, 0, 0
    for result in results(chosen, how, arguments.processes):
        far = {name: moved for name, moved in result["moved"].items() if not moved < arguments.within}
        for name, moved in far.items():
            print(f"scene {result['index']}: {name} moves by {1e3 * moved:.1f} mm")
        found.append(result)
        whole += not far and not result["unstable"]
        bodies += len(result["moved"])
        resting += len(result["moved"]) - len(far)
        print(f"{len(found)}/{len(chosen)} scenes, {whole} of them at rest", file=sys.stderr)
    print(f"{resting} of {bodies} bodies and {whole} of {len(found)} scenes stay within {1e3 * arguments.within:g} mm for {arguments.seconds:g} s")
    if not arguments.scenes:
        root = json.loads((HERE / "export.json").read_text())["root"]
        facts = {"root": root, "mujoco": mujoco.__version__, "contacts": arguments.contacts, "seconds": arguments.seconds,
                 "within": arguments.within, "bodies": bodies, "bodies_at_rest": resting, "scenes": len(found),
                 "scenes_at_rest": whole, "moved": found}
        file = "agreement_sdf.json" if arguments.contacts == "sdf" else "agreement.json"
        (HERE / file).write_text(json.dumps(facts, indent=2) + "\n")


if __name__ == "__main__":
    main()
