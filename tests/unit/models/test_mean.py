import tempfile
import unittest
from pathlib import Path

import torch

from dataset import DataError
from mean import mean_of


class Means(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def checkpoint(self, name: str, value: float, width: float = 0.5) -> Path:
        path = Path(self.folder.name) / name
        ema = {"weight": torch.full((2, 3), value).half(), "steps": torch.tensor(int(value))}
        torch.save({"options": {"width": width}, "anchors": [[1.0, 2.0]], "input": [64, 32], "settings": {"batch": 8}, "ema": ema,
                    "optimizer": {"much": 1}}, path)
        return path

    def test_weights_are_averaged_by_their_shares_and_counters_are_the_first_ones(self):
        first, second = self.checkpoint("a", 1), self.checkpoint("b", 5)
        mean = mean_of([(first, 3.0), (second, 1.0)])
        self.assertTrue(torch.equal(mean["ema"]["weight"], torch.full((2, 3), 2.0)))
        self.assertEqual(mean["ema"]["weight"].dtype, torch.float32)
        self.assertEqual(int(mean["ema"]["steps"]), 1)
        self.assertEqual(set(mean), {"options", "anchors", "input", "settings", "ema"})

    def test_the_mean_of_one_is_that_one(self):
        self.assertTrue(torch.equal(mean_of([(self.checkpoint("a", 3), 0.2)])["ema"]["weight"], torch.full((2, 3), 3.0)))

    def test_other_networks_bad_shares_and_absent_files_are_refused(self):
        first = self.checkpoint("a", 1)
        with self.assertRaisesRegex(DataError, "c: another network"):
            mean_of([(first, 1), (self.checkpoint("c", 1, width=0.25), 1)])
        with self.assertRaisesRegex(DataError, "negative"):
            mean_of([(first, 2), (first, -1)])
        with self.assertRaisesRegex(DataError, "negative"):
            mean_of([(first, 0)])
        with self.assertRaisesRegex(DataError, "no such file"):
            mean_of([(first, 1), (Path(self.folder.name) / "absent", 1)])


if __name__ == "__main__":
    unittest.main()
