from __future__ import annotations

import unittest

import numpy as np

from anchors import fit_anchors, seed_centres
from boxes import size_iou


def cluster(width: float, height: float, rng: np.random.Generator, count: int = 50) -> np.ndarray:
    return np.array([width, height]) * rng.uniform(0.95, 1.05, (count, 2))


class Anchors(unittest.TestCase):
    def test_finds_the_means_of_separate_clusters_by_area(self):
        rng = np.random.default_rng(1)
        groups = [cluster(100, 200, rng), cluster(10, 30, rng), cluster(60, 20, rng)]
        anchors = fit_anchors(np.concatenate(groups), 3)
        expected = [groups[1].mean(0), groups[2].mean(0), groups[0].mean(0)]
        np.testing.assert_allclose(anchors, expected, rtol=1e-9)

    def test_distance_is_of_overlap_not_of_pixels(self):
        """In pixels, 30 x 30 is nearer to 10 x 10 than to 80 x 80; by overlap it is nearer to 80 x 80."""
        overlap = size_iou(np.array([[30.0, 30.0]]), np.array([[10.0, 10.0], [80.0, 80.0]]))[0]
        np.testing.assert_allclose(overlap, [100 / 900, 900 / 6400])
        sizes = np.repeat([[10.0, 10.0], [80.0, 80.0], [30.0, 30.0]], [40, 40, 1], axis=0)
        np.testing.assert_allclose(fit_anchors(sizes, 2), [[10, 10], [(40 * 80 + 30) / 41] * 2])

    def test_seeding_never_takes_a_size_that_is_taken(self):
        sizes = np.array([[10.0, 10.0]] * 99 + [[100.0, 100.0]])
        for seed in range(20):
            centres = seed_centres(sizes, 2, np.random.default_rng(seed))
            self.assertEqual(sorted(centres[:, 0].tolist()), [10.0, 100.0])

    def test_the_same_seed_gives_the_same_anchors(self):
        sizes = np.random.default_rng(2).uniform(5, 200, (300, 2))
        np.testing.assert_array_equal(fit_anchors(sizes, 9, seed=4), fit_anchors(sizes, 9, seed=4))

    def test_refuses_what_cannot_be_clustered(self):
        with self.assertRaisesRegex(ValueError, "at least as many boxes"):
            fit_anchors(np.array([[1.0, 1.0]]), 2)
        with self.assertRaisesRegex(ValueError, "positive"):
            fit_anchors(np.array([[1.0, 1.0], [0.0, 3.0]]), 2)
        with self.assertRaisesRegex(ValueError, "only 1 different"):
            fit_anchors(np.ones((5, 2)), 2)
