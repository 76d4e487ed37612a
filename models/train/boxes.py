"""Boxes and their overlaps. A box is (x_min, y_min, x_max, y_max) unless a name says otherwise."""
from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

CENTRE_REACH = (1.0, 2.0)  # how far from the cell's middle the centre of an anchor's first and second box may be [cells]


def iou_matrix(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union of each of N boxes with each of M: N x M."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    joint = np.clip(high - low, 0, None).prod(2)
    area_a = (a[:, 2:] - a[:, :2]).prod(1)
    area_b = (b[:, 2:] - b[:, :2]).prod(1)
    return joint / np.maximum(area_a[:, None] + area_b[None, :] - joint, 1e-9)


def paired_iou(a: Tensor, b: Tensor) -> Tensor:
    """Intersection over union of boxes (centre x, centre y, width, height) with each other, by broadcasting."""
    low = torch.maximum(a[..., :2] - a[..., 2:] / 2, b[..., :2] - b[..., 2:] / 2)
    high = torch.minimum(a[..., :2] + a[..., 2:] / 2, b[..., :2] + b[..., 2:] / 2)
    joint = (high - low).clamp(0).prod(-1)
    return joint / (a[..., 2:].prod(-1) + b[..., 2:].prod(-1) - joint).clamp(1e-9)


def decode_boxes(raw: Tensor, anchors: Tensor, reach: float | Tensor) -> Tensor:
    """Raw values (x, y, width, height and whatever else) of M cells as boxes: centre relative to the cell, size; all in cells. A reach for
    all, or M x 1."""
    values = raw[:, :4].sigmoid()
    return torch.cat(((values[:, :2] * 2 - 1) * reach + 0.5, (values[:, 2:] * 2) ** 2 * anchors), 1)


def size_iou(sizes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Overlap of N and M boxes (width, height) laid on each other with a common centre: N x M."""
    joint = np.minimum(sizes[:, None, :], others[None, :, :]).prod(2)
    return joint / (sizes.prod(1)[:, None] + others.prod(1)[None, :] - joint)


def complete_iou(predicted: Tensor, truth: Tensor, eps: float = 1e-7) -> Tensor:
    """CIoU of N pairs of boxes (centre x, centre y, width, height). Zheng et al., "Distance-IoU loss", AAAI 2020, eq. 10."""
    p_low, p_high = predicted[:, :2] - predicted[:, 2:] / 2, predicted[:, :2] + predicted[:, 2:] / 2
    t_low, t_high = truth[:, :2] - truth[:, 2:] / 2, truth[:, :2] + truth[:, 2:] / 2
    joint = (torch.minimum(p_high, t_high) - torch.maximum(p_low, t_low)).clamp(0).prod(1)
    union = predicted[:, 2:].prod(1) + truth[:, 2:].prod(1) - joint + eps
    iou = joint / union
    enclosing = torch.maximum(p_high, t_high) - torch.minimum(p_low, t_low)
    diagonal = enclosing.square().sum(1) + eps
    distance = (predicted[:, :2] - truth[:, :2]).square().sum(1)
    angle = torch.atan(truth[:, 2] / (truth[:, 3] + eps)) - torch.atan(predicted[:, 2] / (predicted[:, 3] + eps))
    shape = 4 / math.pi**2 * angle.square()
    with torch.no_grad():
        weight = shape / (1 - iou + shape + eps)
    return iou - distance / diagonal - weight * shape


def suppress_overlaps(boxes: np.ndarray, scores: np.ndarray, iou: float, limit: int = 300, places: np.ndarray | None = None) -> np.ndarray:
    """Greedy non-maximum suppression: indices of the boxes that stay, most confident first. Boxes of one of the `places` spare each other:
    an anchor's two boxes are of two people (Chu et al., CVPR 2020, section 3.3)."""
    order = np.argsort(-scores, kind="stable")[:1000]
    kept: list[int] = []
    overlap = iou_matrix(boxes[order], boxes[order])
    alive = np.ones(len(order), bool)
    for i in range(len(order)):
        if alive[i] and len(kept) < limit:
            kept.append(order[i])
            spared = overlap[i] <= iou
            if places is not None:
                spared |= places[order] == places[order[i]]
            alive &= spared
    return np.array(kept, int)
