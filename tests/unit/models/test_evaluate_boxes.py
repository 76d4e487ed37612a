import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np

from dataset import DataError
from evaluate_boxes import Measure, compare, misses_by_kind, read_rows, read_truth


class EvaluateBoxes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def file(self, name: str, text: str) -> Path:
        path = Path(self.folder.name) / name
        path.write_text(text)
        return path

    def test_counts_people_found_missed_and_imagined(self):
        truth = read_truth(self.file("people.txt", "# stamp box\n1.5 0 0 100 100\n2.5 0 0 100 100\n2.5 200 0 300 100\n"))
        found = read_rows(self.file("found.txt", "1.5 0.9 0 0 100 95\n2.5 0.8 400 0 500 100\n2.5 0.7 201 0 300 100\n"), 5)
        ap = compare(found, truth, Measure())
        recall, precision, score = ap.curve()
        self.assertEqual(ap.truths, 3)
        self.assertEqual(recall.tolist(), [1 / 3, 1 / 3, 2 / 3])
        self.assertEqual(precision.tolist(), [1, 1 / 2, 2 / 3])
        self.assertEqual(score.tolist(), [0.9, 0.8, 0.7])

    def test_small_people_count_neither_way(self):
        truth = read_truth(self.file("people.txt", "a 0 0 100 100\na 200 200 205 205\nb 0 0 5 5\n"))
        found = read_rows(self.file("found.txt", "a 0.9 0 0 100 100\na 0.8 200 200 205 205\nb 0.7 50 50 54 54\n"), 5)
        ap = compare(found, truth, Measure(least_area=1000.0))
        self.assertEqual(ap.truths, 1)
        self.assertEqual(len(ap.scores), 1)
        self.assertEqual(ap.value(), 1.0)

    def test_errors_name_file_line_and_image(self):
        with self.assertRaisesRegex(DataError, "found.txt:2.*5 numbers"):
            read_rows(self.file("found.txt", "a 0.9 0 0 1 1\na 0.9 0 0 1\n"), 5)
        with self.assertRaisesRegex(DataError, "none.txt"):
            read_rows(Path(self.folder.name) / "none.txt", 5)
        with self.assertRaisesRegex(DataError, "boxes of x"):
            compare({"x": [[0.5, 0, 0, 1, 1]]}, {}, Measure())

    def test_images_that_the_truth_does_not_name_may_be_empty_ones(self):
        ap = compare({"x": [[0.5, 0, 0, 9, 9]]}, {}, Measure(others_empty=True))
        self.assertEqual((ap.truths, ap.hits), (0, [False]))

    def mask(self, name: str, *seen: tuple[int, int, int, int]) -> Path:
        image = np.zeros((200, 400), np.uint8)
        for x0, y0, x1, y1 in seen:
            image[y0 : y1 + 1, x0 : x1 + 1] = 255
        path = Path(self.folder.name) / f"{name}.png"
        cv2.imwrite(str(path), image)
        return path.parent

    def test_people_hidden_for_the_most_part_count_neither_way(self):
        truth = read_truth(self.file("people.txt", "a 0 0 99 99\na 200 0 299 99\n"))
        found = {"a": [[0.9, 200, 0, 299, 99], [0.8, 0, 0, 99, 99]]}
        masks = self.mask("a", (0, 0, 99, 99), (200, 0, 299, 19))
        ap = compare(found, truth, Measure(masks=masks, least_visible=0.25))
        self.assertEqual((ap.truths, ap.hits, ap.scores), (1, [True], [0.8]))
        self.assertEqual(compare(found, truth, Measure(masks=masks, least_visible=0.19)).truths, 2)
        self.assertEqual(compare({}, truth, Measure(masks=masks, least_visible=0.25)).truths, 1)

    def test_the_least_area_is_of_what_is_seen(self):
        truth = read_truth(self.file("people.txt", "a 0 0 99 99\n"))
        masks = self.mask("a", (0, 0, 99, 49), (150, 0, 399, 199))
        self.assertEqual(compare({}, truth, Measure(masks=masks, least_area=5000)).truths, 1)
        self.assertEqual(compare({}, truth, Measure(masks=masks, least_area=5001)).truths, 0)

    def test_what_others_hide_of_a_person_does_not_count_where_masks_tell_people_apart(self):
        truth = read_truth(self.file("people.txt", "a 0 0 99 99\na 50 0 149 99\n"))
        image = np.zeros((200, 400), np.uint8)
        image[:100, :50], image[:100, 50:150] = 1, 2  # the second one in front
        path = Path(self.folder.name) / "a.png"
        cv2.imwrite(str(path), image)
        found = {"a": [[0.9, 50, 0, 149, 99], [0.8, 0, 0, 99, 99]]}
        by_person = Measure(masks=path.parent, masks_by_person=True, least_visible=0.6)
        self.assertEqual(compare(found, truth, Measure(masks=path.parent, least_visible=0.6)).truths, 2)
        ap = compare(found, truth, by_person)
        self.assertEqual((ap.truths, ap.hits, ap.scores), (1, [True], [0.9]))
        self.assertEqual(compare({}, truth, Measure(masks=path.parent, masks_by_person=True, least_area=5001, least_visible=0)).truths, 1)
        image[199, 399] = 3
        cv2.imwrite(str(path), image)
        with self.assertRaisesRegex(DataError, "a.png: a pixel of person 3, where the truth has 2"):
            compare(found, truth, by_person)

    def test_a_mask_that_is_not_there_is_named(self):
        truth = read_truth(self.file("people.txt", "lost 0 0 99 99\n"))
        with self.assertRaisesRegex(DataError, "lost.png"):
            compare({}, truth, Measure(masks=Path(self.folder.name)))

    def test_boxes_in_an_ignored_one_are_left_out_unless_they_are_right(self):
        truth = read_truth(self.file("people.txt", "a 0 0 100 100\n"))
        ignored = read_rows(self.file("ignored.txt", "a 0.9 0 0 100 200\n"), 5)
        found = {"a": [[0.9, 0, 0, 100, 100], [0.8, 10, 120, 60, 180], [0.7, 60, 120, 141, 180]]}
        ap = compare(found, truth, Measure(), ignored)
        self.assertEqual((ap.hits, ap.scores), ([True, False], [0.9, 0.7]))

    def test_a_box_that_reaches_beyond_an_ignored_one_is_left_out_where_it_is_of_the_same(self):
        head_and_shirt = read_rows(self.file("ignored.txt", "a 0.9 100 0 200 100\n"), 5)
        found = {"a": [[0.9, 100, 0, 200, 300], [0.8, 100, 0, 200, 400], [0.7, 0, 0, 300, 200]]}
        ap = compare(found, {"a": np.zeros((0, 4))}, Measure(), head_and_shirt)
        self.assertEqual(ap.scores, [0.8, 0.7])


if __name__ == "__main__":
    unittest.main()

    def test_misses_by_kind(self):
        boxes = {"pair": [[100, 0, 199, 99], [130, 0, 229, 99]], "sliver": [[0, 0, 39, 99]], "hidden": [[200, 100, 299, 199]],
                 "cut": [[300, 0, 399, 99]], "other": [[100, 100, 199, 199]]}
        truth = {"a": np.array(boxes["pair"] + boxes["cut"] + boxes["hidden"], float), "b": np.array(boxes["sliver"] + boxes["other"], float)}
        self.mask("a", (100, 0, 229, 99), (300, 0, 399, 99), (200, 160, 299, 199))
        masks = self.mask("b", (0, 0, 39, 99), (100, 100, 199, 199))
        found = {"a": [[0.9, 100, 0, 199, 99], [0.8, 120, 0, 210, 99], [0.3, 300, 0, 399, 99]], "b": [[0.2, 0, 0, 39, 99]]}
        measure = Measure(masks=masks, least_visible=0.25)
        self.assertEqual(misses_by_kind(found, truth, measure, 0.25), {"pair": [2, 0], "sliver": [1, 1], "hidden": [1, 1], "cut": [1, 0], "other": [1, 1]})
        self.assertEqual(misses_by_kind(found, truth, measure, 0.85), {"pair": [2, 1], "sliver": [1, 1], "hidden": [1, 1], "cut": [1, 1], "other": [1, 1]})
        self.assertEqual(misses_by_kind({}, {"c": np.zeros((0, 4))}, measure, 0.5)["pair"], [0, 0])
