"""What fits: the funnel of grasps that were sampled in scenes, per dataset of picks, and what blocks the bodies without a free grasp.

For each dataset of picks in a set (`jobs/what-fits.toml`), or each given dataset: bodies, share of them with a free grasp, poses drawn and what
became of them, free grasps, trials and the share that holds. With `--reference SET`, a set of the same scenes with a larger budget of poses
(`picks.poses`), also the share of the bodies with a free grasp there that have one here. Datasets of suction follow in a table of their own.
Needs numpy and the package `graspmill`.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill import Dataset, PickSample, SuctionSample  # noqa: E402
from graspmill.folder import Folder  # noqa: E402


def datasets_of(folder: Path, product: str) -> dict[str, Path]:
    """Datasets of a product by name: those of a set, or the folder itself."""
    folders = sorted(folder.iterdir()) if (folder / "set.json").exists() else [folder]
    parts = [each for each in folders if (each / "manifest.json").exists()]
    return {each.name: each for each in parts if Folder(each).product == product}


def funnel(folder: Path) -> tuple[dict[str, int], Counter[str], Counter[str], set[str]]:
    """Counts, poses by result, reasons of bodies without a free grasp, and the bodies with one."""
    counts: Counter[str] = Counter()
    poses: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    with_grasp = set()
    for sample in Dataset(folder, PickSample):
        sampling = sample.sampling if sample.has("sampling") else None
        counts["bodies"] += 1
        counts["candidates"] += len(sample.runs)
        counts["free"] += int(sample.free.sum())
        trials = sample.trials
        counts["tried"] += len(trials)
        counts["held"] += sum(trial.held for trial in trials)
        if sampling is not None:
            counts["poses"] += sampling.poses
            for name in ("unopposed", "too_wide", "tilted", "too_low", "alike"):
                poses[name] += getattr(sampling, name)
            poses["rejected"] += sum(sampling.rejected.values())
            poses["blocked"] += sum(sampling.blocked.values())
        if sample.free.any():
            with_grasp.add(str(sample.id))
        elif sampling is not None:
            reasons[sampling.blocked_by or ("too_wide" if sampling.too_wide else "unopposed")] += 1
            reasons["of these, for the palm alone"] += sampling.palm_only
    return dict(counts), poses, reasons, with_grasp


def print_suction(datasets: dict[str, Path]) -> None:
    """Prints bodies with a free pose of the cup, free poses, and what became of all poses."""
    if datasets:
        print("\n| suction | bodies | with a free pose | poses | free | robust | shares of the poses |")
        print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, folder in datasets.items():
        counts: Counter[str] = Counter()
        lost: Counter[str] = Counter()
        for sample in Dataset(folder, SuctionSample):
            found = sample.counts
            counts["bodies"] += 1
            counts["with"] += found["free"] > 0
            counts["robust"] += int((sample.robustness >= 0.5).sum())
            for key in ("drawn", "free"):
                counts[key] += found[key]
            for key in ("tilted", "alike"):
                lost[key] += found[key]
            for key in ("leaking", "weak", "blocked"):
                lost.update({f"{key} {reason}": count for reason, count in found[key].items()})
        share = f"{counts['with']} ({counts['with'] / max(counts['bodies'], 1):.2f})"
        words = ", ".join(f"{reason} {count / max(counts['drawn'], 1):.2f}" for reason, count in lost.most_common(6))
        cells = [name, counts["bodies"], share, counts["drawn"], counts["free"], counts["robust"], words]
        print("| " + " | ".join(map(str, cells)) + " |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="a set, or a dataset of picks or suction")
    parser.add_argument("--reference", type=Path, help="the same with a larger budget")
    given = parser.parse_args()
    reference = datasets_of(given.reference, "picks") if given.reference else {}
    print("| picks | bodies | with a free grasp | poses | free | tried | held | without a free grasp, by what blocks it |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, folder in datasets_of(given.data, "picks").items():
        counts, poses, reasons, bodies = funnel(folder)
        share = f"{len(bodies)} ({len(bodies) / counts['bodies']:.2f})"
        if name in reference:
            more = funnel(reference[name])[3]
            share += f"; {len(bodies & more)} of the reference's {len(more)}"
        held = f"{counts['held']} ({counts['held'] / max(counts['tried'], 1):.2f})"
        words = ", ".join(f"{reason} {count}" for reason, count in reasons.most_common())
        cells = [name, counts["bodies"], share, counts.get("poses", 0), counts["free"], counts["tried"], held, words]
        print("| " + " | ".join(map(str, cells)) + " |")
        total = max(sum(poses.values()) + counts["free"], 1)
        print("| | | | " + ", ".join(f"{name} {count / total:.2f}" for name, count in poses.most_common()) + " | | | | |")
    print_suction(datasets_of(given.data, "suction"))


if __name__ == "__main__":
    main()
