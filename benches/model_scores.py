"""How well does a trained model complete objects that it never saw? And does it beat what learns nothing?

Models are run by ONNX Runtime on samples of the test split, which the trainer never opens. They are compared with
completions that learn nothing, and the vote of the ten nearest training pairs. Scores are overlaps of occupied cells
(IoU): mean over objects of the mean of each object's samples, with intervals by bootstrap of objects; differences are
paired by object. An object is hollow or thin where less than half of the volume of its occupied cells is solid.

Needs what training needs, and SciPy. With `--must-beat` the exit code is 1 when the first model does not beat, beyond
chance, every completion that learns nothing, over all objects and over hollow or thin ones. Run by `make model` and
`make model-quick`.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import matplotlib
import numpy as np
import onnxruntime

from data_baselines import extruded, hull, mirrored, nearest, pooled
from data_faults import by_object, interval, jaccard, of_others

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill import CompletionSample, Dataset  # noqa: E402
from graspmill.train.data import Held, arrays_of  # noqa: E402
from graspmill.train.recipe import Recipe, read_recipe  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

NEIGHBOURS = 10


def test_samples(folders: list[Path], recipe: Recipe, per_object: int) -> tuple[Held, np.ndarray]:
    """At most `per_object` samples of each object of each dataset's test split, and where the camera is [cells]."""
    samples, objects = [], []
    for folder in folders:
        data = Dataset(folder, CompletionSample, split="test")
        names = data.column("object")
        for name in np.unique(names):
            places = np.flatnonzero(names == name)
            chosen = places[np.linspace(0, len(places) - 1, min(per_object, len(places))).round().astype(int)]
            samples += data.gather(chosen.tolist())
            objects += [name] * len(chosen)
    grids = [sample.pair.grid for sample in samples]
    eyes = [np.array([0.5, 0.5, 0.45]) * grid.resolution - np.array(grid.centre) / grid.cell_size for grid in grids]
    return Held(arrays_of(samples, recipe), np.array(objects)), np.array(eyes)


def completed(model: Path, arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Cells that a model calls occupied, at its threshold."""
    facts = json.loads((model / "model.json").read_text())
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(model / "model.onnx", settings)
    found = []
    for row in range(len(arrays["partial"])):
        feed = {name: arrays[name][row][None, None].astype(np.float32) for name in facts["inputs"]}
        found.append(session.run(["occupancy"], feed)[0][0, 0] > facts["thresholds"]["occupancy"])
    return np.array(found)


def voted(partial: np.ndarray, folders: list[Path]) -> np.ndarray:
    """Cells that most of the nearest training pairs hold."""
    features, truth = [], []
    for folder in folders:
        data = Dataset(folder, CompletionSample, split="training", channels=["pair"])
        features += [pooled(sample.partial[None])[0] for sample in data]
        truth += [sample.complete_bits.copy() for sample in data]
    found = []
    for rows in nearest(pooled(partial), np.array(features), NEIGHBOURS):
        cells = np.unpackbits(np.array(truth)[rows], axis=1, bitorder="little", count=partial[0].size)
        found.append((cells.mean(axis=0) > 0.5).reshape(partial[0].shape))
    return np.array(found)


def shaded(cells: np.ndarray, behind: bool) -> np.ndarray:
    """A view of cells along z, from before or behind, the brighter the more they face the viewer."""
    cells = cells[::-1, :, ::-1] if behind else cells
    depth = np.where(cells.any(axis=2), cells.argmax(axis=2), np.nan).T
    filled = np.where(np.isnan(depth), np.nanmax(depth) if cells.any() else 0, depth)
    # Steps of whole cells would show more than the shape does.
    smooth = np.lib.stride_tricks.sliding_window_view(np.pad(filled, 1, mode="edge"), (3, 3)).mean(axis=(2, 3))
    down, right = np.gradient(smooth)
    light = (1 + 0.5 * right + 0.5 * down) / np.sqrt(1 + right**2 + down**2)
    return np.where(np.isnan(depth), 1.0, 0.15 + 0.6 * np.clip(light, 0, 1.2) / 1.2)


def draw(path: Path, title: str, grids: dict[str, np.ndarray]) -> None:
    """Grids side by side, from the camera above and from behind below."""
    figure, axes = pyplot.subplots(2, len(grids), figsize=(2.4 * len(grids), 5.2), layout="constrained")
    for column, (name, cells) in enumerate(grids.items()):
        for row, side in enumerate(("from the camera", "from behind")):
            axes[row, column].imshow(shaded(cells, row == 1), cmap="gray", vmin=0, vmax=1)
            axes[row, column].set(title=f"{name}\n{side}", xticks=[], yticks=[])
    figure.suptitle(title)
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument(
        "models", type=Path, nargs="+", metavar="MODEL", help="folders; the first is what the others are compared with"
    )
    arguments.add_argument("--data", type=Path, action="append", required=True, metavar="DIR")
    arguments.add_argument("--per-object", type=int, default=12, help="samples of each object of each dataset")
    arguments.add_argument("--picture", type=Path, help="of the sample in the middle of the first model's scores")
    arguments.add_argument(
        "--controls", action="store_true", help="give the first model wrong inputs beside the seen cells"
    )
    arguments.add_argument("--json", type=Path)
    arguments.add_argument(
        "--must-beat", action="store_true", help="fail where a completion that learns nothing is not beaten"
    )
    options = arguments.parse_args()

    held, eyes = test_samples(options.data, read_recipe(options.models[0] / "recipe.toml"), options.per_object)
    partial, truth = held.arrays["partial"], held.arrays["occupancy"]
    learnt = {str(model): completed(model, held.arrays) for model in options.models}
    if options.controls:
        facts = json.loads((options.models[0] / "model.json").read_text())
        for name in facts["inputs"][1:]:
            swapped = held.arrays | {name: held.arrays[name][of_others(held.objects)]}
            learnt[f"{options.models[0]}, `{name}` of another object"] = completed(options.models[0], swapped)
    unlearnt = {
        "partial": partial,
        "extrude": extruded(partial, eyes),
        "mirror-far": mirrored(partial),
        "hull": hull(partial),
    }
    unlearnt[f"{NEIGHBOURS} nearest"] = voted(partial, options.data)
    each = {name: jaccard(grids, truth) for name, grids in (unlearnt | learnt).items()}
    means = {name: by_object(scores, held.objects) for name, scores in each.items()}
    first = np.unique(held.objects, return_index=True)[1]
    strata = {name: rows[first] for name, rows in held.strata().items()}
    base = str(options.models[0])

    print("| completion | " + " | ".join(f"{name} ({rows.sum()})" for name, rows in strata.items()) + " |")
    print("| --- |" + " --- |" * len(strata))
    table: dict[str, dict[str, list[float]]] = {}
    unbeaten = []
    for name, scores in means.items():
        cells = []
        for stratum, rows in strata.items():
            low, high = interval(scores[rows])
            cell = f"{scores[rows].mean():.3f} [{low:.3f}, {high:.3f}]"
            table.setdefault(name, {})[stratum] = [float(scores[rows].mean()), low, high]
            if name != base:
                gain = (means[base] - scores)[rows]
                low, high = interval(gain)
                cell += f"; first {gain.mean():+.3f} [{low:+.3f}, {high:+.3f}]"
                if name in unlearnt and low <= 0 and stratum != "rest":
                    unbeaten.append(f"{name} ({stratum})")
            cells.append(cell)
        print(f"| {name} | " + " | ".join(cells) + " |")
    print(f"{len(truth)} samples of {len(strata['all'])} objects that no training saw")
    if unbeaten:
        print(f"not beaten beyond chance: {', '.join(unbeaten)}")
    if options.json:
        options.json.write_text(json.dumps(table, indent=2) + "\n")
    if options.picture:
        middle = int(np.argsort(each[base])[len(truth) // 2])
        title = f"{held.objects[middle]}, IoU {each[base][middle]:.2f}: the middle of {len(truth)} samples"
        draw(
            options.picture, title, {"seen": partial[middle], "completed": learnt[base][middle], "true": truth[middle]}
        )
        print(f"picture: {options.picture}")
    return 1 if unbeaten and options.must_beat else 0


if __name__ == "__main__":
    sys.exit(main())
