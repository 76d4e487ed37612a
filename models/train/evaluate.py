#!/usr/bin/env python3
"""Average precision of detectors on a folder of images with labels, and recall against precision.

With --least-area, people smaller than that share of the image count neither as missed nor, when found, as false.
"""
from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import cv2
import numpy as np
import torch

from boxes import iou_matrix
from dataset import DataError, Sample, read_folder
from engines import Detector, load_detector
from metrics import AveragePrecision

SCORES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)


def large_enough(boxes: np.ndarray, sample: Sample, least_area: float) -> np.ndarray:
    height, width = sample.image.shape[:2]
    return (boxes[:, 2:] - boxes[:, :2]).prod(1) >= least_area * width * height


def measure(detector: Detector, samples: list[Sample], overlap: float, least_area: float = 0.0) -> tuple[AveragePrecision, float]:
    """Also the mean milliseconds an image, all steps included."""
    ap = AveragePrecision(overlap)
    seconds = 0.0
    for sample in samples:
        begun = time.perf_counter()
        boxes, scores = detector(sample.image)
        seconds += time.perf_counter() - begun
        large = large_enough(sample.boxes, sample, least_area)
        truth, small = sample.boxes[large], sample.boxes[~large]
        if least_area and len(boxes):
            on_small = iou_matrix(boxes, small).max(1, initial=0) >= overlap
            on_large = iou_matrix(boxes, truth).max(1, initial=0) >= overlap
            counted = on_large | (~on_small & large_enough(boxes, sample, least_area))
            boxes, scores = boxes[counted], scores[counted]
        ap.add(boxes, scores, truth)
    return ap, 1e3 * seconds / len(samples)


def at_scores(ap: AveragePrecision, thresholds: tuple[float, ...] = SCORES) -> list[tuple[float, float, float]]:
    """(score, recall, precision) when everything less certain than the score is left out."""
    recall, precision, score = ap.curve()
    rows = []
    for threshold in thresholds:
        count = int((score >= threshold).sum())
        rows.append((threshold, recall[count - 1] if count else 0.0, precision[count - 1] if count else 1.0))
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("models", type=Path, nargs="+", help="checkpoints, exported networks (.onnx), or YOLOX networks (.onnx)")
    parser.add_argument("--data", type=Path, required=True, help="folder of images and labels")
    parser.add_argument("--size", type=int, nargs=2, metavar=("WIDTH", "HEIGHT"), help="input of checkpoints, instead of their own")
    parser.add_argument("--overlap", type=float, default=0.5, help="least intersection over union of a box that counts as found")
    parser.add_argument("--least-area", type=float, default=0.0, help="share of the image; smaller people are left out")
    parser.add_argument("--curve", type=Path, help="CSV file for the recall, precision and score of each box of the last model")
    parser.add_argument("--threads", type=int, default=1)
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    cv2.setNumThreads(args.threads)
    try:
        samples = read_folder(args.data)
        print(f"{len(samples)} images, {sum(len(s.boxes) for s in samples)} boxes")
        for path in args.models:
            detector = load_detector(path, args.size)
            ap, ms = measure(detector, samples, args.overlap, args.least_area)
            print(f"\n{detector.name} at {detector.width}x{detector.height}: AP@{args.overlap:g} {ap.value():.4f}, {ms:.1f} ms an image")
            print("score  recall  precision")
            for score, recall, precision in at_scores(ap):
                print(f"{score:5.2f}  {recall:6.3f}  {precision:9.3f}")
    except DataError as error:
        print(f"evaluate.py: {error}")
        return 65
    if args.curve:
        with args.curve.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(("recall", "precision", "score"))
            writer.writerows(zip(*(values.round(4) for values in ap.curve())))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
