import unittest
from pathlib import Path

import cv2
import numpy as np

from dataset import Sample
from make_composites import CutOut, background_of, composite, cut_out


def photograph(box: list[int], others: list[list[int]] | None = None) -> Sample:
    """A bright ellipse, which fills the box, before a dark wall."""
    image = np.random.default_rng(0).integers(20, 40, (400, 400, 3)).astype(np.uint8)
    centre, axes = ((box[0] + box[2]) // 2, (box[1] + box[3]) // 2), ((box[2] - box[0]) // 2, (box[3] - box[1]) // 2)
    cv2.ellipse(image, centre, axes, 0, 0, 360, (180, 200, 220), -1)
    boxes = np.array([box] + (others or []), np.float32)
    return Sample(Path("photograph"), image, np.zeros(len(boxes), np.int64), boxes)


class Composites(unittest.TestCase):
    def test_a_person_is_told_from_the_wall_behind(self):
        person = cut_out(photograph([120, 60, 260, 340]), 0, 200)
        self.assertIsNotNone(person)
        self.assertFalse(person.cut_below)
        height, width = person.alpha.shape
        self.assertLess(abs(height - 280), 12)
        self.assertLess(abs(width - 140), 12)
        self.assertGreater(person.alpha[height // 2, width // 2], 0.95)
        self.assertLess(person.alpha[3, 3], 0.05)
        self.assertLess(abs(person.alpha.mean() - np.pi / 4), 0.05)

    def test_people_who_are_small_cut_or_not_alone_are_left(self):
        self.assertIsNone(cut_out(photograph([120, 60, 260, 340]), 0, 300))
        self.assertIsNone(cut_out(photograph([0, 60, 140, 340]), 0, 200))
        self.assertIsNone(cut_out(photograph([120, 60, 260, 340], [[200, 60, 340, 340]]), 0, 200))

    def test_nothing_comes_of_a_box_in_which_nothing_stands_out(self):
        plain = Sample(Path("plain"), np.full((400, 400, 3), 90, np.uint8), np.zeros(1, np.int64), np.array([[120, 60, 260, 340]], np.float32))
        self.assertIsNone(cut_out(plain, 0, 200))

    def test_boxes_hold_what_is_seen_and_nothing_else(self):
        person = CutOut(np.full((200, 80, 3), 255, np.uint8), np.ones((200, 80), np.float32), False)
        for seed in range(40):
            image, boxes = composite(np.zeros((120, 160, 3), np.uint8), [person], np.random.default_rng(seed))
            bright = image[..., 0] > 120
            self.assertEqual(len(boxes), int(bright.sum() > 0.015 * bright.size))
            for x0, y0, x1, y1 in boxes.astype(int):
                self.assertEqual(int(bright.sum()), int(bright[y0:y1, x0:x1].sum()))
                self.assertTrue(bright[y0:y1, x0].any() and bright[y0:y1, x1 - 1].any())
                self.assertTrue(bright[y0, x0:x1].any() and bright[y1 - 1, x0:x1].any())

    def test_a_person_cut_by_the_lower_edge_reaches_the_lower_edge(self):
        person = CutOut(np.full((100, 60, 3), 255, np.uint8), np.ones((100, 60), np.float32), True)
        reached = 0
        for seed in range(40):
            _, boxes = composite(np.zeros((120, 160, 3), np.uint8), [person], np.random.default_rng(seed))
            reached += sum(int(box[3] == 120) for box in boxes)
        self.assertGreater(reached, 20)  # the others stand behind a desk

    def test_a_background_keeps_its_contents_and_takes_the_size(self):
        sample = Sample(Path("room"), np.full((90, 200, 3), 77, np.uint8), np.zeros(0, np.int64), np.zeros((0, 4), np.float32))
        image = background_of(sample, 160, 120, np.random.default_rng(0))
        self.assertEqual(image.shape, (120, 160, 3))
        self.assertTrue((image == 77).all())


if __name__ == "__main__":
    unittest.main()
