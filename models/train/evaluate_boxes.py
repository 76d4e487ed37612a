#!/usr/bin/env python3
"""Average precision, recall and precision of boxes that `posectl detect --csv` or `posectl replay --detections` wrote.

The truth is a folder of images and labels, as for training, or a text file of lines `name x_min y_min x_max y_max` [pixels, the centre
of the first one 0]. Names are those of the boxes: of the image without its ending, or the stamp. An image of the truth without any box
that was written counts as one in which nobody was found. Boxes of images that the truth does not name are an error or, with --others-empty,
false: nobody is there.
"""
from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np

from boxes import iou_matrix
from dataset import DataError, read_folder
from evaluate import at_scores
from metrics import AveragePrecision


def read_rows(path: Path, columns: int) -> dict[str, list[list[float]]]:
    """Numbers after the name, of each name."""
    rows: dict[str, list[list[float]]] = defaultdict(list)
    try:
        lines = path.read_text().splitlines()
    except OSError as error:
        raise DataError(f"{path}: {error.strerror}") from None
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        name, *values = line.split()
        try:
            if len(values) != columns:
                raise ValueError
            rows[name].append([float(v) for v in values])
        except ValueError:
            raise DataError(f'{path}:{number}: "{line}" is not a name and {columns} numbers') from None
    return rows


def read_truth(path: Path) -> dict[str, np.ndarray]:
    if path.is_dir():
        return {sample.path.stem: sample.boxes - 0.5 for sample in read_folder(path)}
    return {name: np.array(rows) for name, rows in read_rows(path, 4).items()}


def area(boxes: np.ndarray) -> np.ndarray:
    return (boxes[:, 2:] - boxes[:, :2]).prod(1)


def compare(found: dict[str, list[list[float]]], truth: dict[str, np.ndarray], overlap: float, least_area: float,
            others_empty: bool = False) -> AveragePrecision:
    """People smaller than `least_area` [pixels^2] count neither as missed nor, when found, as false."""
    unknown = sorted(set(found) - set(truth))
    if others_empty:
        truth = truth | {name: np.zeros((0, 4)) for name in unknown}
    elif unknown:
        raise DataError(f"boxes of {unknown[0]} and {len(unknown) - 1} more, of which the truth says nothing")
    ap = AveragePrecision(overlap)
    for name, boxes in truth.items():
        rows = np.array(found.get(name, []), float).reshape(-1, 5)
        large = area(boxes) >= least_area
        on_large = iou_matrix(rows[:, 1:], boxes[large]).max(1, initial=0) >= overlap
        on_small = iou_matrix(rows[:, 1:], boxes[~large]).max(1, initial=0) >= overlap
        counted = on_large | (~on_small & (area(rows[:, 1:]) >= least_area))
        ap.add(rows[counted, 1:], rows[counted, 0], boxes[large])
    return ap


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("found", type=Path, help="lines `name score x_min y_min x_max y_max`")
    parser.add_argument("truth", type=Path)
    parser.add_argument("--overlap", type=float, default=0.5, help="least intersection over union of a box that counts as found")
    parser.add_argument("--least-area", type=float, default=0.0, help="[pixels^2] smaller people are left out")
    parser.add_argument("--others-empty", action="store_true", help="images that the truth does not name show nobody")
    args = parser.parse_args()
    try:
        truth = read_truth(args.truth)
        ap = compare(read_rows(args.found, 5), truth, args.overlap, args.least_area, args.others_empty)
    except DataError as error:
        print(f"evaluate_boxes.py: {error}")
        return 65
    print(f"{len(truth)} images, {ap.truths} people: AP@{args.overlap:g} {ap.value():.4f}")
    print("score  recall  precision")
    for score, recall, precision in at_scores(ap):
        print(f"{score:5.2f}  {recall:6.3f}  {precision:9.3f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
