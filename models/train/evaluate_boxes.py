#!/usr/bin/env python3
"""Average precision, recall and precision of boxes that `posectl detect --csv` or `posectl replay --detections` wrote.

The truth is a folder of images and labels, as for training, or a text file of lines `name x_min y_min x_max y_max` [pixels, the centre
of the first one 0]. Names are those of the boxes: of the image without its ending, or the stamp. An image of the truth without any box
that was written counts as one in which nobody was found. Boxes of images that the truth does not name are an error or, with --others-empty,
false: nobody is there.

Truth boxes may reach over what hides a person. With --masks, the folder of images NAME.png that are not zero where somebody is seen,
--least-area is about the pixels of the mask in the box, and people of whom less than --least-visible of the box is seen count neither as
missed nor as found. Such a mask is everybody's: who stands behind another person counts as seen. With --masks-by-person a pixel's value is
whose it is: 1 for the first of the truth's lines of that image, 2 for the second, 0 for nobody; what others hide of a person then does not
count. --ignored names boxes, in the format of those found, that are neither right nor wrong: people of whom the truth does not speak.
"""
from __future__ import annotations

import argparse
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from boxes import iou_matrix
from dataset import DataError, read_folder
from evaluate import at_scores
from metrics import AveragePrecision, found_by


IGNORED_OVERLAP = 0.3  # intersection over union with an ignored box, from which on a box is of the same person


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


def visible_pixels(boxes: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """How much of the mask lies in each box; pixels whose centre a box holds."""
    sums = np.pad((mask > 0).astype(np.int64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    limits = np.array([mask.shape[1], mask.shape[0]] * 2)
    x0, y0, x1, y1 = np.clip(np.ceil(boxes) + [0, 0, 1, 1], 0, limits).astype(int).T if len(boxes) else np.zeros((4, 0), int)
    return sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]


def share_within(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The largest share of each box that lies in one of the others."""
    low, high = np.maximum(boxes[:, None, :2], others[None, :, :2]), np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    shared = np.maximum(high - low, 0).prod(2)
    return (shared / np.maximum(area(boxes), 1e-9)[:, None]).max(1, initial=0)


@dataclass(frozen=True)
class Measure:
    """What counts. People smaller than `least_area` [pixels^2], and boxes found there, count neither as missed nor as false."""

    overlap: float = 0.5
    least_area: float = 0.0
    masks: Path | None = None
    least_visible: float = 0.25
    others_empty: bool = False
    masks_by_person: bool = False

    def seen(self, name: str, boxes: np.ndarray) -> tuple[np.ndarray, int]:
        """How many pixels of the mask are in each box and its person's; and the image's width."""
        mask = cv2.imread(str(self.masks / f"{name}.png"), cv2.IMREAD_GRAYSCALE)
        if mask is None:
            raise DataError(f"{self.masks / name}.png: no mask that can be read")
        if not self.masks_by_person:
            return visible_pixels(boxes, mask), mask.shape[1]
        if mask.max() > len(boxes):
            raise DataError(f"{self.masks / name}.png: a pixel of person {mask.max()}, where the truth has {len(boxes)}")
        return np.array([visible_pixels(box[None], mask == i)[0] for i, box in enumerate(boxes, 1)]), mask.shape[1]

    def counted(self, name: str, boxes: np.ndarray) -> np.ndarray:
        if self.masks is None or not len(boxes):
            return area(boxes) >= self.least_area
        return self.seen_enough(boxes, self.seen(name, boxes)[0])

    def seen_enough(self, boxes: np.ndarray, seen: np.ndarray) -> np.ndarray:
        return (seen >= self.least_area) & (seen >= self.least_visible * area(boxes))


def compare(found: dict[str, list[list[float]]], truth: dict[str, np.ndarray], measure: Measure,
            ignored: dict[str, list[list[float]]] | None = None) -> AveragePrecision:
    """Boxes on nobody who counts are left out where they lie by half or more in an ignored one, or overlap one by IGNORED_OVERLAP: of whom
    the truth does not speak, it does not say either how far the box should reach behind what hides them."""
    unknown = sorted(set(found) - set(truth))
    if measure.others_empty:
        truth = truth | {name: np.zeros((0, 4)) for name in unknown}
    elif unknown:
        raise DataError(f"boxes of {unknown[0]} and {len(unknown) - 1} more, of which the truth says nothing")
    ap = AveragePrecision(measure.overlap)
    for name, boxes in truth.items():
        rows = np.array(found.get(name, []), float).reshape(-1, 5)
        counted = measure.counted(name, boxes)
        on_counted = iou_matrix(rows[:, 1:], boxes[counted]).max(1, initial=0) >= measure.overlap
        on_others = iou_matrix(rows[:, 1:], boxes[~counted]).max(1, initial=0) >= measure.overlap
        left_out = np.array((ignored or {}).get(name, []), float).reshape(-1, 5)[:, 1:]
        on_ignored = share_within(rows[:, 1:], left_out) >= 0.5
        on_ignored |= iou_matrix(rows[:, 1:], left_out).max(1, initial=0) >= IGNORED_OVERLAP
        kept = on_counted | (~on_others & ~on_ignored & (area(rows[:, 1:]) >= measure.least_area))
        ap.add(rows[kept, 1:], rows[kept, 0], boxes[counted])
    return ap


def kind_of(boxes: np.ndarray, i: int, seen: float, width: int) -> str:
    """Why person i might be hard to find. `seen`: share of the box."""
    others = iou_matrix(boxes[i : i + 1], np.delete(boxes, i, 0))
    is_cut = boxes[i, 0] < 2 or boxes[i, 2] > width - 3
    if others.max(initial=0) > 0.4:
        return "pair"
    if is_cut and boxes[i, 2] - boxes[i, 0] < 0.17 * width:
        return "sliver"
    if seen < 0.5:
        return "hidden"
    return "cut" if is_cut else "other"


def misses_by_kind(found: dict[str, list[list[float]]], truth: dict[str, np.ndarray], measure: Measure, score: float) -> dict[str, list[int]]:
    """People and how many of them are missed at a score, of each kind."""
    kinds = {kind: [0, 0] for kind in ("pair", "sliver", "hidden", "cut", "other")}
    for name, boxes in truth.items():
        if not len(boxes):
            continue
        seen, width = measure.seen(name, boxes)
        counted = measure.seen_enough(boxes, seen)
        rows = np.array([row for row in found.get(name, []) if row[0] >= score], float).reshape(-1, 5)
        hit = set(found_by(rows[:, 1:], rows[:, 0], boxes[counted], measure.overlap).tolist())
        for number, i in enumerate(np.flatnonzero(counted)):
            of_kind = kinds[kind_of(boxes, i, seen[i] / area(boxes)[i], width)]
            of_kind[0] += 1
            of_kind[1] += number not in hit
    return kinds


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("found", type=Path, help="lines `name score x_min y_min x_max y_max`")
    parser.add_argument("truth", type=Path)
    parser.add_argument("--overlap", type=float, default=0.5, help="least intersection over union of a box that counts as found")
    parser.add_argument("--least-area", type=float, default=0.0, help="[pixels^2] smaller people are left out")
    parser.add_argument("--masks", type=Path, help="folder of NAME.png, not zero where somebody is seen")
    parser.add_argument("--least-visible", type=float, default=0.25, help="share of the box; with --masks, people seen less are left out")
    parser.add_argument("--masks-by-person", action="store_true", help="a pixel of the masks is the number of its person, not just not zero")
    parser.add_argument("--ignored", type=Path, help="lines as of the boxes found; what is found there is left out")
    parser.add_argument("--misses-at", type=float, metavar="SCORE",
                        help="who is missed at this score, too: people whose box overlaps another one's by more than 0.4 (pair), cut by the left or "
                        "right side of the image and less than 17 %% of it wide (sliver), less than half seen (hidden), cut and wider; needs --masks")
    parser.add_argument("--others-empty", action="store_true", help="images that the truth does not name show nobody")
    args = parser.parse_args()
    if args.masks_by_person and not args.masks:
        parser.error("--masks-by-person says what --masks are")
    if args.misses_at is not None and not args.masks:
        parser.error("--misses-at needs --masks")
    try:
        truth = read_truth(args.truth)
        measure = Measure(args.overlap, args.least_area, args.masks, args.least_visible, args.others_empty, args.masks_by_person)
        found = read_rows(args.found, 5)
        ap = compare(found, truth, measure, read_rows(args.ignored, 5) if args.ignored else None)
        kinds = misses_by_kind(found, truth, measure, args.misses_at) if args.misses_at is not None else {}
    except DataError as error:
        print(f"evaluate_boxes.py: {error}")
        return 65
    print(f"{len(truth)} images, {ap.truths} people: AP@{args.overlap:g} {ap.value():.4f}")
    print("score  recall  precision")
    for score, recall, precision in at_scores(ap):
        print(f"{score:5.2f}  {recall:6.3f}  {precision:9.3f}")
    for kind, (people, missed) in kinds.items():
        print(f"{kind:6}  {missed} of {people} missed")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
