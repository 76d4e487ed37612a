#!/usr/bin/env python3
"""Training images out of posed's own synthetic room: `posectl synth` renders them, the person masks give the boxes.

Each seed gives two recordings, one with a person and one without. A frame whose mask is only a sliver is left out, because nobody could
tell what it shows.
"""
from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from pathlib import Path

import cv2
import numpy as np

LEAST_MASK = 400  # [pixels]


def mask_box(mask: np.ndarray) -> tuple[int, int, int, int] | None:
    """Bounding box (x_min, y_min, x_max, y_max) of what is not 0."""
    rows, columns = np.nonzero(mask.any(1))[0], np.nonzero(mask.any(0))[0]
    return (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1) if len(rows) else None


def write_sample(out: Path, name: str, image: Path, mask: np.ndarray) -> bool:
    visible = int(np.count_nonzero(mask))
    if 0 < visible < LEAST_MASK:
        return False
    height, width = mask.shape
    box = mask_box(mask)
    shutil.copy(image, out / f"{name}{image.suffix}")
    line = ""
    if box:
        x0, y0, x1, y1 = box
        line = f"0 {(x0 + x1) / 2 / width:.6f} {(y0 + y1) / 2 / height:.6f} {(x1 - x0) / width:.6f} {(y1 - y0) / height:.6f}\n"
    (out / f"{name}.txt").write_text(line)
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--posectl", type=Path, required=True, help="the program")
    parser.add_argument("--out", type=Path, required=True, help="folder to write images and labels to")
    parser.add_argument("--seeds", type=int, nargs=2, default=(100, 112), metavar=("FIRST", "LAST"))
    parser.add_argument("--every", type=int, default=20, help="frames from one image to the next")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each recording with a person; a third of it without")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    count = 0
    for seed in range(args.seeds[0], args.seeds[1] + 1):
        for people, seconds in ((1, args.seconds), (0, args.seconds / 3)):
            with tempfile.TemporaryDirectory() as folder:
                mode = "walking" if seed % 2 else "sitting"
                subprocess.run([args.posectl, "synth", "--out", folder, "--force", "--quiet", "--seed", str(seed), "--people", str(people),
                                "--mode", mode, "--duration", str(seconds)], check=True, stdout=subprocess.DEVNULL)
                images = sorted((Path(folder) / "rgb").iterdir())
                masks = sorted((Path(folder) / "masks").iterdir())
                for i in range(0, len(images), args.every):
                    mask = cv2.imread(str(masks[i]), cv2.IMREAD_GRAYSCALE)
                    count += write_sample(args.out, f"synthetic_{seed}_{people}_{i:04d}", images[i], mask)
    print(f"{args.out}: {count} images")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
