#!/usr/bin/env python3
"""Table 1 of Gan et al. 2024 again: YOLOv5s and its changes, one by one and together, trained alike.

Each variant has a folder of its own under --out, so that an interrupted comparison goes on where it stopped. Everything after `--` goes
to train.py. The paper's widths and epochs take days on a processor: compare at a smaller width and for a shorter time, and say so.
Milliseconds are those of the exported network in OpenCV on one thread, the least of several runs.
"""
from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from checkpoints import load_checkpoint
from dataset import DataError, read_folder
from engines import OnnxDetector
from evaluate import measure
from export import export
from network import NetworkOptions, Yolo, parameter_count
from train import Training, parse_arguments

VARIANTS = {
    "YOLOv5s": ["--no-ghost", "--no-cbam", "--no-fourth-layer"],
    "Ghost": ["--no-cbam", "--no-fourth-layer"],
    "CBAM": ["--no-ghost", "--no-fourth-layer"],
    "Detection layer": ["--no-ghost", "--no-cbam"],
    "Improved": [],
}


@dataclass
class Row:
    name: str
    ap: float
    parameters: int
    full_parameters: int  # at the paper's width, 0.5
    ms: float


def milliseconds(detector: OnnxDetector, runs: int = 20) -> float:
    image = np.full((detector.height, detector.width, 3), 127, np.uint8)
    taken = []
    for _ in range(runs):
        begun = time.perf_counter()
        detector.heads(image)
        taken.append(1e3 * (time.perf_counter() - begun))
    return min(taken)


def compare(name: str, options: list[str], args: argparse.Namespace) -> Row:
    folder = args.out / name.lower().replace(" ", "_")
    arguments = parse_arguments(["--data", *map(str, args.data), "--out", str(folder), "--width", str(args.width), *options, *args.rest])
    torch.set_num_threads(arguments.threads)
    Training(arguments).run()
    network, saved = load_checkpoint(folder / "checkpoint.pt")
    model = folder / "model.onnx"
    export(network, np.array(saved["anchors"]), ["person"], name, *args.size, model)
    detector = OnnxDetector(model)
    ap, _ = measure(detector, read_folder(args.valid), 0.5)
    full = Yolo(NetworkOptions(**{**saved["options"], "width": 0.5}))
    return Row(name, ap.value(), parameter_count(network), parameter_count(full), milliseconds(detector))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, nargs="+", required=True, help="folders to train on")
    parser.add_argument("--valid", type=Path, required=True, help="folder to measure on")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--width", type=float, default=0.125)
    parser.add_argument("--size", type=int, nargs=2, default=(320, 320), metavar=("WIDTH", "HEIGHT"), help="of the input that is measured")
    own, rest = sys.argv[1:], []
    if "--" in own:
        own, rest = own[: own.index("--")], own[own.index("--") + 1 :]
    args = parser.parse_args(own)
    args.rest = rest
    cv2.setNumThreads(1)
    try:
        rows = [compare(name, options, args) for name, options in VARIANTS.items()]
    except DataError as error:
        print(f"table1.py: {error}")
        return 65
    print(f"\n| width {args.width:g} | AP@0.5 | parameters | at width 0.5 | ms at {args.size[0]}x{args.size[1]} |")
    print("| --- | --- | --- | --- | --- |")
    for row in rows:
        print(f"| {row.name} | {row.ap:.3f} | {row.parameters:,} | {row.full_parameters:,} | {row.ms:.1f} |")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
