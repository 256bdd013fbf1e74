"""How well does the network in the program complete objects that it never saw, beside methods that learn nothing?

Runs `graspmill evaluate completion` on the test split of every pair dataset of `jobs/tabletop-model.toml`: objects alone, apart on a
table, in heaps and in bins, each by three sensors. Prints a Markdown table of overlaps of occupied cells (IoU, means over objects), of
the paired difference from the best baseline with its 95 % interval by bootstrap of objects, of both strata, and of distances between
the surfaces. With `--must-beat` the exit code is 1 unless the mean is above the best baseline everywhere.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

PLACES = ("lone", "table", "heap", "bin")
SENSORS = ("clean", "kinect-v1", "d435")
BASELINES = ("partial", "extrude", "hull", "mirror-far", "mirror", "mirror-shell")
WITH_TABLE = ("hull-to-table", "extrude-to-table")


def evaluated(given: argparse.Namespace, data: Path, methods: tuple[str, ...]) -> list[dict]:
    """The rows of an evaluation: the network's first."""
    network = ["--model", given.model] if given.model else ["--method", "bundled"]
    command = [given.graspmill, "evaluate", "completion", data, *network, "--limit", given.limit, "--json"]
    command += [part for method in methods for part in ("--method", method)]
    command += ["--surface-samples", given.surface_samples]
    out = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout
    rows: list[dict] = json.loads(out)["rows"]
    return rows


def interval(value: dict | None, digits: int = 3) -> str:
    if not value:
        return ""
    low, high = value["low"], value["high"]
    return f"{value['mean']:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def mean(value: dict | None, digits: int = 3) -> str:
    return f"{value['mean']:.{digits}f}" if value else ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--graspmill", default="target/release/graspmill")
    parser.add_argument("--data", type=Path, default=Path("datasets/tabletop-model"), help="the set's folder")
    parser.add_argument("--model", help="a model folder in place of the network in the program")
    parser.add_argument("--limit", default="400", help="samples of each dataset")
    parser.add_argument("--surface-samples", default="1000")
    parser.add_argument("--must-beat", action="store_true")
    given = parser.parse_args()
    print("| pairs | network | over the best baseline | best baseline | solid: network, baseline | hollow or thin | surface [mm] | Chamfer [mm^2] |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    beaten = True
    gains = []
    for place in PLACES:
        methods = BASELINES + (WITH_TABLE if place != "lone" else ())
        for sensor in SENSORS:
            network, *others = evaluated(given, given.data / f"{place}-{sensor}", methods)
            best = max(others, key=lambda row: row["iou"]["mean"])
            # The best in each stratum and by distance may be another one.
            strata = [
                (network[key], max((row[key] for row in others if row[key]), key=lambda value: value["mean"]))
                for key in ("iou_of_solid", "iou_of_hollow_or_thin")
                if network[key]
            ]
            distances = [
                (network[key], min((row[key] for row in others if row[key]), key=lambda value: value["mean"]), digits)
                for key, digits in (("surface_mm", 2), ("chamfer_mm2", 1))
            ]
            cells = [
                f"{place}, {sensor}",
                interval(network["iou"]),
                interval(network["iou_over_baseline"]),
                f"`{best['name']}` {mean(best['iou'])}",
                *(f"{mean(ours)}, {mean(theirs)}" for ours, theirs in strata),
                *(f"{mean(ours, digits)}, {mean(theirs, digits)}" for ours, theirs, digits in distances),
            ]
            print("| " + " | ".join(cells) + " |", flush=True)
            beaten &= all(ours["mean"] > theirs["mean"] for ours, theirs in [(network["iou"], best["iou"]), *strata])
            gains.append(network["iou_over_baseline"]["mean"])
    print(f"\nmean gain over the best baseline of each row: {sum(gains) / len(gains):.3f}")
    return int(given.must_beat and not beaten)


if __name__ == "__main__":
    sys.exit(main())
