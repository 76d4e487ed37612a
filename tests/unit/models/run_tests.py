#!/usr/bin/env python3
"""Runs the tests of the training code in one process, for importing torch takes longer than the tests.

Exit status 77: torch is not here. A file of tests that needs OpenCV or onnx where there is none is left out, and named.
"""
from __future__ import annotations

import importlib
import importlib.util
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
NEEDED = ("torch", "numpy")
OPTIONAL = ("cv2", "onnx")


def load_tests() -> unittest.TestSuite:
    suite = unittest.TestSuite()
    for path in sorted(HERE.glob("test_*.py")):
        try:
            suite.addTests(unittest.defaultTestLoader.loadTestsFromModule(importlib.import_module(path.stem)))
        except ModuleNotFoundError as error:
            if error.name not in OPTIONAL:
                raise
            print(f"left out: {path.name}, for {sys.executable} has no {error.name}")
    return suite


def main() -> int:
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        print(f"skipped: {sys.executable} has no {', '.join(missing)}")
        return 77
    sys.path[:0] = [str(HERE), str(HERE.parents[2] / "models" / "train")]
    import torch

    torch.set_num_threads(1)
    return 0 if unittest.TextTestRunner(verbosity=2).run(load_tests()).wasSuccessful() else 1


if __name__ == "__main__":
    raise SystemExit(main())
