from __future__ import annotations

import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from dataset import Sample
from evaluate import at_scores, measure
from metrics import AveragePrecision, decode, suppress

ONE = np.array([[0.0, 0, 10, 10]])
TWO = np.array([[0.0, 0, 10, 10], [50, 50, 60, 60]])


class Precision(unittest.TestCase):
    def test_all_found_is_one(self):
        ap = AveragePrecision()
        ap.add(TWO, np.array([0.9, 0.8]), TWO)
        self.assertAlmostEqual(ap.value(), 1.0)

    def test_nothing_found_is_zero(self):
        ap = AveragePrecision()
        ap.add(np.zeros((0, 4)), np.zeros(0), TWO)
        self.assertEqual(ap.value(), 0.0)

    def test_area_by_hand(self):
        """By confidence: right, wrong, right, of four people. Precision 1 up to a recall of 1/4, 2/3 up to 1/2, then 0."""
        ap = AveragePrecision()
        ap.add(np.vstack((ONE, ONE + 100)), np.array([0.9, 0.8]), np.vstack((ONE, ONE + 300, ONE + 400)))
        ap.add(ONE, np.array([0.7]), ONE)
        self.assertAlmostEqual(ap.value(), 0.25 * 1 + 0.25 * 2 / 3)

    def test_a_person_found_twice_is_one_hit_and_one_mistake(self):
        ap = AveragePrecision()
        ap.add(np.vstack((ONE, ONE + 1)), np.array([0.9, 0.8]), ONE)
        self.assertEqual(ap.hits, [True, False])

    def test_overlap_decides(self):
        ap = AveragePrecision(0.5)
        ap.add(np.array([[0.0, 0, 10, 4.9]]), np.array([0.9]), ONE)
        self.assertEqual(ap.hits, [False])

    def test_recall_and_precision_at_a_score(self):
        ap = AveragePrecision()
        ap.add(np.vstack((TWO, ONE + 200)), np.array([0.9, 0.3, 0.5]), TWO)
        self.assertEqual(at_scores(ap, (0.2, 0.4, 0.95)), [(0.2, 1.0, 2 / 3), (0.4, 0.5, 0.5), (0.95, 0.0, 1.0)])

    def test_small_people_are_neither_missed_nor_false(self):
        class Finds:
            name, width, height = "all", 100, 100

            def __call__(self, image):
                return np.array([[0.0, 0, 40, 40], [60, 60, 65, 65], [80, 0, 84, 4]]), np.array([0.9, 0.8, 0.7])

        truth = np.array([[0, 0, 40, 40], [60, 60, 65, 65], [10, 80, 14, 84]], np.float32)
        sample = Sample(Path("x"), np.zeros((100, 100, 3), np.uint8), np.zeros(3, int), truth)
        ap, _ = measure(Finds(), [sample], 0.5, least_area=0.02)
        self.assertEqual((ap.truths, ap.hits), (1, [True]))


class Decoding(unittest.TestCase):
    def test_a_cell_by_hand(self):
        head = torch.full((1, 18, 4, 4), -20.0)
        values = head.view(1, 3, 6, 4, 4)
        values[0, 1, :, 2, 3] = torch.tensor([0.0, 0.0, 0.0, np.log(3.0), 2.0, 0.0])
        found = decode((head,), np.array([[[8, 8], [10, 20], [30, 30]]]), (8,), 1, 0.5)[0]
        centre, size = np.array([3.5 * 8, 2.5 * 8]), np.array([10, 20 * 1.5**2])
        np.testing.assert_allclose(found.boxes, [np.concatenate((centre - size / 2, centre + size / 2))], rtol=1e-5)
        np.testing.assert_allclose(found.scores, [1 / (1 + np.exp(-2.0))], rtol=1e-5)

    def test_an_anchors_second_box_reaches_twice_as_far_and_is_spared_by_the_first(self):
        heads = torch.full((2, 24, 2, 2), -20.0), torch.full((2, 24, 1, 1), -20.0)
        values = heads[1].view(2, 2, 2, 6)
        values[1, 1, 0] = torch.tensor([0.0, 0.0, 0.0, 0.0, 2.0, 0.0])
        values[1, 1, 1] = torch.tensor([-20.0, 20.0, 0.0, 0.0, 1.0, 0.0])
        values[1, 0, 0] = torch.tensor([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])  # the other anchor, where the first box is
        anchors = np.array([[[8, 8], [9, 9]], [[100, 100], [100, 110]]])
        nobody, found = decode(heads, anchors, (8, 16), 1, 0.5, 2)
        self.assertEqual(len(nobody.boxes), 0)
        boxes, scores = suppress(found, 0.25)
        np.testing.assert_allclose((boxes[:, :2] + boxes[:, 2:]) / 2, [[8, 8], [-24, 40]], atol=1e-3)
        np.testing.assert_allclose(scores, 1 / (1 + np.exp([-2.0, -1.0])), rtol=1e-5)
        separate = replace(found, places=np.arange(3))
        self.assertEqual(len(suppress(separate, 0.25)[0]), 1)
