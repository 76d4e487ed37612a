#!/usr/bin/env python3
"""Keeps those composites (make_composites.py) that a detector gets wrong, to train on more often than on the others.

Wrong are images in which it misses somebody who can well be seen, or finds somebody where nobody is, or surely finds somebody a second
time, or in the wrong place. Negatives chosen so are those of Sung and Poggio, "Example-based learning for view-based human face
detection", PAMI 1998, section 3.4 ("bootstrap").
"""
from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np

from boxes import iou_matrix
from dataset import DataError, Sample, read_folder
from evaluate_boxes import area, read_rows
from metrics import found_by

HIT_OVERLAP = 0.5
NEAR_OVERLAP = 0.3  # below it with everybody a box is on nobody: not only badly placed


def is_missed(rows: np.ndarray, boxes: np.ndarray, least_area: float, most_overlap: float) -> bool:
    """Whether somebody has no box of their own (`rows`: N x 5, score and box) who is larger than `least_area` and whose box nobody else's
    overlaps by more than `most_overlap`: of whom stands behind another one too little may be seen."""
    missed = np.ones(len(boxes), bool)
    hits = found_by(rows[:, 1:], rows[:, 0], boxes, HIT_OVERLAP)
    missed[hits[hits >= 0]] = False
    among = iou_matrix(boxes, boxes)
    np.fill_diagonal(among, 0.0)
    return bool((missed & (area(boxes) >= least_area) & (among.max(1, initial=0.0) <= most_overlap)).any())


def is_hard(sample: Sample, rows: np.ndarray, args: argparse.Namespace) -> bool:
    """`rows`: N x 5 (score, box)."""
    nobody = iou_matrix(rows[:, 1:], sample.boxes).max(1, initial=0.0) < NEAR_OVERLAP
    if (nobody & (rows[:, 0] >= args.false_score)).any():
        return True
    finds_nobody = found_by(rows[:, 1:], rows[:, 0], sample.boxes, HIT_OVERLAP) < 0
    if (finds_nobody & (rows[:, 0] >= args.second_score)).any():
        return True
    height, width = sample.image.shape[:2]
    return is_missed(rows[rows[:, 0] >= args.score], sample.boxes, args.least_share * height * width, args.most_overlap)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("composites", type=Path, help="folder of images and labels")
    parser.add_argument("found", type=Path, help="lines `name score x0 y0 x1 y1`, as of `posectl detect --csv`")
    parser.add_argument("out", type=Path, help="folder to copy the hard ones to")
    parser.add_argument("--score", type=float, default=0.3, help="from which on somebody is found")
    parser.add_argument("--false-score", type=float, default=0.2, help="from which on it is wrong to find nobody")
    parser.add_argument("--second-score", type=float, default=0.4, help="from which on a second or displaced box on somebody is wrong")
    parser.add_argument("--least-share", type=float, default=0.03, help="of the image: smaller people may be missed")
    parser.add_argument("--most-overlap", type=float, default=0.55, help="people whose box another one overlaps by more may be missed")
    args = parser.parse_args()
    try:
        samples, found = read_folder(args.composites), read_rows(args.found, 5)
    except DataError as error:
        print(f"mine_composites.py: {error}")
        return 65
    hard = [s for s in samples if is_hard(s, np.array(found.get(s.path.stem, []), float).reshape(-1, 5), args)]
    args.out.mkdir(parents=True, exist_ok=True)
    for sample in hard:
        for path in (sample.path, sample.path.with_suffix(".txt")):
            if path.exists():
                shutil.copy(path, args.out)
    print(f"{len(hard)} of {len(samples)} are hard")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
