"""Decoding of raw heads, and average precision."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from boxes import CENTRE_REACH, decode_boxes, iou_matrix, suppress_overlaps


@dataclass(frozen=True)
class Candidates:
    """What a network sees in one image, before suppression."""

    boxes: np.ndarray  # N x 4 [pixels of the input]
    scores: np.ndarray  # N
    places: np.ndarray  # N; equal for boxes of the same anchor in the same cell


def decode(heads: tuple[Tensor, ...], anchors: np.ndarray, strides: tuple[int, ...], classes: int, score: float,
           boxes_per_anchor: int = 1) -> list[Candidates]:
    """The candidates of at least `score`, of each image of the batch.

    The score is the objectness times the best class's; with one class it is the objectness alone.
    """
    batch = heads[0].shape[0]
    parts: list[list[tuple[np.ndarray, ...]]] = [[] for _ in range(batch)]
    begin = 0
    for head, stride, layer in zip(heads, strides, anchors):
        _, _, height, width = head.shape
        values = head.detach().float().view(batch, len(layer), boxes_per_anchor, 5 + classes, height, width)
        confidence = values[:, :, :, 4].sigmoid()
        if classes > 1:
            confidence = confidence * values[:, :, :, 5:].sigmoid().amax(3)
        found = image, anchor, which, row, column = torch.nonzero(confidence >= score, as_tuple=True)
        raw = values[image, anchor, which, :, row, column]
        boxes = decode_boxes(raw, torch.as_tensor(layer)[anchor] / stride, torch.tensor(CENTRE_REACH)[which, None])
        centre, size = (boxes[:, :2] + torch.stack((column, row), 1)) * stride, boxes[:, 2:] * stride
        boxes = torch.cat((centre - size / 2, centre + size / 2), 1)
        places = begin + (anchor * height + row) * width + column
        for i in range(batch):
            parts[i].append(tuple(part[image == i].numpy() for part in (boxes, confidence[found], places)))
        begin += len(layer) * height * width
    return [Candidates(*(np.concatenate(p) for p in zip(*of_layers))) for of_layers in parts]


def suppress(found: Candidates, iou: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Boxes and scores that stay, most confident first."""
    kept = suppress_overlaps(found.boxes, found.scores, iou, places=found.places) if len(found.boxes) else np.zeros(0, int)
    return found.boxes[kept], found.scores[kept]


def found_by(boxes: np.ndarray, scores: np.ndarray, truth: np.ndarray, overlap: float) -> np.ndarray:
    """Which true box each box finds, or -1. Each true box is found once, by the most confident box that overlaps it enough."""
    found = np.full(len(boxes), -1)
    taken = np.zeros(len(truth), bool)
    overlaps = iou_matrix(boxes, truth)
    for i in np.argsort(-scores, kind="stable") if len(truth) else ():
        candidates = np.where(taken, -1.0, overlaps[i])
        best = int(candidates.argmax())
        if candidates[best] >= overlap:
            taken[best] = True
            found[i] = best
    return found


class AveragePrecision:
    """Area under the precision-recall curve at one overlap, precision made monotonous. Boxes of one class."""

    def __init__(self, overlap: float = 0.5):
        self.overlap = overlap
        self.truths = 0
        self.scores: list[float] = []
        self.hits: list[bool] = []

    def add(self, boxes: np.ndarray, scores: np.ndarray, truth: np.ndarray) -> None:
        """One image."""
        self.truths += len(truth)
        self.scores += scores.tolist()
        self.hits += (found_by(boxes, scores, truth, self.overlap) >= 0).tolist()

    def curve(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Recall, precision and score, from the most confident box on."""
        order = np.argsort(-np.array(self.scores), kind="stable")
        hits = np.array(self.hits, float)[order]
        found = hits.cumsum()
        return found / max(self.truths, 1), found / np.arange(1, len(hits) + 1), np.array(self.scores)[order]

    def value(self) -> float:
        if not self.hits or not self.truths:
            return 0.0
        recall, precision, _ = self.curve()
        recall = np.concatenate(([0.0], recall, [recall[-1]]))
        precision = np.concatenate(([1.0], precision, [0.0]))
        envelope = np.maximum.accumulate(precision[::-1])[::-1]
        return float(np.sum(np.diff(recall) * envelope[1:]))
