"""Training images of people near the camera: people who were cut out, put into images that show nobody.

People come with a mask each, or are cut out of labelled images by GrabCut (Rother et al. 2004) inside their boxes, and kept where the
result looks like one person: in one piece, filling a good part of the box and reaching its sides. They are put into a background so that
they fill a third of the image's height or more, cut by the image's edges, at times behind parts of the background as behind a desk or a
screen. The label is what can be seen of them.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from boxes import iou_matrix
from dataset import DataError, Sample


LEAST_SHARE = 0.008  # of the image: of whom less is seen has no box


@dataclass
class CutOut:
    image: np.ndarray  # H x W x 3, 8 bit, blue, green, red
    alpha: np.ndarray  # H x W, 0 to 1
    cut_below: bool  # the source image ends below it: so must the image it is put into


def cut_out(sample: Sample, index: int, least_height: float, largest_side: int = 240) -> CutOut | None:
    """The person in box `index`, or nothing where it is too small, not alone, cut at the sides or not told from what is behind it."""
    height, width = sample.image.shape[:2]
    box = sample.boxes[index]
    if box[3] - box[1] < least_height or box[2] - box[0] < 0.25 * least_height or box[0] < 2 or box[2] > width - 2:
        return None
    others = np.delete(sample.boxes, index, 0)
    if len(others) and iou_matrix(box[None], others).max() > 0.02:
        return None
    margin = 0.12 * (box[2:] - box[:2])
    x0, y0 = np.maximum(box[:2] - margin, 0).astype(int)
    x1, y1 = np.minimum(box[2:] + margin, [width, height]).astype(int)
    piece = sample.image[y0:y1, x0:x1]
    scale = min(largest_side / max(piece.shape[:2]), 1.0)
    small = cv2.resize(piece, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    inner = np.round((box - [x0, y0, x0, y0]) * scale).astype(int)
    labels = np.full(small.shape[:2], cv2.GC_BGD, np.uint8)
    labels[inner[1] : inner[3], inner[0] : inner[2]] = cv2.GC_PR_FGD
    cv2.setRNGSeed(0)
    cv2.grabCut(small, labels, None, np.zeros((1, 65)), np.zeros((1, 65)), 4, cv2.GC_INIT_WITH_MASK)
    mask = ((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, parts, statistics, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return None
    largest = 1 + statistics[1:, cv2.CC_STAT_AREA].argmax()
    left, top, w, h, area = statistics[largest]
    box_size = inner[2:] - inner[:2]
    filled = area / max(box_size.prod(), 1)
    if not 0.35 < filled < 0.85 or area < 0.9 * mask.sum() or w < 0.85 * box_size[0] or h < 0.92 * box_size[1]:
        return None
    alpha = cv2.resize((parts == largest).astype(np.float32), (piece.shape[1], piece.shape[0]), interpolation=cv2.INTER_LINEAR)
    alpha = cv2.GaussianBlur(alpha, (0, 0), 1.0)
    area_of_person = slice(int(top / scale), int((top + h) / scale) + 1), slice(int(left / scale), int((left + w) / scale) + 1)
    return CutOut(piece[area_of_person], alpha[area_of_person], bool(box[3] > height - 3))


def cut_by_mask(image: np.ndarray, mask: np.ndarray, largest_side: int = 420) -> CutOut | None:
    """The largest person of a mask (H x W, above 127). What the image cuts at its sides is left: of shoulders that reach both, the head
    and what is above. Nothing where less than a head of some size remains."""
    scale = min(largest_side / max(mask.shape), 1.0)
    if scale < 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    mask = cv2.resize(mask, (image.shape[1], image.shape[0]), interpolation=cv2.INTER_AREA)
    count, parts, statistics, _ = cv2.connectedComponentsWithStats((mask > 127).astype(np.uint8))
    if count < 2:
        return None
    largest = 1 + statistics[1:, cv2.CC_STAT_AREA].argmax()
    person = parts == largest
    height = person.shape[0]
    at_sides = np.flatnonzero(person[:, 0] | person[:, -1])
    top = statistics[largest, cv2.CC_STAT_TOP]
    end = height
    if len(at_sides) > 0.1 * (height - top):
        end = at_sides[0]
    person[end:] = False
    ys, xs = np.nonzero(person)
    if len(xs) < 2000 or np.ptp(ys) < 50 or np.ptp(xs) < 30:
        return None
    area = slice(ys.min(), ys.max() + 1), slice(xs.min(), xs.max() + 1)
    alpha = np.minimum(mask.astype(np.float32) / 255, cv2.GaussianBlur(person.astype(np.float32), (0, 0), 0.7))
    return CutOut(image[area], alpha[area], bool(ys.max() >= min(height - 3, end - 2)))


def read_cut_outs(folder: Path) -> list[CutOut]:
    """Of every NAME_mask.png the person in NAME.jpg, where there is one to be had."""
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder")
    people = []
    for path in sorted(folder.glob("*_mask.png")):
        photograph = path.with_name(path.name.removesuffix("_mask.png") + ".jpg")
        image, mask = cv2.imread(str(photograph), cv2.IMREAD_COLOR), cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if image is None or mask is None:
            raise DataError(f"{photograph if image is None else path}: not an image that can be read")
        if (person := cut_by_mask(image, mask)) is not None:
            people.append(person)
    return people


def ragged(alpha: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The border pulled in and out by a few pixels, as a depth sensor sees one."""
    height, width = alpha.shape
    coarse = rng.normal(0, 1, (max(height // 6, 2), max(width // 6, 2))).astype(np.float32)
    noise = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)
    return (cv2.GaussianBlur(alpha, (0, 0), 3) + np.clip(0.22 * noise, -0.45, 0.45) > 0.5).astype(np.float32)


def hide(cover: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What stands before people: everything below a line, as of a desk, a block in the lower part, as of a screen, or small things on a
    desk, of any outline."""
    height, width = cover.shape
    kind = rng.random()
    if kind < 0.3:
        coarse = rng.normal(0, 1, (rng.integers(5, 12), rng.integers(5, 14))).astype(np.float32)
        things = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
        things += np.linspace(-2.5, rng.uniform(0.0, 1.2), height, dtype=np.float32)[:, None]
        things[: int(0.3 * height)] = 0  # heads stay
        return np.where(things > 0, np.float32(0), cover)
    if kind < 0.65:
        edge = np.interp(np.arange(width), [0, width], rng.uniform(0.6, 0.95, 2) * height)
        return cover * (np.arange(height)[:, None] < edge)
    left, top = rng.uniform(-0.2, 0.8) * width, rng.uniform(0.35, 0.8) * height
    corners = np.array([[0, 0], [rng.uniform(0.2, 0.6) * width, 0], [rng.uniform(0.2, 0.6) * width, height], [0, height]])
    corners += [left, top] + rng.normal(0, 0.03 * width, (4, 2))
    block = np.zeros(cover.shape, np.uint8)
    cv2.fillConvexPoly(block, np.round(corners).astype(np.int32), 1)
    return np.where(block > 0, np.float32(0), cover)


def position_across(w: int, width: int, beside: float | None, rng: np.random.Generator) -> float:
    """Left edge of a person of width w: beside another one whose middle is given, mostly cut off by a side of the image, or anywhere."""
    if beside is not None and rng.random() < 0.6:
        return beside - 0.5 * w + rng.uniform(0.15, 0.7) * w * rng.choice((-1, 1))
    if rng.random() < 0.45:
        seen = rng.uniform(0.1, 0.55) * w
        return seen - w if rng.random() < 0.5 else width - seen
    return rng.uniform(-0.5 * w, width - 0.5 * w)


def placed(person: CutOut, width: int, height: int, near: float, beside: float | None,
           rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """The person, the larger the nearer (0 to 1), as a layer of width x height, maybe beyond its edges: colours, how much they cover (0 to
    1), and where the person's middle is."""
    wanted = 0.4 + 1.0 * near if person.cut_below else 0.55 + 1.15 * near
    size = min(height * wanted / person.image.shape[0], 1.2 * width / person.image.shape[1])
    look = cv2.resize(person.image, None, fx=size, fy=size, interpolation=cv2.INTER_LINEAR if size > 1 else cv2.INTER_AREA)
    alpha = cv2.resize(person.alpha, (look.shape[1], look.shape[0]), interpolation=cv2.INTER_LINEAR)
    if rng.random() < 0.5:
        look, alpha = look[:, ::-1], alpha[:, ::-1]
    if rng.random() < 0.3:
        alpha = ragged(alpha, rng)
    gain, offset = rng.uniform(0.7, 1.2) * rng.uniform(0.92, 1.08, 3), rng.uniform(-25, 15)
    look = np.clip(look * gain + offset, 0, 255)
    h, w = alpha.shape
    x = int(position_across(w, width, beside, rng))
    if person.cut_below:
        highest, lowest = height - h, max(height - 0.45 * h, 0.35 * height)
    else:
        highest, lowest = min(height - h, 0.05 * height), max(height - h, 0.15 * height)
    y = int(rng.uniform(highest, max(highest, lowest)))
    matrix = np.float32([[1, 0, x], [0, 1, y]])
    layer = cv2.warpAffine(look.astype(np.float32), matrix, (width, height))
    cover = cv2.warpAffine(alpha.astype(np.float32), matrix, (width, height))
    return layer, hide(cover, rng) if rng.random() < 0.45 else cover, x + 0.5 * w


def composite(background: np.ndarray, people: list[tuple[CutOut, float]], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """People, each with how near (0 to 1), into a background, the last one in front; the image and their boxes. Of whom hardly anything is
    seen has none.

    A box is of all that things leave to be seen of a person, also where other people stand before it: so it stays a person's when two
    pass. Of whom others hide three quarters or more, it is of what is seen.
    """
    image = background
    height, width = image.shape[:2]
    alone: list[np.ndarray] = []
    visible: list[np.ndarray] = []
    middle = None
    for person, near in people:
        layer, cover, middle = placed(person, width, height, near, middle, rng)
        image = (image * (1 - cover[..., None]) + layer * cover[..., None]).astype(np.uint8)
        shown = cover >= 0.5
        visible = [v & ~shown for v in visible] + [shown]
        alone.append(shown)
    boxes = []
    for whole, seen in zip(alone, visible):
        pixels = seen.sum()
        if pixels > LEAST_SHARE * height * width:
            ys, xs = np.nonzero(whole if pixels > 0.25 * whole.sum() else seen)
            boxes.append([xs.min(), ys.min(), xs.max() + 1, ys.max() + 1])
    return image, np.array(boxes, float).reshape(-1, 4)


def background_of(sample: Sample, width: int, height: int, rng: np.random.Generator) -> np.ndarray:
    """A part of the image in the proportions asked for, mirrored half of the time."""
    h, w = sample.image.shape[:2]
    scale = min(w / width, h / height) * rng.uniform(0.7, 1.0)
    cut_w, cut_h = int(width * scale), int(height * scale)
    x, y = rng.integers(w - cut_w + 1), rng.integers(h - cut_h + 1)
    cut = cv2.resize(sample.image[y : y + cut_h, x : x + cut_w], (width, height), interpolation=cv2.INTER_AREA if scale > 1 else cv2.INTER_LINEAR)
    return cut[:, ::-1] if rng.random() < 0.5 else cut


def cut_thing(image: np.ndarray, size: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A piece of an image, square or round, turned, its longer side of `size` pixels; and which pixels of the result are its own."""
    height, width = image.shape[:2]
    w, h = int(rng.integers(16, max(min(width, 160), 17))), int(rng.integers(16, max(min(height, 160), 17)))
    x, y = rng.integers(max(width - w, 1)), rng.integers(max(height - h, 1))
    shape = np.full((h, w), 255, np.uint8)
    if rng.random() < 0.4:
        shape[:] = 0
        cv2.ellipse(shape, (w // 2, h // 2), (w // 2, h // 2), 0, 0, 360, 255, -1)
    side = int(1.5 * size) + 2
    turn = cv2.getRotationMatrix2D((w / 2, h / 2), rng.uniform(0, 360), size / max(w, h))
    turn[:, 2] += 0.75 * size + 1 - np.array([w, h]) / 2  # its middle to that of the square
    thing = cv2.warpAffine(image[y : y + h, x : x + w], turn, (side, side), flags=cv2.INTER_AREA)
    return thing, cv2.warpAffine(shape, turn, (side, side)) > 127


def clutter(image: np.ndarray, others: list[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Small things lie about in groups, as on a desk: cut at random from other images. A detector that has seen none takes a heap of
    them for a person."""
    height, width = image.shape[:2]
    image = image.copy()
    for _ in range(rng.integers(1, 4)):
        middle = rng.uniform([0.1, 0.3], [0.9, 0.9]) * [width, height]
        for _ in range(rng.integers(3, 16)):
            thing, cover = cut_thing(others[rng.integers(len(others))], rng.uniform(0.04, 0.16) * width, rng)
            side = thing.shape[0]
            left, top = (middle + rng.normal(0, 0.11, 2) * width - side / 2).astype(int)
            x0, y0, x1, y1 = max(left, 0), max(top, 0), min(left + side, width), min(top + side, height)
            if x1 > x0 and y1 > y0:
                part = slice(y0 - top, y1 - top), slice(x0 - left, x1 - left)
                image[y0:y1, x0:x1][cover[part]] = thing[part][cover[part]]
    return image


@dataclass
class Compositor:
    """Makes samples of people and backgrounds, a new one each time, or gives one of the hard ones, which were made so before and which a
    detector got wrong (mine_composites.py)."""

    people: list[CutOut]
    backgrounds: list[Sample]
    width: int = 400
    height: int = 300
    hard: list[Sample] = field(default_factory=list)
    hard_share: float = 0.4  # of the samples, where there are hard ones

    def sample(self, rng: np.random.Generator) -> Sample:
        if self.hard and rng.random() < self.hard_share:
            return self.hard[rng.integers(len(self.hard))]
        background = self._background(rng)
        if rng.random() < 0.4:
            background = self._cluttered(background, rng)
        people = [self.people[i] for i in rng.integers(len(self.people), size=rng.choice(4, p=[0.08, 0.37, 0.43, 0.12]))]
        near = np.sort(rng.random(len(people)) ** 0.7)
        if len(people) > 1 and rng.random() < 0.4:  # one close behind the other
            near[-2] = near[-1] * rng.uniform(0.6, 0.95)
        if len(people) > 1 and rng.random() < 0.4:  # in the same clothes
            people[1] = people[0]
        image, boxes = composite(background, list(zip(people, near)), rng)
        return Sample(Path("composite"), image, np.zeros(len(boxes), np.int64), boxes.astype(np.float32))

    def clutter_alone(self, rng: np.random.Generator) -> Sample:
        """Nobody: a background with one or two lots of clutter."""
        image = self._background(rng)
        for _ in range(rng.integers(1, 3)):
            image = self._cluttered(image, rng)
        return Sample(Path("composite"), image, np.zeros(0, np.int64), np.zeros((0, 4), np.float32))

    def _background(self, rng: np.random.Generator) -> np.ndarray:
        return background_of(self.backgrounds[rng.integers(len(self.backgrounds))], self.width, self.height, rng)

    def _cluttered(self, image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return clutter(image, [self.backgrounds[i].image for i in rng.integers(len(self.backgrounds), size=8)], rng)
