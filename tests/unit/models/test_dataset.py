from __future__ import annotations

import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np

from augment import Augmentation, augmented, paste_person, place, turned
from dataset import DataError, Sample, letterbox, read_folder


def sample(width: int, height: int, boxes: list[list[float]]) -> Sample:
    """Black, and white where a box is."""
    image = np.zeros((height, width, 3), np.uint8)
    for x0, y0, x1, y1 in boxes:
        image[int(y0) : int(y1), int(x0) : int(x1)] = 255
    return Sample(Path("sample"), image, np.zeros(len(boxes), np.int64), np.array(boxes, np.float32).reshape(-1, 4))


class Folders(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)
        cv2.imwrite(str(self.path / "a.png"), np.zeros((50, 100, 3), np.uint8))

    def refused(self, text: str) -> str:
        (self.path / "a.txt").write_text(text)
        with self.assertRaises(DataError) as caught:
            read_folder(self.path)
        return str(caught.exception)

    def test_boxes_become_pixels(self):
        (self.path / "a.txt").write_text("0 0.5 0.5 0.2 0.4\n\n0 0.1 0.2 0.2 0.4\n")
        np.testing.assert_allclose(read_folder(self.path)[0].boxes, [[40, 15, 60, 35], [0, 0, 20, 20]], atol=1e-4)

    def test_large_images_shrink_and_their_boxes_with_them(self):
        (self.path / "a.txt").write_text("0 0.5 0.5 0.2 0.4\n")
        read = read_folder(self.path, longest_side=50)[0]
        self.assertEqual(read.image.shape, (25, 50, 3))
        np.testing.assert_allclose(read.boxes, [[20, 7.5, 30, 17.5]], atol=1e-4)

    def test_an_image_without_labels_shows_nobody(self):
        self.assertEqual(read_folder(self.path)[0].boxes.shape, (0, 4))

    def test_errors_name_file_and_line(self):
        self.assertIn("a.txt:2: ", self.refused("0 0.5 0.5 0.2 0.4\n0 0.5 0.5 0.2\n"))
        self.assertIn("a.txt:1: ", self.refused("person 0.5 0.5 0.2 0.4\n"))
        self.assertIn("a.txt:1: class 1", self.refused("1 0.5 0.5 0.2 0.4\n"))
        self.assertIn("a.txt:3: box", self.refused("0 0.5 0.5 0.2 0.4\n0 0.5 0.5 0.2 0.4\n0 0.9 0.5 0.4 0.4\n"))
        self.assertIn("a.txt:1: box", self.refused("0 0.5 0.5 0 0.4\n"))
        self.assertIn("a.txt:1: box", self.refused("0 nan 0.5 0.1 0.4\n"))

    def test_a_broken_image_and_a_missing_folder_are_named(self):
        (self.path / "b.jpg").write_text("no image")
        with self.assertRaisesRegex(DataError, "b.jpg: not an image"):
            read_folder(self.path)
        with self.assertRaisesRegex(DataError, "nowhere: no such folder"):
            read_folder(self.path / "nowhere")

    def test_letterbox_keeps_the_proportions(self):
        image, scale, left, top = letterbox(np.full((50, 100, 3), 200, np.uint8), 64, 64)
        self.assertEqual((scale, left, top), (0.64, 0, 16))
        self.assertTrue((image[16:48] == 200).all() and (image[:16] == 114).all() and (image[48:] == 114).all())


class Augmentations(unittest.TestCase):
    def test_a_turn_takes_the_boxes_along(self):
        for clockwise in (True, False):
            image = turned(sample(40, 20, [[3, 2, 10, 8]]), clockwise)
            x0, y0, x1, y1 = image.boxes[0].astype(int)
            self.assertEqual(image.image.shape, (40, 20, 3))
            self.assertTrue((image.image[y0:y1, x0:x1] == 255).all())
            self.assertEqual(int((image.image[..., 0] == 255).sum()), (x1 - x0) * (y1 - y0))

    def place(self, box: list[float], window: list[float]) -> np.ndarray:
        canvas = np.zeros((100, 100, 3), np.uint8)
        _, boxes = place(canvas, (0, 0, 100, 100), sample(100, 100, [box]), np.array(window, float), Augmentation())
        return boxes

    def test_a_box_that_can_hardly_be_seen_is_dropped(self):
        self.assertEqual(len(self.place([90, 10, 110, 30], [0, 0, 100, 100])), 1)
        self.assertEqual(len(self.place([96, 10, 116, 30], [0, 0, 100, 100])), 0)

    def test_a_large_part_of_a_person_is_a_person(self):
        """A crop that shows a twentieth of a person, which fills it."""
        boxes = self.place([0, 0, 100, 100], [40, 40, 62, 62])
        np.testing.assert_allclose(boxes, [[0, 0, 100, 100]])

    def test_a_window_scales_the_boxes(self):
        np.testing.assert_allclose(self.place([30, 40, 50, 60], [20, 30, 70, 80]), [[20, 20, 60, 60]])

    def test_a_pasted_person_hides_nobody(self):
        other = sample(60, 60, [[10, 10, 40, 50]])
        for seed in range(30):
            image = np.zeros((120, 120, 3), np.uint8)
            boxes = np.array([[40, 40, 80, 80]], np.float32)
            _, found = paste_person(image, np.zeros(1, np.int64), boxes, other, Augmentation(paste=1.0), np.random.default_rng(seed))
            self.assertTrue((image[40:80, 40:80] == 0).all())
            for x0, y0, x1, y1 in found[1:].astype(int):
                self.assertEqual(image[(y0 + y1) // 2, (x0 + x1) // 2].tolist(), [255] * 3)

    def test_boxes_stay_within_the_image_and_the_same_seed_gives_the_same_image(self):
        samples = [sample(80, 60, [[10, 5, 40, 55], [50, 20, 79, 59]]), sample(50, 90, [[0, 0, 50, 90]]), sample(64, 64, [])]
        for seed in range(40):
            image, labels, boxes = augmented(samples[seed % 3], samples, 96, 64, Augmentation(), np.random.default_rng(seed))
            again, _, _ = augmented(samples[seed % 3], samples, 96, 64, Augmentation(), np.random.default_rng(seed))
            self.assertEqual(image.shape, (64, 96, 3))
            self.assertTrue((image == again).all())
            self.assertEqual(len(labels), len(boxes))
            if len(boxes):
                self.assertTrue((boxes[:, 2:] > boxes[:, :2]).all())
                self.assertTrue((boxes >= 0).all() and (boxes <= [96, 64, 96, 64]).all())
