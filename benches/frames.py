"""Real Kinect frames through segmentation and completion: pictures for `docs/frames.md`, and a table of figures.

The frames are organised clouds of the Object Segmentation Database in the folder `kinect` of GRASPMILL_SAMPLES (PointCloudLibrary/data, BSD-3),
with a label per point. Each is completed by the network in the program. Writes `docs/pictures/frames/NAME.png`, half the size of
`overlay.png`, and prints a Markdown row per frame: objects found, meshes, refusals, seconds. Needs Pillow.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

from PIL import Image

FRAMES = (3, 0, 8, 12, 15, 20, 24, 28, 32, 36, 40, 44)
"""Numbers of the frames: boxes, stacked, occluded, cylinders, mixed."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--graspmill", default="target/release/graspmill")
    parser.add_argument("--samples", type=Path, default=Path(os.environ.get("GRASPMILL_SAMPLES", "samples")))
    parser.add_argument("--out", type=Path, default=Path("docs/pictures/frames"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for number in FRAMES:
        name = f"mosd_learn{number}"
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out"
            command = [given.graspmill, "complete", given.samples / "kinect" / f"{name}.pcd", "--target", "all", "--loose", "drop"]
            began = time.perf_counter()
            done = subprocess.run([str(part) for part in [*command, "--out", out, "--threads", "1"]], capture_output=True, text=True)
            seconds = time.perf_counter() - began
            if done.returncode not in (0, 3):
                raise SystemExit(done.stderr)
            objects = json.loads((out / "scene.json").read_text())["objects"]
            picture = Image.open(out / "overlay.png").convert("RGB")
            picture = picture.resize((picture.width // 2, picture.height // 2), Image.Resampling.LANCZOS)
            picture.quantize(128, dither=Image.Dither.NONE).save(given.out / f"{name}.png", optimize=True)
        meshes = sum(each["completed"] is not None for each in objects)
        refusals = "; ".join(sorted({each["refusal"] for each in objects if each["refusal"]}))
        print(f"| {name} | {len(objects)} | {meshes} | {refusals} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
