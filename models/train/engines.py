"""Detectors to measure: a checkpoint, an exported network, or the reference detector.

Each takes an image (H x W x 3, 8 bit, blue, green, red) and gives boxes [pixels of that image] and scores after suppression.
"""
from __future__ import annotations

import json
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
import onnx
import torch

from checkpoints import load_checkpoint
from dataset import DataError, letterbox
from metrics import Candidates, decode, suppress

SCORE_FLOOR = 0.01  # what is less certain is not looked at
YOLOX_STRIDES = (8, 16, 32)


class Detector(Protocol):
    name: str
    width: int
    height: int

    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


def to_image(boxes: np.ndarray, scale: float, left: int, top: int, shape: tuple[int, ...]) -> np.ndarray:
    """Boxes of the letterboxed input in pixels of the image, cut to it."""
    height, width = shape[:2]
    return np.clip((boxes - [left, top, left, top]) / scale, 0, [width, height, width, height])


class CheckpointDetector:
    def __init__(self, path: Path, width: int, height: int):
        self.name, self.width, self.height = str(path), width, height
        self.network, saved = load_checkpoint(path)
        self.anchors = np.array(saved["anchors"])

    @torch.no_grad()
    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        boxed, *placement = letterbox(image, self.width, self.height)
        x = torch.from_numpy(boxed[:, :, ::-1].copy()).permute(2, 0, 1)[None].float() / 255
        options = self.network.options
        candidates = decode(self.network(x), self.anchors, options.strides, options.classes, SCORE_FLOOR, options.boxes_per_anchor)
        found, confidence = suppress(candidates[0])
        return to_image(found, *placement, image.shape), confidence


class OnnxDetector:
    """An exported network (export.py), run by OpenCV."""

    def __init__(self, path: Path):
        model = onnx.load(str(path))
        properties = {p.key: json.loads(p.value) for p in model.metadata_props}
        missing = [key for key in ("posed.anchors", "posed.strides", "posed.classes", "posed.input") if key not in properties]
        if missing:
            raise DataError(f"{path}: no {', '.join(missing)} in its properties; export.py writes them")
        self.name = str(path)
        _, self.height, self.width = properties["posed.input"]
        self.anchors, self.strides = np.array(properties["posed.anchors"]), tuple(properties["posed.strides"])
        self.classes = len(properties["posed.classes"])
        self.boxes_per_anchor = properties.get("posed.boxes_per_anchor", 1)
        self.outputs = [o.name for o in model.graph.output]
        self.network = cv2.dnn.readNetFromONNX(str(path))

    def heads(self, image: np.ndarray) -> tuple[np.ndarray, ...]:
        """Raw outputs for an image of the input's size."""
        self.network.setInput(cv2.dnn.blobFromImage(image, 1 / 255, swapRB=True))
        return tuple(self.network.forward(self.outputs))

    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        boxed, *placement = letterbox(image, self.width, self.height)
        heads = tuple(torch.from_numpy(h.copy()) for h in self.heads(boxed))
        candidates = decode(heads, self.anchors, self.strides, self.classes, SCORE_FLOOR, self.boxes_per_anchor)
        found, confidence = suppress(candidates[0])
        return to_image(found, *placement, image.shape), confidence


class YoloxDetector:
    """YOLOX as its authors export it (Ge et al. 2021): N x 85, undecoded, pixels from 0 to 255, image at the top left."""

    def __init__(self, path: Path, person: int = 0):
        self.name, self.person = str(path), person
        model = onnx.load(str(path))
        self.height, self.width = (d.dim_value for d in model.graph.input[0].type.tensor_type.shape.dim[2:])
        self.network = cv2.dnn.readNetFromONNX(str(path))
        cells, strides = [], []
        for stride in YOLOX_STRIDES:
            rows, columns = np.mgrid[0 : self.height // stride, 0 : self.width // stride]
            cells.append(np.stack((columns, rows), 2).reshape(-1, 2))
            strides.append(np.full((rows.size, 1), stride))
        self.cells, self.strides = np.concatenate(cells), np.concatenate(strides)

    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        scale = min(self.width / image.shape[1], self.height / image.shape[0])
        resized = cv2.resize(image, (round(image.shape[1] * scale), round(image.shape[0] * scale)), interpolation=cv2.INTER_LINEAR)
        boxed = np.full((self.height, self.width, 3), 114, np.uint8)
        boxed[: resized.shape[0], : resized.shape[1]] = resized
        self.network.setInput(cv2.dnn.blobFromImage(boxed))
        values = self.network.forward()[0]
        scores = values[:, 4] * values[:, 5 + self.person]
        kept = scores >= SCORE_FLOOR
        centre = (values[kept, :2] + self.cells[kept]) * self.strides[kept]
        size = np.exp(values[kept, 2:4]) * self.strides[kept]
        boxes = np.concatenate((centre - size / 2, centre + size / 2), 1)
        found, confidence = suppress(Candidates(boxes, scores[kept], np.arange(len(boxes))))
        return to_image(found, scale, 0, 0, image.shape), confidence


def load_detector(path: Path, size: tuple[int, int] | None = None) -> Detector:
    """By the kind of file. `size` (width, height) is for checkpoints; an ONNX file has its own."""
    if path.suffix != ".onnx":
        _, saved = load_checkpoint(path)
        return CheckpointDetector(path, *(size or saved["input"]))
    if not path.is_file():
        raise DataError(f"{path}: no such file")
    properties = {p.key for p in onnx.load(str(path)).metadata_props}
    return OnnxDetector(path) if "posed.anchors" in properties else YoloxDetector(path)
