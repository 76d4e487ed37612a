"""What is done to images and boxes before the network sees them.

A robot's camera sees people near and in part: only a head, an arm, legs. So besides mosaics, flips and colours there are crops right
into people, and what is left of a box stays its box as long as enough can be seen.
"""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dataset import Sample


@dataclass(frozen=True)
class Augmentation:
    mosaic: float = 0.5  # probability of four images in one
    zoom_crop: float = 0.3  # probability, without a mosaic, of a crop into a person
    zoom_side: tuple[float, float] = (0.5, 1.6)  # the crop's side, in longer sides of the person
    scale: tuple[float, float] = (0.6, 1.6)
    stretch: float = 0.25  # largest change of the proportions: the training images are squeezed
    mirror: float = 0.5
    quarter_turn: float = 0.06  # probability of an image turned by 90 degrees: people who lie
    paste: float = 0.15  # probability of a person cut out of another image by the box
    hue: float = 0.015
    saturation: float = 0.6
    brightness: float = 0.45
    grey: float = 0.05
    blur: float = 0.15
    noise: float = 0.15
    occlusion: float = 0.2  # probability of rectangles of other images in front
    least_side: float = 6.0  # [pixels] smaller boxes are not asked for
    least_visible: float = 0.25  # share of a box that must still be seen, unless it is large
    large_side: float = 40.0  # [pixels] a part so large is a person, whatever the share


# `general`: people at all distances. `near`: more of what a robot indoors sees, people who fill half the image or more and are cut by
# its edges.
AUGMENTATIONS = {
    "general": Augmentation(),
    "near": Augmentation(mosaic=0.2, zoom_crop=0.6, zoom_side=(0.6, 2.0), paste=0.1),
}

# Of composites, which show people as a robot's camera does: neither mosaics nor turns, and crops that leave them so. Their boxes are
# exact, so also what a crop leaves of a person at the image's side is one.
COMPOSITE = Augmentation(mosaic=0.0, zoom_crop=0.1, scale=(0.75, 1.3), stretch=0.15, quarter_turn=0.0, paste=0.05, least_visible=0.1,
                         large_side=14.0)


def crop_window(sample: Sample, options: Augmentation, rng: np.random.Generator) -> np.ndarray:
    """The part of the image to show (x_min, y_min, x_max, y_max) [pixels]; it may reach beyond the image."""
    height, width = sample.image.shape[:2]
    if len(sample.boxes) and rng.random() < options.zoom_crop:
        box = sample.boxes[rng.integers(len(sample.boxes))]
        side = max(box[2] - box[0], box[3] - box[1], 24.0)
        size = side * rng.uniform(*options.zoom_side)
        centre = rng.uniform(box[:2], box[2:])
        half = 0.5 * size * np.array([1.0, rng.uniform(0.75, 1.0)])
        return np.concatenate((centre - half, centre + half))
    zoom = 1 / rng.uniform(*options.scale)
    stretch = 1 + rng.uniform(-options.stretch, options.stretch)
    half = 0.5 * zoom * np.array([width * stretch, height / stretch])
    shift = rng.uniform(-0.5, 0.5, 2) * np.abs(np.array([width, height]) - 2 * half)
    centre = np.array([width, height]) / 2 + shift
    return np.concatenate((centre - half, centre + half))


def place(canvas: np.ndarray, area: tuple[int, int, int, int], sample: Sample, window: np.ndarray, options: Augmentation):
    """Draws the window of the sample into the area (x0, y0, x1, y1) of the canvas; returns labels and boxes there."""
    x0, y0, x1, y1 = area
    scale = np.array([(x1 - x0) / (window[2] - window[0]), (y1 - y0) / (window[3] - window[1])])
    matrix = np.array([[scale[0], 0, -window[0] * scale[0]], [0, scale[1], -window[1] * scale[1]]])
    image = sample.image
    shrink = 1 / scale.max()
    if shrink >= 2:  # warping alone would alias
        factor = 1 / int(shrink)
        image = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        real = np.array([image.shape[1] / sample.image.shape[1], image.shape[0] / sample.image.shape[0]])
        matrix[:, :2] = np.diag(scale / real)
    matrix[:, 2] += 0.5 * (matrix[[0, 1], [0, 1]] - 1)  # pixel centres
    canvas[y0:y1, x0:x1] = cv2.warpAffine(image, matrix, (x1 - x0, y1 - y0), flags=cv2.INTER_LINEAR, borderValue=(114, 114, 114))
    if not len(sample.boxes):
        return sample.labels, sample.boxes
    moved = (sample.boxes - np.tile(window[:2], 2)) * np.tile(scale, 2)
    cut = np.clip(moved, 0, [x1 - x0, y1 - y0, x1 - x0, y1 - y0])
    sides = cut[:, 2:] - cut[:, :2]
    share = sides.prod(1) / np.maximum((moved[:, 2:] - moved[:, :2]).prod(1), 1e-6)
    seen = (sides.min(1) >= options.least_side) & ((share >= options.least_visible) | (sides.min(1) >= options.large_side))
    return sample.labels[seen], (cut[seen] + [x0, y0, x0, y0]).astype(np.float32)


def turned(sample: Sample, clockwise: bool) -> Sample:
    """The sample turned by a quarter."""
    height, width = sample.image.shape[:2]
    x0, y0, x1, y1 = sample.boxes.T
    if clockwise:
        image, boxes = cv2.rotate(sample.image, cv2.ROTATE_90_CLOCKWISE), (height - y1, x0, height - y0, x1)
    else:
        image, boxes = cv2.rotate(sample.image, cv2.ROTATE_90_COUNTERCLOCKWISE), (y0, width - x1, y1, width - x0)
    return Sample(sample.path, image, sample.labels, np.stack(boxes, 1))


def paste_person(image: np.ndarray, labels: np.ndarray, boxes: np.ndarray, other: Sample, options: Augmentation, rng: np.random.Generator):
    """Puts a person of another image where nobody is, with a soft border; returns labels and boxes. Too small people are left."""
    if not len(other.boxes) or rng.random() >= options.paste:
        return labels, boxes
    i = rng.integers(len(other.boxes))
    x0, y0, x1, y1 = other.boxes[i].astype(int)
    piece = other.image[y0:y1, x0:x1]
    scale = rng.uniform(0.6, 1.5)
    width, height = int((x1 - x0) * scale), int((y1 - y0) * scale)
    if min(width, height) < 16 or width >= image.shape[1] or height >= image.shape[0]:
        return labels, boxes
    x, y = int(rng.integers(image.shape[1] - width)), int(rng.integers(image.shape[0] - height))
    box = np.array([x, y, x + width, y + height], np.float32)
    if len(boxes) and ((np.minimum(boxes[:, 2:], box[2:]) - np.maximum(boxes[:, :2], box[:2])).min(1) > 0).any():
        return labels, boxes
    border = max(min(width, height) // 12, 1)
    alpha = np.zeros((height, width, 1), np.float32)
    alpha[border : height - border, border : width - border] = 1
    alpha = cv2.blur(alpha, (2 * border + 1, 2 * border + 1))[..., None]
    area = image[y : y + height, x : x + width]
    area[:] = (alpha * cv2.resize(piece, (width, height), interpolation=cv2.INTER_AREA) + (1 - alpha) * area).astype(np.uint8)
    return np.append(labels, other.labels[i]), np.vstack((boxes, box))


def recolour(image: np.ndarray, options: Augmentation, rng: np.random.Generator) -> np.ndarray:
    gains = 1 + rng.uniform(-1, 1, 3) * [options.hue, options.saturation, options.brightness]
    hue, saturation, value = cv2.split(cv2.cvtColor(image, cv2.COLOR_BGR2HSV))
    ramp = np.arange(256)
    hue = cv2.LUT(hue, ((ramp * gains[0]) % 180).astype(np.uint8))
    saturation = cv2.LUT(saturation, np.clip(ramp * gains[1], 0, 255).astype(np.uint8))
    value = cv2.LUT(value, np.clip(ramp * gains[2], 0, 255).astype(np.uint8))
    image = cv2.cvtColor(cv2.merge((hue, saturation, value)), cv2.COLOR_HSV2BGR)
    if rng.random() < options.grey:
        image = cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return image


def degrade(image: np.ndarray, options: Augmentation, rng: np.random.Generator) -> np.ndarray:
    """Out of focus, in motion, in the dark."""
    if rng.random() < options.blur:
        if rng.random() < 0.5:
            image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.5, 1.8))
        else:
            length = int(rng.integers(3, 10))
            kernel = np.zeros((length, length), np.float32)
            angle = rng.uniform(0, np.pi)
            reach = 0.5 * (length - 1) * np.array([np.cos(angle), np.sin(angle)])
            middle = np.array([length - 1, length - 1]) / 2
            start, end = (np.round(p).astype(int).tolist() for p in (middle - reach, middle + reach))
            cv2.line(kernel, start, end, 1.0)
            image = cv2.filter2D(image, -1, kernel / kernel.sum())
    if rng.random() < options.noise:
        noise = rng.normal(0, rng.uniform(2, 12), image.shape).astype(np.float32)
        image = np.clip(image + noise, 0, 255).astype(np.uint8)
    return image


def occlude(image: np.ndarray, boxes: np.ndarray, other: Sample, options: Augmentation, rng: np.random.Generator) -> np.ndarray:
    """Hides up to a third of some boxes behind a piece of another image that shows nobody there."""
    if rng.random() >= options.occlusion:
        return image
    height, width = other.image.shape[:2]
    for box in boxes[: 1 + rng.integers(3)]:
        size = np.maximum(((box[2:] - box[:2]) * rng.uniform(0.2, 0.55, 2)).astype(int), 2)
        if size[0] >= width or size[1] >= height or min(size) < 4:
            continue
        source = np.array([rng.integers(width - size[0]), rng.integers(height - size[1])])
        piece = np.concatenate((source, source + size))
        if len(other.boxes) and ((np.minimum(other.boxes[:, 2:], piece[2:]) - np.maximum(other.boxes[:, :2], piece[:2])).min(1) > 0).any():
            continue
        target = rng.integers(box[:2].astype(int), np.maximum((box[2:] - size).astype(int), box[:2].astype(int)) + 1)
        x, y = np.clip(target, 0, [image.shape[1] - size[0], image.shape[0] - size[1]])
        image[y : y + size[1], x : x + size[0]] = other.image[piece[1] : piece[3], piece[0] : piece[2]]
    return image


def augmented(sample: Sample, samples: list[Sample], width: int, height: int, options: Augmentation, rng: np.random.Generator):
    """One training image (H x W x 3, 8 bit, blue, green, red) of the sample, others beside it in a mosaic; its labels and boxes."""
    canvas = np.full((height, width, 3), 114, np.uint8)
    if rng.random() < options.mosaic:
        x, y = int(rng.uniform(0.3, 0.7) * width), int(rng.uniform(0.3, 0.7) * height)
        areas = [(0, 0, x, y), (x, 0, width, y), (0, y, x, height), (x, y, width, height)]
        chosen = [sample] + [samples[i] for i in rng.integers(len(samples), size=3)]
    else:
        areas, chosen = [(0, 0, width, height)], [sample]
    chosen = [turned(s, rng.random() < 0.5) if rng.random() < options.quarter_turn else s for s in chosen]
    parts = [place(canvas, area, sample, crop_window(sample, options, rng), options) for area, sample in zip(areas, chosen)]
    labels, boxes = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    labels, boxes = paste_person(canvas, labels, boxes, samples[rng.integers(len(samples))], options, rng)
    canvas = occlude(canvas, boxes, samples[rng.integers(len(samples))], options, rng)
    canvas = degrade(recolour(canvas, options, rng), options, rng)
    if rng.random() < options.mirror:
        canvas = canvas[:, ::-1]
        boxes = boxes.copy()
        boxes[:, [0, 2]] = width - boxes[:, [2, 0]]
    return np.ascontiguousarray(canvas), labels, boxes
