"""Checkpoints: all that a run of train.py needs to go on, and the averaged weights (EMA) that are measured and shipped."""
from __future__ import annotations

import os
from pathlib import Path

import torch

from dataset import DataError
from network import NetworkOptions, Yolo


def read_checkpoint(path: Path) -> dict:
    if not path.is_file():
        raise DataError(f"{path}: no such file")
    return torch.load(path, map_location="cpu")


def load_checkpoint(path: Path) -> tuple[Yolo, dict]:
    """The averaged network (EMA) of a checkpoint, ready to look, and all that the checkpoint holds."""
    saved = read_checkpoint(path)
    network = Yolo(NetworkOptions(**saved["options"]))
    network.load_state_dict(saved["ema"])
    return network.eval(), saved


def save_checkpoint(path: Path, state: dict) -> None:
    """Replaces the file in one go: whoever is interrupted keeps the last whole one."""
    temporary = path.with_suffix(".part")
    torch.save(state, temporary)
    os.replace(temporary, path)
