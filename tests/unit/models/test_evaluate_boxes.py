import tempfile
import unittest
from pathlib import Path

from dataset import DataError
from evaluate_boxes import compare, read_rows, read_truth


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
        ap = compare(found, truth, 0.5, 0.0)
        recall, precision, score = ap.curve()
        self.assertEqual(ap.truths, 3)
        self.assertEqual(recall.tolist(), [1 / 3, 1 / 3, 2 / 3])
        self.assertEqual(precision.tolist(), [1, 1 / 2, 2 / 3])
        self.assertEqual(score.tolist(), [0.9, 0.8, 0.7])

    def test_small_people_count_neither_way(self):
        truth = read_truth(self.file("people.txt", "a 0 0 100 100\na 200 200 205 205\nb 0 0 5 5\n"))
        found = read_rows(self.file("found.txt", "a 0.9 0 0 100 100\na 0.8 200 200 205 205\nb 0.7 50 50 54 54\n"), 5)
        ap = compare(found, truth, 0.5, 1000.0)
        self.assertEqual(ap.truths, 1)
        self.assertEqual(len(ap.scores), 1)
        self.assertEqual(ap.value(), 1.0)

    def test_errors_name_file_line_and_image(self):
        with self.assertRaisesRegex(DataError, "found.txt:2.*5 numbers"):
            read_rows(self.file("found.txt", "a 0.9 0 0 1 1\na 0.9 0 0 1\n"), 5)
        with self.assertRaisesRegex(DataError, "none.txt"):
            read_rows(Path(self.folder.name) / "none.txt", 5)
        with self.assertRaisesRegex(DataError, "boxes of x"):
            compare({"x": [[0.5, 0, 0, 1, 1]]}, {}, 0.5, 0.0)

    def test_images_that_the_truth_does_not_name_may_be_empty_ones(self):
        ap = compare({"x": [[0.5, 0, 0, 9, 9]]}, {}, 0.5, 0.0, others_empty=True)
        self.assertEqual((ap.truths, ap.hits), (0, [False]))


if __name__ == "__main__":
    unittest.main()
