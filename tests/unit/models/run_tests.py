#!/usr/bin/env python3
"""Runs the tests of the training code in one process, for importing torch takes longer than the tests. 77: torch is not here."""
from __future__ import annotations

import importlib.util
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
NEEDED = ("torch", "numpy", "cv2", "onnx")


def main() -> int:
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        print(f"skipped: {sys.executable} has no {', '.join(missing)}")
        return 77
    sys.path.insert(0, str(HERE.parents[2] / "models" / "train"))
    import torch

    torch.set_num_threads(1)
    suite = unittest.defaultTestLoader.discover(str(HERE), pattern="test_*.py", top_level_dir=str(HERE))
    return 0 if unittest.TextTestRunner(verbosity=2).run(suite).wasSuccessful() else 1


if __name__ == "__main__":
    raise SystemExit(main())
