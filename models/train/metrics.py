"""Decoding of raw heads, and average precision."""
from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from boxes import iou_matrix, suppress_overlaps


def decode(heads: tuple[Tensor, ...], anchors: np.ndarray, strides: tuple[int, ...], classes: int, score: float):
    """Boxes [pixels of the input] and scores of each image of the batch: lists of N x 4 and N arrays, before suppression.

    The score is the objectness times the best class's; with one class it is the objectness alone.
    """
    batch = heads[0].shape[0]
    boxes: list[list[np.ndarray]] = [[] for _ in range(batch)]
    scores: list[list[np.ndarray]] = [[] for _ in range(batch)]
    for head, stride, layer in zip(heads, strides, anchors):
        _, _, height, width = head.shape
        values = head.detach().float().view(batch, len(layer), 5 + classes, height, width).sigmoid().numpy()
        confidence = values[:, :, 4]
        if classes > 1:
            confidence = confidence * values[:, :, 5:].max(2)
        image, anchor, row, column = np.nonzero(confidence >= score)
        v = values[image, anchor, :, row, column]
        centre = (v[:, :2] * 2 - 0.5 + np.stack((column, row), 1)) * stride
        size = (v[:, 2:4] * 2) ** 2 * np.asarray(layer)[anchor]
        found = np.concatenate((centre - size / 2, centre + size / 2), 1)
        for i in range(batch):
            boxes[i].append(found[image == i])
            scores[i].append(confidence[image, anchor, row, column][image == i])
    return [np.concatenate(b) for b in boxes], [np.concatenate(s) for s in scores]


def suppress(boxes: np.ndarray, scores: np.ndarray, iou: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    kept = suppress_overlaps(boxes, scores, iou) if len(boxes) else np.zeros(0, int)
    return boxes[kept], scores[kept]


class AveragePrecision:
    """Area under the precision-recall curve at one overlap, precision made monotonous. Boxes of one class."""

    def __init__(self, overlap: float = 0.5):
        self.overlap = overlap
        self.truths = 0
        self.scores: list[float] = []
        self.hits: list[bool] = []

    def add(self, boxes: np.ndarray, scores: np.ndarray, truth: np.ndarray) -> None:
        """One image. Each true box is found once, by the most confident box that overlaps it enough."""
        self.truths += len(truth)
        taken = np.zeros(len(truth), bool)
        overlaps = iou_matrix(boxes, truth) if len(boxes) and len(truth) else np.zeros((len(boxes), len(truth)))
        for i in np.argsort(-scores, kind="stable"):
            candidates = np.where(taken, -1.0, overlaps[i])
            best = int(candidates.argmax()) if len(truth) else -1
            hit = best >= 0 and candidates[best] >= self.overlap
            if hit:
                taken[best] = True
            self.scores.append(float(scores[i]))
            self.hits.append(bool(hit))

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
