"""Exports to Parquet and WebDataset, read by pyarrow and tarfile, against the shards."""

from __future__ import annotations

import io
import json
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pyarrow.parquet as parquet
import pytest
from graspmill import (
    LABELS,
    PROOFS,
    TRIAL_PHASES,
    TRIAL_VERDICTS,
    CompletionSample,
    Dataset,
    GraspSample,
    PatchSample,
    ReachabilityField,
    ReachabilitySample,
    grasp_frame,
)

DOCUMENT = Path(__file__).parents[2] / "docs" / "tables.md"
ENDS = ("at_rest", "timed_out", "missed", "unstable", "overloaded")


@pytest.fixture(scope="module")
def pairs(data: Path) -> Dataset[CompletionSample]:
    return Dataset(data / "pairs", CompletionSample)


def facts_of(sample: CompletionSample) -> dict[str, object]:
    pair = sample.pair
    facts = {name: getattr(pair, name) for name in ("partial_cells", "complete_cells", "both_cells", "solid_share")}
    poses = ("camera_from_object", "world_from_object", "world_from_camera")
    facts |= {name: getattr(pair, name)[:3].reshape(-1).tolist() for name in poses}
    own = {"subject": pair.sample.subject, "instance": pair.sample.instance, "item": pair.sample.item}
    return (
        facts
        | own
        | {"sample_index": sample.index, "resolution": pair.grid.resolution, "cell_size": pair.grid.cell_size}
    )


def test_parquet_holds_the_pairs(data: Path, pairs: Dataset[CompletionSample]) -> None:
    table = parquet.read_table(data / "parquet" / "pairs.parquet")
    assert table.schema.metadata[b"graspmill.root"].decode() == pairs.folder.root
    rows = table.to_pylist()
    assert len(rows) == len(pairs)
    names = pairs.column("object"), pairs.column("split")
    for row, sample, name, split in zip(rows, pairs, *names):
        expected = facts_of(sample)
        assert {key: row[key] for key in expected} == expected
        assert (row["object"], row["split"], row["camera"]) == (name, split, 0)
        camera, centre = sample.pair.camera, sample.pair.grid.centre.tolist()
        assert [row[key] for key in ("fx", "fy", "cx", "cy")] == [camera.fx, camera.fy, camera.cx, camera.cy]
        assert [row[f"centre_{axis}"] for axis in "xyz"] == centre
        assert row["partial"] == sample.partial_bits.tobytes() and row["complete"] == sample.complete_bits.tobytes()
        tactile = np.unpackbits(np.frombuffer(row["tactile"], np.uint8), bitorder="little")
        assert np.array_equal(tactile[: 40**3].reshape(40, 40, 40), sample.tactile)
    file = parquet.ParquetFile(data / "parquet" / "pairs.parquet")
    assert all(file.metadata.row_group(group).num_rows <= 256 for group in range(file.num_row_groups))


def test_tar_shards_hold_the_pairs(data: Path, pairs: Dataset[CompletionSample]) -> None:
    found: dict[str, dict[str, bytes]] = {}
    for path in sorted((data / "webdataset").glob("*.tar")):
        with tarfile.open(path) as shard:
            for member in shard:
                assert (member.mtime, member.uid, member.gid, member.uname, member.mode) == (0, 0, 0, "", 0o644)
                key, _, extension = member.name.partition(".")
                file = shard.extractfile(member)
                assert file is not None
                found.setdefault(key, {})[extension] = file.read()
    assert list(found) == sorted(found) and len(found) == len(pairs)
    for sample, (key, members) in zip(pairs, found.items()):
        assert int(key) == sample.index and set(members) == {"json", "partial.npy", "complete.npy", "tactile.npy"}
        facts, expected = json.loads(members["json"]), facts_of(sample)
        assert {name: facts[name] for name in expected} == expected
        planes = {name: np.load(io.BytesIO(members[f"{name}.npy"])) for name in ("partial", "complete", "tactile")}
        assert np.array_equal(planes["partial"], sample.partial_bits)
        assert np.array_equal(planes["complete"], sample.complete_bits)
        assert np.array_equal(planes["tactile"], np.packbits(sample.tactile.reshape(-1), bitorder="little"))


def test_exports_name_their_dataset(data: Path, pairs: Dataset[CompletionSample]) -> None:
    for name in ("npy", "unpacked", "parquet", "webdataset"):
        facts = json.loads((data / name / "export.json").read_text(encoding="utf-8"))
        assert facts["root"] == pairs.folder.root and facts["samples"] == len(pairs)


def type_of(field: Any) -> str:
    """A column's type, in the words of docs/tables.md."""
    names = {"string": "text", "double": "f64", "uint32": "u32", "uint64": "u64", "binary": "bytes"}
    listed = str(field.type).startswith("list")
    value = str(field.type.value_type if listed else field.type)
    kind = ("list of " if listed else "") + names.get(value, value)
    return f"{kind}, or none" if field.nullable else kind


def rows_of(data: Path, name: str, dataset: Dataset[Any]) -> list[dict[str, Any]]:
    """The rows of a table, whose columns ``export.json`` explains and docs/tables.md lists."""
    folder, file = name.split("/")
    path = data / "tables" / folder / f"{file}.parquet"
    table = parquet.read_table(path)
    assert table.schema.metadata[b"graspmill.root"].decode() == dataset.folder.root
    facts = json.loads((path.parent / "export.json").read_text(encoding="utf-8"))
    assert facts["root"] == dataset.folder.root and facts["format"] == "parquet" and file in facts["layout"]
    explained = facts["tables"][path.name]
    assert [column["name"] for column in explained["columns"]] == table.column_names
    assert explained["rows"] == table.num_rows > 0
    document = DOCUMENT.read_text(encoding="utf-8")
    for column, field in zip(explained["columns"], table.schema):
        assert f"| `{field.name}` | {type_of(field)} | {column['meaning']} |\n" in document, f"{path.name}: {field.name}"
    rows: list[dict[str, Any]] = table.to_pylist()
    return rows


def assert_names(rows: list[dict[str, Any]], dataset: Dataset[Any], place: int) -> None:
    """Rows name their sample as the index does."""
    for name in ("sample_index", "subject", "object", "item"):
        assert {row[name] for row in rows} <= {dataset.column(name)[place]}
    assert {row["split"] for row in rows} <= {dataset.column("split")[place] if "split" in dataset.index else ""}


def test_the_table_of_grasps_is_the_frame_of_grasps(data: Path) -> None:
    runs = Dataset(data / "set/grasps", GraspSample)
    rows, frame = rows_of(data, "grasps/grasps", runs), grasp_frame(runs)
    assert list(rows[0]) == frame.columns.tolist() and len(rows) == len(frame)
    for column in frame.columns:
        for row, value in zip(rows, frame[column].tolist()):
            if isinstance(value, np.ndarray):
                assert row[column] == value.tolist()
            else:
                assert row[column] == (None if pandas.isna(value) else value)
    metadata = parquet.read_schema(data / "tables/grasps/grasps.parquet").metadata
    for name in ("joints", "driven", "hand"):
        assert json.loads(metadata[f"graspmill.{name}".encode()]) == runs[0].run[name]
    assert {row["held"] for row in rows} == {True, False, None}
    # pandas reads it without help, and poses become matrices in one line.
    table = pandas.read_parquet(data / "tables/grasps/grasps.parquet")
    poses = np.stack(table["object_from_base"]).reshape(-1, 4, 4)
    assert np.array_equal(poses, np.concatenate([run.grasps["object_from_base"] for run in runs]))


def test_the_table_of_contacts_holds_those_of_search_and_trial(data: Path) -> None:
    runs = Dataset(data / "set/grasps", GraspSample)
    rows, first = rows_of(data, "grasps/contacts", runs), 0
    for place, run in enumerate(runs):
        links = run.run["links"]
        for rank in range(len(run.grasps)):
            searched = run.contacts[run.contacts["grasp"] == rank]
            tried = run.trial_contacts[run.trial_contacts["grasp"] == rank]
            some = rows[first : first + len(searched) + len(tried)]
            first += len(some)
            assert_names(some, runs, place)
            assert [row["closed_in"] for row in some] == ["search"] * len(searched) + ["trial"] * len(tried)
            for row, contact in zip(some, [*searched, *tried]):
                assert (row["rank"], row["link"]) == (rank, links[contact["link"]])
                assert row["point"] == contact["point"].tolist() and row["normal"] == contact["normal"].tolist()
                assert row["distance"] == contact["distance"]
            assert [row["force"] for row in some] == [None] * len(searched) + tried["force"].tolist()
    assert first == len(rows)


def test_the_table_of_trials_holds_perturbed_ones_too(data: Path) -> None:
    runs = Dataset(data / "set/grasps", GraspSample)
    rows = iter(rows_of(data, "grasps/trials", runs))
    outcomes = ("time", "closing_time", "closed_at_rest", "start_penetration", "closed_penetration")
    outcomes += ("shaken_penetration", "farthest", "force", "links", "opened_by", "drawn_back", "warnings")
    for place, run in enumerate(runs):
        message = run.message("trials")
        for trial in message["trials"]:
            given = {"friction": message["friction"], "mass": message["mass"], "outcome": trial["outcome"]}
            for number, conditions in enumerate([given, *trial["perturbed"]]):
                row = next(rows)
                assert_names([row], runs, place)
                assert (row["rank"], row["perturbation"]) == (trial["grasp"], None if number == 0 else number - 1)
                assert (row["friction"], row["mass"]) == (conditions["friction"], conditions["mass"])
                for name in ("shift", "turn"):
                    assert row[name] == (conditions[name].tolist() if number else None)
                outcome = conditions["outcome"]
                assert {name: row[name] for name in outcomes} == {name: outcome[name] for name in outcomes}
                assert row["verdict"] == TRIAL_VERDICTS[outcome["verdict"]]
                assert row["held"] == (outcome["verdict"] == 0)
                assert (row["slips"], row["turns"]) == (outcome["slips"].tolist(), outcome["turns"].tolist())
                closed = number == 0 and len(trial["object_from_base"])
                assert row["closed_joints"] == (trial["joints"].tolist() if closed else None)
                pose = [*trial["object_from_base"].tolist(), 0.0, 0.0, 0.0, 1.0]
                assert row["closed_object_from_base"] == (pose if closed else None)
    assert next(rows, None) is None


def test_the_table_of_series_holds_the_arrays(data: Path) -> None:
    runs = Dataset(data / "set/grasps", GraspSample)
    rows = iter(rows_of(data, "grasps/series", runs))
    for place, run in enumerate(runs):
        for sample in run.series:
            row = next(rows)
            assert_names([row], runs, place)
            assert (row["rank"], row["on_table"]) == (sample["grasp"], sample["on_table"])
            assert row["phase"] == TRIAL_PHASES["lifted"][sample["phase"]] and row["time"] == sample["time"]
            assert row["forces"] == sample["forces"].tolist()
            assert (row["moved"], row["turned"]) == (sample["moved"], sample["turned"])
    assert next(rows, None) is None
    metadata = parquet.read_schema(data / "tables/grasps/series.parquet").metadata
    assert json.loads(metadata[b"graspmill.links"]) == runs[0].run["links"]


def test_the_tables_of_touch_hold_contacts_and_approaches(data: Path) -> None:
    pairs = Dataset(data / "felt", CompletionSample)
    contacts, approaches = iter(rows_of(data, "felt/touch", pairs)), iter(rows_of(data, "felt/approaches", pairs))
    n, seen = pairs[0].pair.grid.resolution, set()
    for place, sample in enumerate(pairs):
        for channel, touch in sample.touch.items():
            for k in range(len(touch.probe)):
                row = next(contacts)
                assert_names([row], pairs, place)
                assert (row["channel"], row["probe"]) == (channel, touch.probe[k])
                assert row["position"] == touch.positions[k].tolist() and row["normal"] == touch.normals[k].tolist()
                assert (row["distance"], row["visible"]) == (touch.distances[k], touch.visible[k])
                cell = [row[f"cell_{axis}"] for axis in "xyz"]
                outside = touch.cells[k] == n**3
                assert cell == ([None] * 3 if outside else [int(i) for i in np.unravel_index(touch.cells[k], (n,) * 3)])
                felt = (touch.links[touch.link[k]], touch.forces[k], touch.gaps[k]) if touch.hand else (None,) * 3
                assert (row["link"], row["force"], row["gap"]) == felt
                seen.add(channel)
            for probe in range(len(touch.ends)):
                row = next(approaches)
                assert_names([row], pairs, place)
                assert (row["channel"], row["probe"], row["hand"]) == (channel, probe, touch.hand)
                assert row["end"] == ENDS[touch.ends[probe]]
                assert row["camera_from_hand"] == touch.camera_from_hand[probe].reshape(-1).tolist()
                assert row["joints"] == touch.joint_values[probe].tolist()
    assert next(contacts, None) is None and next(approaches, None) is None
    assert any("exploration" in channel or "grasp" in channel for channel in seen)


def test_the_table_of_touch_by_rays_goes_with_the_pairs(data: Path, pairs: Dataset[CompletionSample]) -> None:
    table = parquet.read_table(data / "parquet/touch.parquet")
    touch = [sample.touch["touch_rays"] for sample in pairs]
    assert table["probe"].to_pylist() == [int(probe) for each in touch for probe in each.probe]
    assert np.array_equal(np.array(table["position"].to_pylist()), np.concatenate([each.positions for each in touch]))
    assert set(table["link"].to_pylist()) == {None} and not (data / "parquet/approaches.parquet").exists()


def test_the_table_of_patches_holds_the_patches(data: Path) -> None:
    patches = Dataset(data / "set/patches", PatchSample)
    rows = rows_of(data, "patches/patches", patches)
    assert len(rows) == len(patches) and "rgb" not in rows[0]
    for place, (row, sample) in enumerate(zip(rows, patches)):
        assert_names([row], patches, place)
        patch, side = sample.patch, row["side"]
        depth = np.frombuffer(row["depth"], "<f4").reshape(4, side, side)
        assert np.array_equal(depth, sample.depth, equal_nan=True)
        for name in ("run", "rank", "type", "type_index", "energy", "epsilon", "space", "hand", "label"):
            assert row[name] == patch[name], name
        assert row["grasps"] == bytes(patch["grasps"]).hex()
        assert row["value"] == sample.labels[0, 4 * sample.type_index]
        for name in ("camera_from_object", "object_from_approach"):
            assert row[name] == getattr(sample, name).reshape(-1).tolist()
        assert row["points"] == patch["points"].tolist() and row["pixels"] == patch["pixels"].tolist()
        assert row["corners"] == patch["corners"].tolist()
        camera = sample.camera
        for name in ("width", "height", "fx", "fy", "cx", "cy"):
            assert row[name] == getattr(camera, name)
        for name in ("outcome", "trial", "verdict"):
            assert row[name] == sample.trial[name]
        assert row["trials"] == bytes(sample.trial["trials"]).hex()
        assert row["visible"] == sample.visible.tolist()
        assert np.array_equal(row["surfaces"], sample.surfaces.astype(float), equal_nan=True)
        square = np.frombuffer(row["metric_depth"], "<f4").reshape(4, side, side)
        assert np.array_equal(square, sample.metric_depth, equal_nan=True) and row["size"] == 0.12
        assert row["windows"] == sample.windows[:, 2].tolist()
        assert row["metric_corners"] == sample.windows[:, :2].reshape(-1).tolist()


@pytest.mark.parametrize("name", ["axes", "sphere"])
def test_the_table_of_poses_is_the_map(data: Path, name: str) -> None:
    blocks, field = Dataset(data / name, ReachabilitySample), ReachabilityField(data / name)
    rows = rows_of(data, f"{name}/poses", blocks)
    poses = np.array([[row[axis] for axis in ("x", "y", "z", "roll", "pitch", "yaw")] for row in rows])
    nearest = field.nearest(poses)
    assert [row["cell"] for row in rows] == list(range(len(rows)))
    # Every row is at the centre of its own cell, by the package's own grid.
    assert np.array_equal(nearest.cells, np.arange(len(rows))) and np.allclose(nearest.poses, poses, atol=1e-12)
    assert [row["label"] for row in rows] == [LABELS[label] for label in nearest.labels]
    distance = field.distance_and_gradient(poses)[0]
    assert np.allclose([row["distance"] for row in rows], distance, atol=1e-6)
    first = 0
    for place, block in enumerate(blocks):
        some = rows[first : first + len(block.labels)]
        first += len(some)
        assert_names(some, blocks, place)
        assert [row["label"] for row in some] == [LABELS[label] for label in block.labels]
        assert [row["proof"] for row in some] == [PROOFS[proof] for proof in block.proofs]
        witnesses = [row["witness"] for row in some if row["witness"] is not None]
        assert witnesses == block.witnesses.tolist()
        assert all((row["witness"] is not None) == (row["label"] == "reachable") for row in some)
    assert first == len(rows)
    metadata = parquet.read_schema(data / f"tables/{name}/poses.parquet").metadata
    assert json.loads(metadata[b"graspmill.distance_unit"]) == "metres"
