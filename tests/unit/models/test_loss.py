from __future__ import annotations

import math
import unittest

import numpy as np
import torch

from boxes import complete_iou, iou_matrix, paired_iou, suppress_overlaps
from loss import DetectionLoss, match_targets, nearest_of_each_cell, partners
from metrics import decode


class Overlaps(unittest.TestCase):
    def test_iou_by_hand(self):
        a = np.array([[0.0, 0, 10, 10]])
        b = np.array([[0.0, 0, 10, 10], [5, 5, 15, 15], [20, 20, 30, 30], [2, 2, 4, 4]])
        np.testing.assert_allclose(iou_matrix(a, b)[0], [1, 25 / 175, 0, 4 / 100])

        def centred(boxes):
            return torch.tensor(np.concatenate(((boxes[:, :2] + boxes[:, 2:]) / 2, boxes[:, 2:] - boxes[:, :2]), 1))

        np.testing.assert_allclose(paired_iou(centred(a), centred(b)).numpy(), iou_matrix(a, b)[0])

    def test_complete_iou_by_hand(self):
        """Zheng et al. 2020: overlap, less the distance of the centres, less the difference of the proportions."""
        same = torch.tensor([[5.0, 5, 4, 8]])
        self.assertAlmostEqual(float(complete_iou(same, same)), 1.0, places=5)
        shifted = torch.tensor([[8.0, 5, 4, 8]])  # joint 1 x 8; both in a box of 7 x 8; centres 3 apart
        self.assertAlmostEqual(float(complete_iou(shifted, same)), 8 / 56 - 9 / 113, places=5)
        wide = torch.tensor([[5.0, 5, 8, 4]])  # joint 4 x 4 of 48; the centres agree
        v = 4 / math.pi**2 * (math.atan(8 / 4) - math.atan(4 / 8)) ** 2
        self.assertAlmostEqual(float(complete_iou(wide, same)), 1 / 3 - v * v / (1 - 1 / 3 + v), places=5)

    def test_descending_the_loss_moves_a_box_to_its_target(self):
        truth = torch.tensor([[5.0, 5, 6, 8]])
        for predicted, up in (([8.0, 3, 6, 8], (-1, 1)), ([2.0, 5.5, 6, 8], (1, -1))):
            box = torch.tensor([predicted], requires_grad=True)
            complete_iou(box, truth).sum().backward()
            self.assertEqual(tuple(box.grad[0, :2].sign().tolist()), up)
        for predicted, up in (([5.0, 5, 3, 4], (1, 1)), ([5.0, 5, 9, 12], (-1, -1))):
            box = torch.tensor([predicted], requires_grad=True)
            complete_iou(box, truth).sum().backward()
            self.assertEqual(tuple(box.grad[0, 2:].sign().tolist()), up)

    def test_suppression_keeps_the_most_confident_of_a_heap(self):
        boxes = np.array([[0.0, 0, 10, 10], [1, 0, 11, 10], [30, 30, 40, 40], [0, 1, 10, 11]])
        kept = suppress_overlaps(boxes, np.array([0.6, 0.9, 0.3, 0.5]), 0.5)
        self.assertEqual(kept.tolist(), [1, 2])


class Matching(unittest.TestCase):
    anchors = torch.tensor([[2.0, 4.0], [20.0, 40.0]])

    def match(self, x: float, y: float, w: float, h: float, rows: int = 10, columns: int = 12):
        targets = torch.tensor([[1.0, 0, x, y, w, h]])
        found = match_targets(targets, self.anchors, rows, columns, 4.0)
        self.assertTrue((found.image == 1).all() and (found.target == 0).all())
        return sorted(zip(found.anchor.tolist(), found.column.tolist(), found.row.tolist())), found.boxes(targets, found.target)

    def test_own_cell_and_the_two_nearest_neighbours(self):
        cells, box = self.match(5.2, 3.7, 2, 4)
        self.assertEqual(cells, [(0, 4, 3), (0, 5, 3), (0, 5, 4)])
        self.assertTrue(((box[:, :2] >= -0.5) & (box[:, :2] <= 1.5)).all())  # what the decoding can reach
        self.assertEqual(box[:, 2:].tolist(), [[2, 4]] * 3)

    def test_no_neighbour_outside_of_the_image(self):
        self.assertEqual(self.match(0.3, 9.8, 2, 4)[0], [(0, 0, 9)])

    def test_anchors_by_the_ratio_of_the_sides(self):
        self.assertEqual({c[0] for c in self.match(5.2, 3.7, 7.9, 15.9)[0]}, {0, 1})
        self.assertEqual({c[0] for c in self.match(5.2, 3.7, 8.1, 16.1)[0]}, {1})
        self.assertEqual(self.match(5.2, 3.7, 0.4, 4)[0], [])

    def test_a_cell_that_two_boxes_claim_is_that_of_the_nearer_centre(self):
        left, right = [0.0, 0, 5.2, 3.5, 2, 4], [0.0, 0, 6.1, 3.5, 2.5, 4]
        elsewhere = [1.0, 0, 5.4, 3.5, 2, 4]  # in another image
        for targets in (torch.tensor([left, right, elsewhere]), torch.tensor([right, elsewhere, left])):
            found = match_targets(targets, self.anchors[:1], 10, 12, 4.0)
            nearest = nearest_of_each_cell(found, targets, 1, 10, 12)

            def cells(matches):
                return list(zip(matches.image.tolist(), matches.column.tolist(), matches.row.tolist()))

            widths = dict(zip(cells(nearest), targets[nearest.target, 4].tolist()))
            self.assertEqual(len(widths), len(nearest))  # each cell once
            self.assertEqual(sorted(widths), sorted(set(cells(found))))
            self.assertEqual((widths[0, 5, 3], widths[0, 6, 3], widths[1, 5, 3]), (2.0, 2.5, 2.0))
        nobody = torch.zeros(0, 6)
        self.assertEqual(len(nearest_of_each_cell(match_targets(nobody, self.anchors, 10, 12, 4.0), nobody, 2, 10, 12)), 0)

    def test_the_partner_is_who_overlaps_most_in_the_same_image(self):
        targets = torch.tensor([[0.0, 0, 50, 50, 20, 40], [0, 0, 58, 50, 20, 40], [0, 0, 53, 50, 20, 40], [1, 0, 50, 50, 20, 40],
                                [0, 0, 90, 50, 20, 40]])
        self.assertEqual(partners(targets, 0.3).tolist(), [2, 2, 0, -1, -1])
        self.assertEqual(partners(targets, 0.9).tolist(), [-1] * 5)
        self.assertEqual(partners(torch.zeros(0, 6), 0.3).tolist(), [])


class Loss(unittest.TestCase):
    def setUp(self):
        anchors = torch.tensor([[[8.0, 16]] * 3, [[32.0, 64]] * 3, [[64.0, 128]] * 3])
        self.loss = DetectionLoss(anchors, (8, 16, 32), 1)
        self.heads = tuple(torch.zeros(1, 18, 64 // s, 64 // s, requires_grad=True) for s in (8, 16, 32))

    def gradients(self, targets: torch.Tensor) -> list[torch.Tensor]:
        total, _ = self.loss(self.heads, targets)
        total.backward()
        return [h.grad.view(3, 6, *h.shape[2:]) for h in self.heads]

    def test_without_people_objectness_goes_down_everywhere_and_nothing_else_moves(self):
        for gradient in self.gradients(torch.zeros(0, 6)):
            self.assertTrue((gradient[:, 4] > 0).all())
            gradient[:, 4] = 0
            self.assertEqual(float(gradient.abs().max()), 0.0)

    def test_objectness_goes_up_only_where_the_person_is(self):
        """A box of 8 x 16 in the middle of the cell (row 3, column 2) of the finest layer, which predicts just that at first."""
        fine, middle, coarse = self.gradients(torch.tensor([[0.0, 0, 20, 28, 8, 16]]))
        up = (fine[:, 4] < 0).nonzero().tolist()
        self.assertEqual(up, [[0, 3, 2], [1, 3, 2], [2, 3, 2]])
        self.assertTrue((middle[:, 4] > 0).any() and (coarse[:, 4] > 0).all())

    def test_a_perfect_box_costs_nothing(self):
        for width, height, perfect in ((8, 16, True), (12, 16, False)):
            _, parts = self.loss(self.heads, torch.tensor([[0.0, 0, 20, 28, width, height]]))
            self.assertEqual(parts["box"] < 1e-5, perfect)


class TwoBoxes(unittest.TestCase):
    """Two people who overlap by 0.6, and one who stands alone; heads that are free to become anything."""

    strides = (8, 16, 32)
    anchors = np.array([[[20, 40]] * 3, [[40.0, 80]] * 3, [[60, 120]] * 3])
    pair = torch.tensor([[0.0, 0, 60, 64, 40, 80], [0, 0, 70, 64, 40, 80], [0, 0, 150, 64, 40, 80]])

    def setUp(self):
        self.loss = DetectionLoss(torch.tensor(self.anchors), self.strides, 1, 2)

    def heads(self) -> tuple[torch.Tensor, ...]:
        return tuple(torch.zeros(1, 36, 128 // s, 192 // s, requires_grad=True) for s in self.strides)

    def test_an_anchor_learns_both_people_of_a_pair_and_of_one_alone_the_one(self):
        heads = self.heads()
        optimizer = torch.optim.Adam(heads, 0.2)
        for _ in range(100):
            optimizer.zero_grad()
            self.loss(heads, self.pair)[0].backward()
            optimizer.step()
        found = decode(heads, self.anchors, self.strides, 1, 0.5, 2)[0]
        truth = self.pair[:, 2:].numpy()
        truth = np.concatenate((truth[:, :2] - truth[:, 2:] / 2, truth[:, :2] + truth[:, 2:] / 2), 1)
        overlaps = iou_matrix(found.boxes, truth)
        self.assertGreater(overlaps.max(1).min(), 0.7)
        whose = {place: set() for place in found.places}
        for place, person in zip(found.places, overlaps.argmax(1)):
            whose[place].add(int(person))
        groups = list(whose.values())
        self.assertTrue(all(people <= {0, 1} or people == {2} for people in groups))
        self.assertGreater(groups.count({0, 1}), len(groups) / 3)
        self.assertIn({2}, groups)
        self.assertTrue(all((found.places == place).sum() == len(people) for place, people in whose.items()))

    def test_which_box_is_whose_is_left_to_them(self):
        """In a cell between the two either order is in reach: that counts which costs less, so that none of the boxes is drawn away."""
        loss = DetectionLoss(torch.tensor([[[60.0, 120]]] * 3), self.strides, 1, 2)
        targets = self.pair[:2].clone()
        targets[:, 2:] /= 32
        matches = nearest_of_each_cell(match_targets(targets, loss.anchors[2] / 32, 4, 6, 4.0), targets, 1, 4, 6)
        for order in ((0, 1), (1, 0)):
            chosen = torch.zeros(len(matches), 2, 6)
            for which, reach in enumerate((1, 2)):
                share = (matches.boxes(targets, torch.full_like(matches.target, order[which]))[:, :2] - 0.5) / reach / 2 + 0.5
                chosen[:, which, :2] = share.clamp(0.01, 0.99).logit()
                chosen[:, which, 2:4] = (0.5 * torch.tensor(2 / 3).sqrt()).logit()
            asked, target, overlap = loss.assigned(chosen, targets, matches, loss.anchors[2][matches.anchor] / 32, partners(targets, 0.3))
            self.assertTrue(asked.all())
            self.assertEqual(target.tolist(), [list(order)] * len(matches))
            self.assertGreater(float(overlap.min()), 0.95)

    def test_where_nobody_overlaps_anybody_second_boxes_are_asked_for_nobody(self):
        heads = self.heads()
        self.loss(heads, self.pair[2:])[0].backward()
        for head in heads:
            gradient = head.grad.view(3, 2, 6, *head.shape[2:])
            self.assertTrue((gradient[:, 1, 4] > 0).all())
            self.assertEqual(float(gradient[:, 1, :4].abs().max()), 0.0)
