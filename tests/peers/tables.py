"""Tables of a dataset of scenes, or of what is made of scenes, against what the Python package reads in the shards.

    tables.py DATASET EXPORT

Every value of every column of every table of the export is compared, and no column is left out: the package knows nothing of the code that
writes tables. Prints the count of rows of each table as JSON.
"""

import json
import sys
from pathlib import Path

import graspmill
import numpy as np
import pyarrow.parquet as parquet
from graspmill import PICK_OBSTACLES, PICK_STAGES, PICK_STATES, PICK_VERDICTS

ENDS = ("at_rest", "timed_out", "missed", "unstable", "overloaded", "blocked")
PHASES = ("approach", "closing", "lift", "hold")
CAMERA = ("width", "height", "fx", "fy", "cx", "cy")


def flat(array):
    return np.asarray(array, float).reshape(-1).tolist()


def top_rows(pose):
    return flat(np.asarray(pose)[:3])


def digest(value):
    return bytes(value).hex()


def camera_of(camera):
    return {name: getattr(camera, name) for name in CAMERA}


def bits_of(mask):
    return np.packbits(mask.reshape(-1), bitorder="little").tobytes()


def named(objects, names, body):
    return {"body": body, "body_name": names[objects[body - 1]], "body_object": objects[body - 1]}


def scene_tables(sample, names):
    message, objects = sample.message("scene"), sample.objects
    kind, size = sample.container
    yield "scenes", {
        "scene": sample.scene_id,
        "mode": sample.mode,
        "container": kind,
        "container_size": flat(size),
        "source": sample.source or None,
        "world_from_source": None if sample.world_from_source is None else flat(sample.world_from_source),
        "crossed": sample.crossed if sample.source else None,
    }
    for body in range(len(objects)):
        pose, angle = sample.resting_poses[body], sample.resting_angles[body]
        yield "bodies", named(objects, names, body + 1) | {
            "world_from_object": flat(sample.world_from_object[body]),
            "mass": sample.masses[body],
            "centre_of_mass": flat(sample.centres_of_mass[body]),
            "friction": sample.frictions[body],
            "released_at": message["released_at"][body],
            "resting_pose": None if pose < 0 else pose,
            "resting_angle": angle if pose >= 0 else None,
            "drift": sample.drifts[body],
            "turn": message["turns"][body],
        }
    contacts = sample.contacts
    for row, (first, second) in enumerate(contacts.pairs.tolist()):
        yield "body_contacts", {
            "first": first,
            "second": second,
            "point": flat(contacts.points[row]),
            "normal": flat(contacts.normals[row]),
            "distance": contacts.distances[row],
            "force": flat(contacts.forces[row]),
            "torque": flat(contacts.torques[row]),
        }
    for by, body, share in sample.supports:
        yield "supports", {"by": by, "body": body, "share": share}


def view_tables(sample, names):
    message, objects, camera = sample.message("image"), sample.objects, sample.camera
    kind, size = sample.container
    # Of a camera without a sensor nothing is too near.
    measured = len(message["pixels_too_near"]) > 0
    yield "views", camera_of(camera) | {
        "world_from_camera": flat(sample.world_from_camera),
        "container": kind,
        "container_size": flat(size),
        "table_size": flat(sample.table_size),
        "instances": sample.instances.tobytes(),
        "point_instances": sample.point_instances.tobytes() if len(message["point_instances"]) else None,
        "depth": sample.depth.astype("<f4"),
    } | ({"rgb": sample.colour.tobytes()} if sample.has("colour") else {})
    for body in range(1, len(objects) + 1):
        left, top, width, height = np.asarray(message["mask_boxes"]).reshape(-1, 4)[body - 1].tolist()
        yield "instances", named(objects, names, body) | {
            "world_from_object": flat(sample.world_from_object[body - 1]),
            "pixels_all": sample.pixels_all[body - 1],
            "pixels_in_image": sample.pixels_in_image[body - 1],
            "pixels_visible": sample.pixels_visible[body - 1],
            "visible_share": sample.visible_shares[body - 1],
            "pixels_too_near": sample.pixels_too_near[body - 1] if measured else None,
            "nearest_depth": sample.nearest_depths[body - 1] if measured else None,
            "truncated": bool(sample.truncated[body - 1]),
            "whole_box": flat(sample.whole_boxes[body - 1]),
            "visible_box": flat(sample.visible_boxes[body - 1]),
            "mask_box": [left, top, width, height],
            "mask": bits_of(sample.mask(body)[top : top + height, left : left + width]),
        }


def amodal_tables(sample, names):
    pair, clutter, n = sample.pair, sample.clutter, sample.resolution
    yield "pairs", camera_of(pair.camera) | {
        "instance": pair.sample.instance,
        "camera": pair.sample.camera,
        "body": clutter.instance,
        "body_name": names[clutter.object],
        "body_object": clutter.object,
        "resolution": n,
        "cell_size": pair.grid.cell_size,
        **{f"centre_{axis}": value for axis, value in zip("xyz", pair.grid.centre.tolist())},
        **{name: top_rows(getattr(pair, name)) for name in ("camera_from_object", "world_from_object", "world_from_camera")},
        "partial": sample.partial_bits.tobytes(),
        "complete": sample.complete_bits.tobytes(),
        "tactile": bits_of(sample.tactile),
        "pixels_all": clutter.pixels_all,
        "pixels_in_image": clutter.pixels_in_image,
        "points": clutter.points,
        "own_points": clutter.own_points,
        "others_seen": bits_of(clutter.others_seen),
        "others_solid": bits_of(clutter.others_solid),
    }
    for channel, touch in sample.touch.items():
        for k in range(len(touch.probe)):
            outside = touch.cells[k] == n**3
            cell = (None,) * 3 if outside else [int(i) for i in np.unravel_index(touch.cells[k], (n,) * 3)]
            felt = (touch.links[touch.link[k]], touch.forces[k], touch.gaps[k]) if touch.hand else (None,) * 3
            yield "touch", {
                "channel": channel,
                "probe": touch.probe[k],
                "position": flat(touch.positions[k]),
                "normal": flat(touch.normals[k]),
                "distance": touch.distances[k],
                "visible": bool(touch.visible[k]),
                **{f"cell_{axis}": index for axis, index in zip("xyz", cell)},
                **dict(zip(("link", "force", "gap"), felt)),
            }
        for probe in range(len(touch.ends)):
            yield "approaches", {
                "channel": channel,
                "probe": probe,
                "hand": touch.hand,
                "end": ENDS[touch.ends[probe]],
                "camera_from_hand": flat(touch.camera_from_hand[probe]),
                "joints": flat(touch.joint_values[probe]),
            }
        message = sample.message(channel)
        stopped = np.frombuffer(message["blocked_positions"], "<f4").reshape(-1, 3)
        blocked = zip(message["blocked_probe"], bytes(message["blocked_by"]), stopped)
        for probe, by, position in blocked:
            yield "blocked", {"channel": channel, "probe": probe, "by": by, "position": flat(position)}


def volume_tables(sample, names):
    objects = sample.objects
    row = {
        "resolution": sample.resolution,
        "size": sample.size,
        "truncation": sample.truncation,
        "world_from_volume": flat(sample.world_from_volume),
        "steps": sample.steps.astype("<i2").tobytes(),
        "weights": sample.weights.tobytes(),
        "instances": sample.instances.tobytes(),
    }
    if sample.has("affordance"):
        message = sample.message("affordance")
        row |= {
            "hand": message["hand"],
            "picks": digest(message["picks"]),
            "trials": digest(message["trials"]),
            "forbidden_by": flat(sample.forbidden),
            "evaluated": flat(np.frombuffer(bytes(message["evaluated"]), np.uint8)),
        }
        for grasp, body in enumerate(sample.grasp_bodies.tolist()):
            yield "volume_grasps", {
                "body": body,
                "candidate": sample.grasp_candidates[grasp],
                "state": PICK_STATES[sample.grasp_states[grasp]],
                "voxel": flat(sample.grasp_voxels[grasp]),
                "centre": flat(sample.grasp_centres[grasp]),
                "rotation": flat(sample.grasp_rotations[grasp]),
                "width": sample.grasp_widths[grasp],
            }
    yield "volumes", row
    for body in range(1, len(objects) + 1):
        yield "bodies", named(objects, names, body) | {"world_from_object": flat(sample.world_from_object[body - 1])}
    for image, view in enumerate(sample.views.tolist()):
        yield "fused_views", camera_of(sample.intrinsics[image]) | {
            "view": view,
            "camera": sample.cameras[image],
            "world_from_camera": flat(sample.world_from_camera[image]),
        }


CONDITIONS = (
    "mass friction torsion rolling stand_off approach_time start_depth closing_time lift lift_time hold_time least_raised lost_distance "
    "lost_angle carried_height"
)


def pick_tables(sample, names):
    message, objects = sample.message("grasps"), sample.objects
    kind, size = sample.container
    trials = {trial.candidate: trial for trial in sample.trials} if sample.has("trials") else {}
    row = named(objects, names, sample.body) | {
        "container": kind,
        "container_size": flat(size),
        "hand": sample.hand,
        "hand_digest": digest(message["hand_digest"]),
        "take": message["take"],
        "rolls": message["rolls"],
        "margin": sample.margin,
    }
    if sample.has("trials"):
        tried = sample.message("trials")
        row |= {name: tried[name] for name in CONDITIONS.split()} | {"awake": tried["awake"]}
    yield "picks", row
    for body in range(1, len(objects) + 1):
        yield "bodies", named(objects, names, body) | {"world_from_object": flat(sample.world_from_object[body - 1])}
    rotations = sample.nearest_free_rotations
    for candidate in range(len(sample.runs)):
        free, trial = bool(sample.free[candidate]), trials.get(candidate)
        row = {
            "candidate": candidate,
            "run": sample.runs[candidate],
            "rank": sample.ranks[candidate],
            "direction": sample.directions[candidate],
            "world_from_base": flat(sample.world_from_base[candidate]),
            "free_ways": str(sample.free_ways[candidate]),
            "nearest_free_rotation": None if np.isnan(rotations[candidate]) else rotations[candidate],
            "closed_joints": flat(sample.closed_joints[candidate]) if free or sample.free_opened[candidate] else None,
        }
        for way in ("", "_opened"):
            verdict = getattr(sample, f"verdicts{way}")[candidate]
            row |= {
                f"free{way}": verdict == 0,
                f"blocked_by{way}": PICK_OBSTACLES[verdict] if verdict else None,
                f"stage{way}": PICK_STAGES[getattr(sample, f"stages{way}")[candidate]] if verdict else None,
                f"neighbour{way}": getattr(sample, f"neighbours{way}")[candidate] or None,
                f"clearance{way}": getattr(sample, f"clearances{way}")[candidate],
            }
        if sample.has("trials"):
            row |= {"trial": trial.verdict if trial else None, "held": trial.held if trial else None}
        yield "candidates", row
    for stored, trial in zip(sample.message("trials")["trials"] if trials else (), trials.values()):
        candidate = {"candidate": trial.candidate}
        yield "pick_trials", candidate | {
            "verdict": trial.verdict,
            "held": trial.held,
            "time": trial.time,
            "steps": stored["steps"],
            "raised": trial.raised,
            "penetration": trial.penetration,
            "object_from_base": None if trial.object_from_base is None else flat(trial.object_from_base),
            "contacts": len(trial.links),
        }
        for contact, link in enumerate(trial.links):
            yield "pick_contacts", candidate | {
                "link": link,
                "point": flat(trial.points[contact]),
                "normal": flat(trial.normals[contact]),
                "distance": stored["distances"][contact],
                "force": trial.forces[contact],
            }
        for thing, (phase, time, force) in trial.touched.items():
            yield "pick_touches", candidate | {"thing": thing, "phase": phase, "time": time, "force": force}
        for body, moved in trial.moved.items():
            yield "pick_neighbours", candidate | {"body": body, "moved": moved, "lifted": trial.lifted[body]}


def heatmap_tables(sample, names):
    message = sample.message("grasps")
    row = camera_of(sample.camera) | {
        "world_from_camera": flat(sample.world_from_camera),
        "hand": sample.hand,
        "hand_digest": digest(message["hand_digest"]),
        "picks": digest(message["picks"]),
        "trials": digest(message["trials"]),
        "label": sample.label,
        "angle": sample.angle,
        "side": sample.side,
        "size": sample.size,
        "evaluated": flat(sample.evaluated),
    }
    yield "heatmaps", row | ({"depth": sample.depth.astype("<f4")} if sample.has("depth") else {})
    patches = {grasp: place for place, grasp in enumerate(sample.patch_grasps.tolist())}
    for mark, body in enumerate(sample.bodies.tolist()):
        place = patches.get(mark)
        windows = None if place is None else np.zeros((len(sample.point_names), 3))
        if place is not None and sample.size is not None:
            windows = sample.windows[place]
        yield "marks", {
            "mark": mark,
            "body": body,
            "candidate": sample.candidates[mark],
            "run": sample.runs[mark],
            "rank": sample.ranks[mark],
            "direction": sample.directions[mark],
            "type_index": sample.type_indices[mark],
            "state": PICK_STATES[sample.states[mark]],
            "value": sample.values[mark],
            "world_from_base": flat(sample.world_from_base[mark]),
            "points": flat(sample.points[mark]),
            "pixels": flat(sample.pixels[mark]),
            "surfaces": flat(sample.surfaces[mark]),
            "visible": flat(sample.visible[mark]),
            "corners": None if place is None else flat(sample.corners[place]),
            "windows": None if windows is None else flat(windows[:, 2]),
            "window_corners": None if windows is None else flat(windows[:, :2]),
        }
    for grasp, body in enumerate(sample.forbidden_bodies.tolist()):
        yield "forbidden", {
            "body": body,
            "candidate": sample.forbidden_candidates[grasp],
            "forbidden_by": PICK_OBSTACLES[sample.obstacles[grasp]],
            "pixel": flat(sample.forbidden_pixels[grasp]),
        }


def suction_tables(sample, names):
    message, objects, (kind, size) = sample.message("poses"), sample.objects, sample.container
    cup = sample.cup
    yield "suction", named(objects, names, sample.body) | {
        "container": kind,
        "container_size": flat(size),
        "mass": sample.mass,
        "centre_of_mass": flat(sample.centre_of_mass),
        "cup_radius": cup.radius,
        "cup_outer_radius": cup.outer_radius,
        "cup_height": cup.height,
        "tube_radius": cup.tube_radius,
        "tube_length": cup.tube_length,
        "margin": sample.margin,
        "any_direction": message["any_direction"] == 1,
    } | {name: message[name] for name in ("half_angle", "tilt", "safety", "budget", "wanted")}
    for body in range(1, len(objects) + 1):
        yield "bodies", named(objects, names, body) | {"world_from_object": flat(sample.world_from_object[body - 1])}
    for pose in range(len(sample.numbers)):
        surface = dict(zip(graspmill.SURFACE_MEASURES, sample.surfaces[pose].tolist()))
        is_met, is_sealed = sample.missed[pose] == 0, sample.strengths[pose] != 255
        row = {
            "pose": sample.numbers[pose],
            "scheme": graspmill.PICK_SCHEMES[sample.schemes[pose]],
            "object_from_cup": flat(sample.object_from_cup[pose]),
            "result": graspmill.SUCTION_RESULTS[sample.results[pose]],
            "seal_limit": graspmill.SEAL_LIMITS[sample.seal_limits[pose]],
            "seal_margin": sample.seal_margins[pose],
            "missed": sample.missed[pose],
            "suctionnet_seal": sample.suctionnet_seals[pose],
            "suctionnet_wrench": sample.suctionnet_wrenches[pose],
            "slope": [surface["slope_x"], surface["slope_y"]] if is_met else None,
            "curvatures": [surface["curvature_low"], surface["curvature_high"]] if is_met else None,
            "strength": graspmill.SUCTION_STRENGTHS[sample.strengths[pose]] if is_sealed else None,
            "hold_margin": sample.hold_margins[pose] if is_sealed else None,
            "used": flat(sample.used[pose]) if is_sealed else None,
            "force": sample.forces[pose] if is_sealed else None,
            "blocked_by": PICK_OBSTACLES[sample.obstacles[pose]] if sample.obstacles[pose] else None,
            "stage": PICK_STAGES[sample.stages[pose]] if sample.obstacles[pose] else None,
            "neighbour": sample.neighbours[pose] or None,
            "clearance": sample.clearances[pose],
            "robustness": None if np.isnan(sample.robustness[pose]) else sample.robustness[pose],
        }
        row |= {name: surface[name] if is_met else None for name in SURFACE_COLUMNS.split()}
        yield "suction_poses", row


SURFACE_COLUMNS = "seat compression spread flex stretch bulge hole"


# Class of the samples, what makes their rows, and the table with a row per sample.
TABLES = {
    "scenes": (graspmill.SceneSample, scene_tables, "scenes"),
    "views": (graspmill.ViewSample, view_tables, "views"),
    "amodal": (graspmill.AmodalSample, amodal_tables, "pairs"),
    "volumes": (graspmill.VolumeSample, volume_tables, "volumes"),
    "picks": (graspmill.PickSample, pick_tables, "picks"),
    "heatmaps": (graspmill.HeatmapSample, heatmap_tables, "heatmaps"),
    "suction": (graspmill.SuctionSample, suction_tables, "suction"),
}


def same(found, expected):
    """Whether a value is as expected; NaN is NaN. An array is compared with the bytes of one of its kind."""
    if isinstance(expected, np.ndarray):
        return np.array_equal(np.frombuffer(found, expected.dtype), expected.reshape(-1), equal_nan=True)
    if isinstance(expected, list):
        return found is not None and np.array_equal(np.array(found, float), np.array(expected, float), equal_nan=True)
    if isinstance(expected, float):
        return found is not None and (found == expected or (found != found and expected != expected))
    return found == expected


def check_objects(dataset, rows, counts):
    """One row per object that the samples have, with its values from the asset table."""
    known = {row["object"]: row for row in dataset.folder.objects()}
    facts_of = graspmill.object_facts(dataset.folder.path)
    assert [row["subject"] for row in rows] == [digest for digest in known if digest in counts]
    for row in rows:
        asset = known[row["subject"]]
        assert (row["object"], row["samples"]) == (asset["name"], counts[row["subject"]]), row
        facts = facts_of[asset["name"]]
        for key in ("category", "material", "mass", "mass_from", "mass_source", "friction", "solid_volume", "symmetry_group"):
            assert row[key] == getattr(facts, key), f"{asset['name']}: {key}"
        lists = ("centre_of_mass", "inertia", "inertia_per_kilogram", "symmetries_discrete", "symmetries_continuous", "mirror_normals")
        for key in lists:
            assert same(row[key], flat(getattr(facts, key))), f"{asset['name']}: {key}"


def main():
    data, export = sys.argv[1:]
    product = json.loads(Path(data, "manifest.json").read_text(encoding="utf-8"))["product"]
    kind, tables_of, main_table = TABLES[product]
    dataset = graspmill.Dataset(data, kind)
    names = {row["object"]: row["name"] for row in dataset.folder.objects()}
    explained = json.loads(Path(export, "export.json").read_text(encoding="utf-8"))["tables"]
    tables = {Path(file).stem: parquet.read_table(Path(export, file)) for file in explained}
    for file, told in explained.items():
        table = tables[Path(file).stem]
        assert [column["name"] for column in told["columns"]] == table.column_names and told["rows"] == table.num_rows
        assert table.schema.metadata[b"graspmill.root"].decode() == dataset.folder.root
    rows = {name: iter(table.to_pylist()) for name, table in tables.items()}
    counts = {}
    for place, sample in enumerate(dataset):
        common = {"sample_index": sample.index, "subject": sample.id.subject, "item": sample.id.item}
        common["object"] = dataset.column("object")[place]
        common["split"] = dataset.column("split")[place]
        for one in objects_of(sample, dataset):
            counts[one] = counts.get(one, 0) + 1
        for name, expected in tables_of(sample, names):
            row, expected = next(rows[name]), common | expected
            if name == main_table:
                # The facts of the sample are columns of its row, by the names that the index gives them.
                expected |= {key: dataset.column(key)[place] for key in row if key in dataset.index and key not in expected}
            assert set(row) == set(expected), f"{name}: {set(row) ^ set(expected)}"
            for key, value in expected.items():
                assert same(row[key], value), f"{product}: {name}, sample {sample.index}: {key} is {row[key]}, expected {value}"
    check_objects(dataset, list(rows.pop("objects")), counts)
    assert all(next(left, None) is None for left in rows.values()), "rows that no sample has"
    print(json.dumps({name: table.num_rows for name, table in tables.items()}))


def objects_of(sample, dataset):
    """The objects that a sample has: that of its body, or those of the bodies of its scene."""
    if isinstance(sample, graspmill.AmodalSample):
        return {sample.clutter.object}
    if isinstance(sample, (graspmill.PickSample, graspmill.SuctionSample)):
        return {sample.object_id}
    if isinstance(sample, graspmill.HeatmapSample):
        return {object for row in dataset.folder.subjects() if row["object"] == sample.id.subject for object in row["objects"]}
    return set(sample.objects)


if __name__ == "__main__":
    main()
