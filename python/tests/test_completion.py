"""Pairs and their channels against the program's own export, and against each other by geometry."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from graspmill import BadSelection, CompletionSample, Dataset, NpyExport, PairBatch, SampleId, pack


@pytest.fixture(scope="module")
def pairs(data: Path) -> Dataset[CompletionSample]:
    return Dataset(data / "pairs", CompletionSample)


def test_grids_are_those_of_the_programs_export(data: Path, pairs: Dataset[CompletionSample]) -> None:
    with (data / "npy" / "samples.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    planes = {name: np.load(data / "unpacked" / f"{name}.npy") for name in ("partial", "complete", "tactile")}
    assert len(rows) == len(pairs) > 100
    for place, (row, sample) in enumerate(zip(rows, pairs)):
        assert sample.index == int(row["sample_index"])
        for name, expected in planes.items():
            assert np.array_equal(getattr(sample, name), expected[place]), (place, name)
        assert np.array_equal(sample.seen_or_touched, planes["partial"][place] | planes["tactile"][place])
        pair = sample.pair
        assert (
            sample.id
            == pair.sample
            == SampleId(row["subject"], int(row["instance"]), int(row["item"]), int(row["camera"]))
        )
        assert pair.grid.cell_size == float(row["cell_size"])
        assert pair.grid.centre.tolist() == [float(row[f"centre_{axis}"]) for axis in "xyz"]
        assert (pair.partial_cells, pair.complete_cells) == (sample.partial.sum(), sample.complete.sum())
        assert pair.both_cells == (sample.partial & sample.complete).sum()
        assert np.allclose(pair.world_from_object, pair.world_from_camera @ pair.camera_from_object, atol=1e-9)


def test_seen_points_fill_the_partial_grid(pairs: Dataset[CompletionSample]) -> None:
    """Depth, cloud, camera and grid tell of the same points: those of the crop fall into the occupied cells."""
    for sample in pairs.gather([0, 50, -1]):
        pair, depth = sample.pair, sample.depth
        points = pair.camera.points(depth.metres, depth.left, depth.top)[~np.isnan(depth.metres)]
        assert len(points) == len(sample.cloud) > 100
        # Depth is stored in steps of 0.1 mm, the cloud in full.
        assert np.abs(points - sample.cloud).max() < 1e-4
        cells = pair.grid.cells(sample.cloud)
        inside = ((cells >= 0) & (cells < pair.grid.resolution)).all(axis=1)
        found = np.zeros_like(sample.partial)
        found[tuple(cells[inside].T)] = True
        # A point on the border of two cells may round to the other one in single precision.
        places = (sample.cloud - pair.grid.lower_corner) / pair.grid.cell_size
        clear = (np.abs(places - np.round(places)) > 1e-3).all(axis=1)
        assert clear.mean() > 0.5 and sample.partial[tuple(cells[inside & clear].T)].all()
        assert (sample.partial & ~found).sum() <= (~clear).sum() < 0.5 * sample.partial.sum()


def test_occluders_hide_the_pixels_that_they_say(pairs: Dataset[CompletionSample]) -> None:
    occluded, shares = pairs.column("occluded"), pairs.column("hidden_share")
    assert 10 < occluded.sum() < len(pairs) / 2
    for place, sample in enumerate(pairs):
        occlusion, depth = sample.occlusion, sample.depth
        assert (occlusion.kind != "none") == (occluded[place] == 1)
        assert occlusion.hidden_share == shares[place] <= 0.4
        if occlusion.kind == "none":
            assert occlusion.mask.size == occlusion.corners.size == occlusion.hidden_pixels == 0
            continue
        assert np.count_nonzero(~np.isnan(depth.metres)) == occlusion.object_pixels - occlusion.hidden_pixels
        # No pixel sees both; in depth the occluder is nearer than all that is left.
        image = np.zeros((sample.pair.camera.height, sample.pair.camera.width), bool)
        height, width = occlusion.mask.shape
        image[occlusion.top : occlusion.top + height, occlusion.left : occlusion.left + width] = occlusion.mask
        height, width = depth.metres.shape
        crop = image[depth.top : depth.top + height, depth.left : depth.left + width]
        assert not (crop & ~np.isnan(depth.metres)).any()
        assert occlusion.corners[:, 2].max() < np.nanmin(depth.metres)


def test_channels_agree_with_the_solid(pairs: Dataset[CompletionSample]) -> None:
    for sample in pairs.gather(range(0, len(pairs), 9)):
        complete, n = sample.complete, sample.resolution
        assert sample.coverage.shape == sample.tsdf.steps.shape == complete.shape == (n, n, n)
        # A cell whose centre is inside by more than its half diagonal, and a little for the solid's own voxels, is
        # covered whole; outside, it is empty.
        deep = 1.2 * sample.pair.grid.cell_size
        metres = sample.tsdf.metres
        assert complete[metres < -deep].all() and not complete[metres > deep].any()
        assert (sample.coverage[metres < -deep] == 255).all() and (sample.coverage[metres > deep] == 0).all()
        # What was seen to be free is neither seen surface nor, but for the border cells, solid inside.
        assert not (sample.free & sample.partial).any()
        assert not (sample.free & (metres < -deep)).any()
        points = sample.implicit
        assert points.space_points.shape == (2048, 3) and points.space_distances.shape == (2048,)
        assert np.allclose(np.linalg.norm(points.surface_normals, axis=1), 1.0, atol=1e-5)


def test_contacts_stand_in_their_cells(data: Path, pairs: Dataset[CompletionSample]) -> None:
    felt = Dataset(data / "felt", CompletionSample)
    kinds = set()
    for sample in [*pairs.gather(range(0, len(pairs), 7)), *felt]:
        grid = sample.pair.grid
        n = grid.resolution
        tactile = np.zeros((n, n, n), bool)
        for kind, touch in sample.touch.items():
            kinds.add(kind)
            cells = grid.cells(touch.positions)
            inside = ((cells >= 0) & (cells < n)).all(axis=1)
            numbers = np.where(inside, (cells[:, 0] * n + cells[:, 1]) * n + cells[:, 2], n**3)
            assert np.array_equal(numbers, touch.cells)
            tactile[tuple(cells[inside].T)] = True
            assert np.allclose(np.linalg.norm(touch.normals, axis=1), 1.0, atol=1e-5)
            if kind == "touch_rays":
                assert touch.probes == len(touch.probe) + len(touch.misses) == 40
            else:
                assert (
                    touch.hand
                    and len(touch.ends) == len(touch.camera_from_hand) == len(touch.joint_values) == touch.probes
                )
                assert touch.joint_values.shape[1] == len(touch.joints) and (touch.forces >= 0).all()
        assert np.array_equal(tactile, sample.tactile)
    assert kinds == {"touch_rays", "touch_exploration", "touch_grasp"}


def test_batches_are_their_samples(pairs: Dataset[CompletionSample]) -> None:
    places = np.random.default_rng(1).permutation(len(pairs))[:60].tolist() + [3, 3, -1]
    samples = pairs.gather(places)
    batch = PairBatch.of(samples)
    assert [sample.index for sample in samples] == [pairs[place].index for place in places] == batch.indices.tolist()
    for name in ("partial", "complete", "free", "tactile"):
        cells = batch.cells(name)
        for row, sample in zip(cells, samples):
            assert np.array_equal(row, getattr(sample, name))
        assert np.array_equal(pack(cells), getattr(batch, name))
    with pytest.raises(IndexError):
        pairs[len(pairs)]
    with pytest.raises(IndexError):
        pairs.gather([0, len(pairs)])


def test_selections_are_those_of_the_index(data: Path, pairs: Dataset[CompletionSample]) -> None:
    index = pairs.index
    folder = data / "pairs"
    found = 0
    for split in ("training", "holdout", "validation", "test"):
        part = Dataset(folder, CompletionSample, split=split)
        assert np.array_equal(part.indices, np.flatnonzero(index["kept"] & (index["split"] == split)))
        assert len(part) and set(part.column("split")) == {split}
        found += len(part)
    assert found == len(pairs) == index["kept"].sum() < len(index["kept"])
    mugs = Dataset(folder, CompletionSample, objects=["mug-01"])
    assert set(mugs.column("object")) == {"mug-01"} and {sample.id.subject for sample in mugs} == set(
        mugs.column("subject")
    )
    counts = [len(set(Dataset(folder, split="training", subset=k).column("object"))) for k in (0, 1)]
    assert counts == [1, 2]
    few = Dataset(folder, CompletionSample, channels=["pair"])
    assert few[0].has("pair") and not few[0].has("depth")
    with pytest.raises(KeyError, match="no channel 'depth'"):
        few[0].depth
    for wrong in ({"split": "train"}, {"objects": ["cup"]}, {"subset": 2}, {"channels": ["voxels"]}):
        with pytest.raises(BadSelection, match="pairs"):
            Dataset(folder, **wrong)  # type: ignore[call-overload]


def test_samples_are_found_by_id_in_another_dataset(data: Path) -> None:
    """The set's pairs without touch and with it have the same ids, and the same grids."""
    plain, touched = (Dataset(data / "set" / name, CompletionSample) for name in ("completion", "touch"))
    for sample in plain.gather(range(0, len(plain), 5)):
        place = touched.index_of(sample.id)
        assert place is not None
        other = touched[place]
        assert other.id == sample.id and other.payload("pair") == sample.payload("pair")
    assert touched.index_of(SampleId("0" * 64, 0, 0, 0)) is None


def test_the_export_is_read_packed_and_unpacked(data: Path, pairs: Dataset[CompletionSample]) -> None:
    batch = PairBatch.of(pairs.gather(range(0, len(pairs), 3)))
    for name in ("npy", "unpacked"):
        export = NpyExport(data / name)
        assert export.root == pairs.folder.root and len(export) == len(pairs)
        rows = export.gather(range(0, len(export), 3))
        for plane in ("partial", "complete", "tactile"):
            assert np.array_equal(getattr(rows, plane), getattr(batch, plane))
        assert np.array_equal(rows.indices, batch.indices)
        assert np.array_equal(export[-1].cells("complete")[0], pairs[-1].complete)
    some = NpyExport(data / "npy", split="test")
    assert {row["split"] for row in some.samples} == {"test"}
    assert np.array_equal(some.indices, Dataset(data / "pairs", split="test").indices)
