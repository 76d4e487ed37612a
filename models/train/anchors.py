"""Anchors: the sizes of boxes that each detection layer starts from.

K-means over the training boxes with the distance 1 - IoU, seeded as in K-means++ (Gan et al. 2024, eqs. 9 and 10; Arthur and
Vassilvitskii 2007).
"""
from __future__ import annotations

import numpy as np

from boxes import size_iou


def seed_centres(sizes: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Each next centre is drawn with a probability proportional to its squared distance from the nearest one (eq. 10)."""
    centres = sizes[rng.integers(len(sizes))][None]
    while len(centres) < count:
        squared = (1 - size_iou(sizes, centres)).min(1) ** 2
        if squared.sum() <= 0:
            raise ValueError(f"{count} anchors asked for, but the boxes have only {len(centres)} different sizes")
        centres = np.vstack((centres, sizes[rng.choice(len(sizes), p=squared / squared.sum())]))
    return centres


def fit_anchors(sizes: np.ndarray, count: int, seed: int = 0, restarts: int = 5, iterations: int = 100) -> np.ndarray:
    """`count` sizes (width, height), by ascending area, and the best of several starts by the mean overlap with the boxes."""
    if len(sizes) < count or (sizes <= 0).any():
        raise ValueError(f"{count} anchors need at least as many boxes, all of a positive size; there are {len(sizes)}")
    rng = np.random.default_rng(seed)
    best, best_overlap = None, -1.0
    for _ in range(restarts):
        centres = seed_centres(sizes, count, rng)
        assigned = None
        for _ in range(iterations):
            nearest = size_iou(sizes, centres).argmax(1)
            if assigned is not None and (nearest == assigned).all():
                break
            assigned = nearest
            # The mean of each cluster (eq. 9); one that lost all its boxes stays where it is.
            centres = np.array([sizes[assigned == i].mean(0) if (assigned == i).any() else centres[i] for i in range(count)])
        overlap = size_iou(sizes, centres).max(1).mean()
        if overlap > best_overlap:
            best, best_overlap = centres, overlap
    return best[np.argsort(best.prod(1))]
