"""Images with boxes, read once and kept in memory.

A folder holds NAME.jpg (or .png) and NAME.txt with a line `class x y width height` a box: centre and size as shares of the image. An
image without a text file, or with an empty one, has no box in it.
"""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

IMAGE_SUFFIXES = (".jpg", ".jpeg", ".png")


class DataError(Exception):
    """Names the file, and the line where there is one."""


@dataclass
class Sample:
    path: Path
    image: np.ndarray  # H x W x 3, 8 bit, blue, green, red
    labels: np.ndarray  # N
    boxes: np.ndarray  # N x 4 (x_min, y_min, x_max, y_max) [pixels, the first one from 0 to 1]


def parse_label(line: str, where: str, classes: int) -> tuple[int, list[float]]:
    fields = line.split()
    try:
        label, (x, y, w, h) = int(fields[0]), (float(f) for f in fields[1:])
    except (ValueError, IndexError):
        raise DataError(f'{where}: "{line.strip()}" is not "class x y width height"') from None
    if not 0 <= label < classes:
        raise DataError(f"{where}: class {label}; allowed are 0 to {classes - 1}")
    box = [x - w / 2, y - h / 2, x + w / 2, y + h / 2]
    slack = 1e-3  # rounding of whoever wrote the file
    if not (w > 0 and h > 0 and min(box) >= -slack and max(box) <= 1 + slack):
        raise DataError(f"{where}: box {x} {y} {w} {h} is empty or reaches out of the image; all are shares, 0 to 1")
    return label, [min(max(v, 0.0), 1.0) for v in box]


def read_labels(path: Path, classes: int) -> tuple[np.ndarray, np.ndarray]:
    labels, boxes = [], []
    if path.exists():
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if line.strip():
                label, box = parse_label(line, f"{path}:{number}", classes)
                labels.append(label)
                boxes.append(box)
    return np.array(labels, np.int64), np.array(boxes, np.float32).reshape(-1, 4)


def read_folder(folder: Path, classes: int = 1, longest_side: int = 0) -> list[Sample]:
    """All images of a folder by name; larger ones are shrunk to `longest_side` where that is not 0."""
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder")
    samples = []
    for path in sorted(p for p in folder.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES):
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise DataError(f"{path}: not an image that can be read")
        scale = longest_side / max(image.shape[:2]) if longest_side else 1.0
        if scale < 1:
            image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        labels, boxes = read_labels(path.with_suffix(".txt"), classes)
        height, width = image.shape[:2]
        samples.append(Sample(path, image, labels, boxes * np.array([width, height, width, height], np.float32)))
    if not samples:
        raise DataError(f"{folder}: no image ({', '.join(IMAGE_SUFFIXES)}) in it")
    return samples


def letterbox(image: np.ndarray, width: int, height: int, border: int = 114) -> tuple[np.ndarray, float, int, int]:
    """The image with its proportions kept, centred in width x height; also the scale and the border's width left and above."""
    h, w = image.shape[:2]
    scale = min(width / w, height / h)
    new_w, new_h = min(max(round(w * scale), 1), width), min(max(round(h * scale), 1), height)
    resized = cv2.resize(image, (new_w, new_h), interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    left, top = (width - new_w) // 2, (height - new_h) // 2
    out = np.full((height, width, 3), border, np.uint8)
    out[top : top + new_h, left : left + new_w] = resized
    return out, scale, left, top
