#!/usr/bin/env python3
"""Training images of people near the camera: people cut out of labelled images, put into images that show nobody.

A person is cut out by GrabCut (Rother et al. 2004) inside its box, and kept where the result looks like one person: in one piece, filling
a good part of the box and reaching its sides. It is put into a background so that it fills half of the image's height or more, cut by
the image's edges, at times behind the lower part of the background as behind a desk. The label is what can be seen of it.
"""
from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from boxes import iou_matrix
from dataset import DataError, Sample, read_folder


@dataclass
class CutOut:
    image: np.ndarray  # H x W x 3, 8 bit, blue, green, red
    alpha: np.ndarray  # H x W, 0 to 1
    cut_below: bool  # the source image ends below it: so must the image it is put into


def cut_out(sample: Sample, index: int, least_height: float, largest_side: int = 240) -> CutOut | None:
    """The person in box `index`, or nothing where it is too small, not alone, cut at the sides or not told from what is behind it."""
    height, width = sample.image.shape[:2]
    box = sample.boxes[index]
    if box[3] - box[1] < least_height or box[2] - box[0] < 0.25 * least_height or box[0] < 2 or box[2] > width - 2:
        return None
    others = np.delete(sample.boxes, index, 0)
    if len(others) and iou_matrix(box[None], others).max() > 0.02:
        return None
    margin = 0.12 * (box[2:] - box[:2])
    x0, y0 = np.maximum(box[:2] - margin, 0).astype(int)
    x1, y1 = np.minimum(box[2:] + margin, [width, height]).astype(int)
    piece = sample.image[y0:y1, x0:x1]
    scale = min(largest_side / max(piece.shape[:2]), 1.0)
    small = cv2.resize(piece, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    inner = np.round((box - [x0, y0, x0, y0]) * scale).astype(int)
    labels = np.full(small.shape[:2], cv2.GC_BGD, np.uint8)
    labels[inner[1] : inner[3], inner[0] : inner[2]] = cv2.GC_PR_FGD
    cv2.setRNGSeed(0)
    cv2.grabCut(small, labels, None, np.zeros((1, 65)), np.zeros((1, 65)), 4, cv2.GC_INIT_WITH_MASK)
    mask = ((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, parts, statistics, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return None
    largest = 1 + statistics[1:, cv2.CC_STAT_AREA].argmax()
    left, top, w, h, area = statistics[largest]
    box_size = inner[2:] - inner[:2]
    filled = area / max(box_size.prod(), 1)
    if not 0.35 < filled < 0.85 or area < 0.9 * mask.sum() or w < 0.85 * box_size[0] or h < 0.92 * box_size[1]:
        return None
    alpha = cv2.resize((parts == largest).astype(np.float32), (piece.shape[1], piece.shape[0]), interpolation=cv2.INTER_LINEAR)
    alpha = cv2.GaussianBlur(alpha, (0, 0), 1.0)
    area_of_person = slice(int(top / scale), int((top + h) / scale) + 1), slice(int(left / scale), int((left + w) / scale) + 1)
    return CutOut(piece[area_of_person], alpha[area_of_person], bool(box[3] > height - 3))


def placed(person: CutOut, width: int, height: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The person as a layer of width x height, near and maybe beyond its edges: colours, and how much they cover (0 to 1)."""
    size = min(height * rng.uniform(0.55, 1.7) / person.image.shape[0], 1.2 * width / person.image.shape[1])
    look = cv2.resize(person.image, None, fx=size, fy=size, interpolation=cv2.INTER_LINEAR if size > 1 else cv2.INTER_AREA)
    alpha = cv2.resize(person.alpha, (look.shape[1], look.shape[0]), interpolation=cv2.INTER_LINEAR)
    if rng.random() < 0.5:
        look, alpha = look[:, ::-1], alpha[:, ::-1]
    gain, offset = rng.uniform(0.75, 1.2), rng.uniform(-15, 15)
    look = np.clip(look * gain + offset, 0, 255)
    h, w = alpha.shape
    x = int(rng.uniform(-0.4 * w, width - 0.6 * w))
    if person.cut_below:
        highest, lowest = max(height - h, 0), 0.5 * height
    else:
        highest, lowest = min(height - h, 0.05 * height), max(height - h, 0.15 * height)
    y = int(rng.uniform(highest, max(highest, lowest)))
    matrix = np.float32([[1, 0, x], [0, 1, y]])
    layer = cv2.warpAffine(look.astype(np.float32), matrix, (width, height))
    cover = cv2.warpAffine(alpha.astype(np.float32), matrix, (width, height))
    if rng.random() < 0.3:  # behind what stands in the lower part of the background
        edge = np.interp(np.arange(width), [0, width], rng.uniform(0.6, 0.95, 2) * height)
        cover = cover * (np.arange(height)[:, None] < edge)
    return layer, cover


def composite(background: np.ndarray, people: list[CutOut], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """People into a background, the last one in front; the image and the boxes of what is seen of each. Slivers have none."""
    image = background
    height, width = image.shape[:2]
    visible: list[np.ndarray] = []
    for person in people:
        layer, cover = placed(person, width, height, rng)
        image = (image * (1 - cover[..., None]) + layer * cover[..., None]).astype(np.uint8)
        visible = [v & (cover < 0.5) for v in visible] + [cover >= 0.5]
    boxes = []
    for mask in visible:
        ys, xs = np.nonzero(mask)
        if len(xs) > 0.015 * height * width:
            boxes.append([xs.min(), ys.min(), xs.max() + 1, ys.max() + 1])
    return image, np.array(boxes, float).reshape(-1, 4)


def background_of(sample: Sample, width: int, height: int, rng: np.random.Generator) -> np.ndarray:
    """A part of the image in the proportions asked for, mirrored half of the time."""
    h, w = sample.image.shape[:2]
    scale = min(w / width, h / height) * rng.uniform(0.7, 1.0)
    cut_w, cut_h = int(width * scale), int(height * scale)
    x, y = rng.integers(w - cut_w + 1), rng.integers(h - cut_h + 1)
    cut = cv2.resize(sample.image[y : y + cut_h, x : x + cut_w], (width, height), interpolation=cv2.INTER_AREA if scale > 1 else cv2.INTER_LINEAR)
    return cut[:, ::-1] if rng.random() < 0.5 else cut


def write(out: Path, name: str, image: np.ndarray, boxes: np.ndarray) -> None:
    height, width = image.shape[:2]
    cv2.imwrite(str(out / f"{name}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 90])
    shares = np.hstack(((boxes[:, :2] + boxes[:, 2:]) / 2, boxes[:, 2:] - boxes[:, :2])) / [width, height, width, height]
    (out / f"{name}.txt").write_text("".join("0 " + " ".join(f"{v:.6f}" for v in row) + "\n" for row in shares))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--people", type=Path, nargs="+", required=True, help="folders of images and labels to cut people out of")
    parser.add_argument("--backgrounds", type=Path, nargs="+", required=True, help="folders; of these, images that show nobody are taken")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--images", type=int, default=1000)
    parser.add_argument("--size", type=int, nargs=2, default=(480, 360), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--least-height", type=float, default=220, help="of a person worth cutting out [pixels]")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    try:
        samples = [s for folder in args.people for s in read_folder(folder)]
        backgrounds = [s for folder in args.backgrounds for s in read_folder(folder) if not len(s.boxes)]
    except DataError as error:
        print(f"make_composites.py: {error}")
        return 65
    cut_outs = [c for s in samples for i in range(len(s.boxes)) if (c := cut_out(s, i, args.least_height)) is not None]
    print(f"{len(cut_outs)} people, {len(backgrounds)} backgrounds", flush=True)
    if not cut_outs or not backgrounds:
        print("make_composites.py: nobody could be cut out, or no image shows nobody")
        return 65
    args.out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(args.seed)
    for i in range(args.images):
        background = background_of(backgrounds[rng.integers(len(backgrounds))], *args.size, rng)
        people = [cut_outs[rng.integers(len(cut_outs))] for _ in range(1 + (rng.random() < 0.35))]
        write(args.out, f"{i:05d}", *composite(background, people, rng))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
