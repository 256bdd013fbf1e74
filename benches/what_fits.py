"""What fits: the funnel of grasps that were sampled in scenes, per dataset of picks, and what blocks the bodies without a free grasp.

For each dataset of picks in a set (`jobs/what-fits.toml`), or each given dataset: bodies, share of them with a free grasp, poses drawn and what
became of them, free grasps, trials and the share that holds. With `--reference SET`, a set of the same scenes with a larger budget of poses
(`picks.poses`), also the share of the bodies with a free grasp there that have one here. Needs numpy and the package `graspmill`.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill import Dataset, PickSample  # noqa: E402
from graspmill.folder import Folder  # noqa: E402


def picks_of(folder: Path) -> dict[str, Path]:
    """Datasets of picks by name: those of a set, or the folder itself."""
    folders = sorted(folder.iterdir()) if (folder / "set.json").exists() else [folder]
    parts = [each for each in folders if (each / "manifest.json").exists()]
    return {each.name: each for each in parts if Folder(each).product == "picks"}


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="a set, or a dataset of picks")
    parser.add_argument("--reference", type=Path, help="the same with a larger budget")
    given = parser.parse_args()
    reference = picks_of(given.reference) if given.reference else {}
    print("| picks | bodies | with a free grasp | poses | free | tried | held | without a free grasp, by what blocks it |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, folder in picks_of(given.data).items():
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


if __name__ == "__main__":
    main()
