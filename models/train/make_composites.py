#!/usr/bin/env python3
"""Writes composites (composites.py) as a folder of images and labels, to train on or to look at."""
from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from composites import Compositor, cut_out, read_cut_outs
from dataset import DataError, Sample, read_folder


def write(out: Path, name: str, sample: Sample) -> None:
    height, width = sample.image.shape[:2]
    cv2.imwrite(str(out / f"{name}.jpg"), sample.image, [cv2.IMWRITE_JPEG_QUALITY, 90])
    boxes = sample.boxes
    shares = np.hstack(((boxes[:, :2] + boxes[:, 2:]) / 2, boxes[:, 2:] - boxes[:, :2])) / [width, height, width, height]
    (out / f"{name}.txt").write_text("".join("0 " + " ".join(f"{v:.6f}" for v in row) + "\n" for row in shares))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--people", type=Path, nargs="*", default=[], help="folders of images and labels to cut people out of")
    parser.add_argument("--cut-outs", type=Path, nargs="*", default=[], help="folders of NAME.jpg and NAME_mask.png")
    parser.add_argument("--backgrounds", type=Path, nargs="+", required=True, help="folders; of these, images that show nobody are taken")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--images", type=int, default=1000)
    parser.add_argument("--size", type=int, nargs=2, default=(480, 360), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--least-height", type=float, default=220, help="of a person worth cutting out of a labelled image [pixels]")
    parser.add_argument("--nobody", action="store_true", help="clutter alone, where a detector should find nobody; needs no people")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    try:
        people = [c for folder in args.cut_outs for c in read_cut_outs(folder)]
        samples = [s for folder in args.people for s in read_folder(folder)]
        backgrounds = [s for folder in args.backgrounds for s in read_folder(folder) if not len(s.boxes)]
    except DataError as error:
        print(f"make_composites.py: {error}")
        return 65
    people += [c for s in samples for i in range(len(s.boxes)) if (c := cut_out(s, i, args.least_height)) is not None]
    print(f"{len(people)} people, {len(backgrounds)} backgrounds", flush=True)
    if not (people or args.nobody) or not backgrounds:
        print("make_composites.py: nobody could be cut out, or no image shows nobody")
        return 65
    args.out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(args.seed)
    compositor = Compositor(people, backgrounds, *args.size)
    for i in range(args.images):
        write(args.out, f"{i:05d}", compositor.clutter_alone(rng) if args.nobody else compositor.sample(rng))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
