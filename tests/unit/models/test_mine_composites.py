from __future__ import annotations

import contextlib
import io
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import cv2
import numpy as np

import mine_composites
from mine_composites import is_missed

PEOPLE = np.array([[10, 10, 60, 110], [100, 10, 150, 110]], float)


class Missed(unittest.TestCase):
    def missed(self, found: list[list[float]], people: np.ndarray = PEOPLE, least_area: float = 100, most_overlap: float = 0.55) -> bool:
        """`found`: boxes, surest first."""
        rows = np.array([[0.9 - 0.1 * i, *box] for i, box in enumerate(found)], float).reshape(-1, 5)
        return is_missed(rows, people, least_area, most_overlap)

    def test_each_person_needs_a_box_of_their_own(self):
        self.assertFalse(self.missed(PEOPLE.tolist()))
        self.assertTrue(self.missed([PEOPLE[0].tolist()]))
        self.assertTrue(self.missed([PEOPLE[0].tolist(), PEOPLE[0].tolist()]), "a second box on somebody finds nobody else")
        self.assertTrue(self.missed([]))

    def test_a_box_goes_to_whoever_is_left(self):
        close = np.array([[10, 10, 60, 110], [20, 10, 70, 110]], float)
        self.assertFalse(self.missed([[14, 10, 64, 110], [12, 10, 62, 110]], close, most_overlap=1))

    def test_small_and_covered_people_may_be_missed(self):
        self.assertFalse(self.missed([PEOPLE[0].tolist()], least_area=5001))
        close = np.array([[10, 10, 60, 110], [20, 10, 70, 110]], float)
        self.assertFalse(self.missed([close[0].tolist()], close))

    def test_where_nobody_is_nobody_is_missed(self):
        self.assertFalse(self.missed([[0, 0, 10, 10]], np.zeros((0, 4))))


class Command(unittest.TestCase):
    """Five images of one person at the left, as found by a detector."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)
        (self.root / "all").mkdir()
        for name in ("found", "missed", "invented", "displaced", "doubled"):
            cv2.imwrite(str(self.root / f"all/{name}.jpg"), np.zeros((120, 160, 3), np.uint8))
            (self.root / f"all/{name}.txt").write_text("0 0.25 0.5 0.25 0.5\n")  # 20 30 60 90
        cv2.imwrite(str(self.root / "all/empty.jpg"), np.zeros((120, 160, 3), np.uint8))
        (self.root / "found.csv").write_text("found 0.9 20 30 60 90\n"
                                             "found 0.1 100 30 140 90\n"  # nobody, and hardly believed
                                             "missed 0.25 20 30 60 90\n"
                                             "invented 0.9 20 30 60 90\ninvented 0.25 100 30 140 90\n"
                                             "displaced 0.25 30 40 80 110\ndisplaced 0.9 20 30 60 90\n"
                                             "doubled 0.9 20 30 60 90\ndoubled 0.45 24 30 64 90\n"
                                             "empty 0.25 20 30 60 90\n")

    def run_it(self, *more: str) -> tuple[int, str]:
        """Exit status and what it prints."""
        command = ["mine_composites.py", str(self.root / "all"), str(self.root / "found.csv"), str(self.root / "hard"), *more]
        with mock.patch("sys.argv", command), contextlib.redirect_stdout(io.StringIO()) as printed:
            return mine_composites.main(), printed.getvalue()

    def kept(self) -> list[str]:
        return sorted(p.name for p in (self.root / "hard").iterdir())

    def test_keeps_images_with_somebody_missed_invented_or_doubled(self):
        self.assertEqual(self.run_it(), (0, "4 of 6 are hard\n"))
        self.assertEqual(self.kept(), ["doubled.jpg", "doubled.txt", "empty.jpg", "invented.jpg", "invented.txt", "missed.jpg", "missed.txt"])

    def test_by_the_scores_that_are_given(self):
        self.run_it("--score", "0.2", "--false-score", "0.5", "--second-score", "0.5")
        self.assertEqual(self.kept(), [])

    def test_names_a_bad_line(self):
        (self.root / "found.csv").write_text("found 0.9 20 30\n")
        status, printed = self.run_it()
        self.assertEqual(status, 65)
        self.assertIn("found.csv:1: ", printed)


if __name__ == "__main__":
    unittest.main()
