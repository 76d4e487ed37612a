import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from augment import COMPOSITE, augmented
from composites import (LEAST_SHARE, Compositor, CutOut, background_of, clutter, composite, cut_by_mask, cut_out, hide, placed, position_across,
                        ragged, read_cut_outs)
from dataset import DataError, Sample


def photograph(box: list[int], others: list[list[int]] | None = None) -> Sample:
    """A bright ellipse, which fills the box, before a dark wall."""
    image = np.random.default_rng(0).integers(20, 40, (400, 400, 3)).astype(np.uint8)
    centre, axes = ((box[0] + box[2]) // 2, (box[1] + box[3]) // 2), ((box[2] - box[0]) // 2, (box[3] - box[1]) // 2)
    cv2.ellipse(image, centre, axes, 0, 0, 360, (180, 200, 220), -1)
    boxes = np.array([box] + (others or []), np.float32)
    return Sample(Path("photograph"), image, np.zeros(len(boxes), np.int64), boxes)


class Composites(unittest.TestCase):
    def test_a_person_is_told_from_the_wall_behind(self):
        person = cut_out(photograph([120, 60, 260, 340]), 0, 200)
        self.assertIsNotNone(person)
        self.assertFalse(person.cut_below)
        height, width = person.alpha.shape
        self.assertLess(abs(height - 280), 12)
        self.assertLess(abs(width - 140), 12)
        self.assertGreater(person.alpha[height // 2, width // 2], 0.95)
        self.assertLess(person.alpha[3, 3], 0.05)
        self.assertLess(abs(person.alpha.mean() - np.pi / 4), 0.05)

    def test_people_who_are_small_cut_or_not_alone_are_left(self):
        self.assertIsNone(cut_out(photograph([120, 60, 260, 340]), 0, 300))
        self.assertIsNone(cut_out(photograph([0, 60, 140, 340]), 0, 200))
        self.assertIsNone(cut_out(photograph([120, 60, 260, 340], [[200, 60, 340, 340]]), 0, 200))

    def test_nothing_comes_of_a_box_in_which_nothing_stands_out(self):
        plain = Sample(Path("plain"), np.full((400, 400, 3), 90, np.uint8), np.zeros(1, np.int64), np.array([[120, 60, 260, 340]], np.float32))
        self.assertIsNone(cut_out(plain, 0, 200))

    def test_boxes_hold_what_is_seen_and_nothing_else(self):
        person = CutOut(np.full((200, 80, 3), 255, np.uint8), np.ones((200, 80), np.float32), False)
        for seed in range(40):
            image, boxes = composite(np.zeros((120, 160, 3), np.uint8), [(person, 0.5)], np.random.default_rng(seed))
            bright = image[..., 0] > 120
            self.assertEqual(len(boxes), int(bright.sum() > LEAST_SHARE * bright.size))
            for x0, y0, x1, y1 in boxes.astype(int):
                self.assertEqual(int(bright.sum()), int(bright[y0:y1, x0:x1].sum()))
                self.assertTrue(bright[y0:y1, x0].any() and bright[y0:y1, x1 - 1].any())
                self.assertTrue(bright[y0, x0:x1].any() and bright[y1 - 1, x0:x1].any())

    def test_a_person_cut_by_the_lower_edge_reaches_the_lower_edge(self):
        person = CutOut(np.full((100, 60, 3), 255, np.uint8), np.ones((100, 60), np.float32), True)
        reached = 0
        for seed in range(40):
            _, boxes = composite(np.zeros((120, 160, 3), np.uint8), [(person, 0.5)], np.random.default_rng(seed))
            reached += sum(int(box[3] == 120) for box in boxes)
        self.assertGreater(reached, 20)  # the others stand behind a desk

    def test_some_people_are_mostly_outside_of_the_image_and_of_two_some_overlap(self):
        alone = [position_across(60, 400, None, np.random.default_rng(seed)) for seed in range(200)]
        seen = np.minimum(np.array(alone) + 60, 400) - np.maximum(alone, 0)
        self.assertTrue((seen >= 0.1 * 60 - 1e-9).all())
        self.assertTrue(0.25 < (seen < 0.5 * 60).mean() < 0.55)
        beside = [position_across(60, 400, 200.0, np.random.default_rng(seed)) + 30 for seed in range(200)]
        apart = np.abs(np.array(beside) - 200)
        self.assertTrue(0.4 < ((apart > 0.1 * 60) & (apart < 0.75 * 60)).mean() < 0.75)

    def test_the_nearer_a_person_the_larger_and_the_nearest_may_lose_the_head(self):
        upper_body = CutOut(np.full((200, 100, 3), 255, np.uint8), np.ones((200, 100), np.float32), True)
        widths, tops = [], []
        for near in (0.0, 0.5, 1.0):
            covers = [placed(upper_body, 320, 240, near, 160.0, np.random.default_rng(seed))[1] > 0.5 for seed in range(30)]
            widths.append(max(int(c.any(0).sum()) for c in covers))
            tops.append(sum(bool(c[0].any()) for c in covers))
        self.assertEqual(widths, sorted(set(widths)))
        self.assertEqual(tops[0], 0)
        self.assertTrue(3 < tops[2] < 30)

    def test_a_box_stays_a_persons_when_another_one_passes_before_it(self):
        far = CutOut(np.full((200, 80, 3), 150, np.uint8), np.ones((200, 80), np.float32), False)
        near = CutOut(np.full((200, 80, 3), 255, np.uint8), np.ones((200, 80), np.float32), False)
        room = np.zeros((120, 160, 3), np.uint8)
        kept = cut = 0
        for seed in range(80):
            alone, boxes = composite(room, [(far, 0.3)], np.random.default_rng(seed))
            both, boxes_of_both = composite(room, [(far, 0.3), (near, 0.4)], np.random.default_rng(seed))
            whole = alone[..., 0] > 0
            seen = whole & (both == alone).all(2)  # their colours differ
            if len(boxes) and 0.3 * whole.sum() < seen.sum() < 0.8 * whole.sum() and seen.sum() > 0.02 * seen.size:
                self.assertEqual(boxes_of_both[0].tolist(), boxes[0].tolist())
                kept += 1
            elif len(boxes) and len(boxes_of_both) > 1 and seen.sum() < 0.2 * whole.sum():
                ys, xs = np.nonzero(seen)
                self.assertEqual(boxes_of_both[0].tolist(), [xs.min(), ys.min(), xs.max() + 1, ys.max() + 1])
                cut += 1
        self.assertGreater(kept, 5)
        self.assertGreater(cut, 0)

    def test_clutter_lies_in_groups_on_what_was_there(self):
        things = [np.full((50, 70, 3), 255, np.uint8), np.full((8, 300, 3), 200, np.uint8)]
        for seed in range(30):
            desk = np.zeros((120, 160, 3), np.uint8)
            image = clutter(desk, things, np.random.default_rng(seed))
            self.assertFalse(desk.any())
            self.assertTrue(0.002 < image[..., 0].any(1).mean() and 0.002 < (image > 0).mean() < 0.6)

    def test_a_background_keeps_its_contents_and_takes_the_size(self):
        sample = Sample(Path("room"), np.full((90, 200, 3), 77, np.uint8), np.zeros(0, np.int64), np.zeros((0, 4), np.float32))
        image = background_of(sample, 160, 120, np.random.default_rng(0))
        self.assertEqual(image.shape, (120, 160, 3))
        self.assertTrue((image == 77).all())


def portrait(shoulders_at: int) -> tuple[np.ndarray, np.ndarray]:
    """A head, and shoulders from that row on that reach both sides: image and mask."""
    mask = np.zeros((300, 240), np.uint8)
    cv2.circle(mask, (120, 90), 60, 255, -1)
    cv2.rectangle(mask, (90, 120), (150, shoulders_at), 255, -1)
    mask[shoulders_at:] = 255
    image = np.full((300, 240, 3), 30, np.uint8)
    image[mask > 0] = 200
    return image, mask


class CutOuts(unittest.TestCase):
    def test_shoulders_that_the_image_cuts_at_its_sides_are_left(self):
        person = cut_by_mask(*portrait(shoulders_at=220))
        self.assertTrue(person.cut_below)
        self.assertEqual(person.image.shape[:2], person.alpha.shape)
        self.assertEqual(person.image.shape[:2], (190, 121))  # rows 30 to 219, the head's columns

    def test_a_whole_person_stays_whole(self):
        mask = np.zeros((300, 200), np.uint8)
        cv2.ellipse(mask, (100, 150), (50, 120), 0, 0, 360, 255, -1)
        person = cut_by_mask(np.full((300, 200, 3), 90, np.uint8), mask)
        self.assertFalse(person.cut_below)
        self.assertEqual(person.alpha.shape, (241, 101))

    def test_of_several_people_the_largest_is_taken_and_specks_are_nobody(self):
        mask = np.zeros((200, 400), np.uint8)
        mask[40:80, 20:50] = 255
        self.assertIsNone(cut_by_mask(np.zeros((200, 400, 3), np.uint8), mask))
        mask[30:190, 200:290] = 255
        self.assertEqual(cut_by_mask(np.zeros((200, 400, 3), np.uint8), mask).alpha.shape, (160, 90))

    def test_large_photographs_are_shrunk(self):
        mask = np.zeros((1200, 800), np.uint8)
        mask[300:1200, 200:600] = 255
        self.assertEqual(max(cut_by_mask(np.zeros((1200, 800, 3), np.uint8), mask).alpha.shape), 315)

    def test_a_folder_is_read_by_its_masks(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            image, mask = portrait(220)
            cv2.imwrite(str(folder / "a.jpg"), image)
            cv2.imwrite(str(folder / "a_mask.png"), mask)
            self.assertEqual(len(read_cut_outs(folder)), 1)
            (folder / "b_mask.png").write_bytes((folder / "a_mask.png").read_bytes())
            with self.assertRaisesRegex(DataError, "b.jpg: not an image"):
                read_cut_outs(folder)
        with self.assertRaisesRegex(DataError, "no such folder"):
            read_cut_outs(Path("absent"))

    def test_a_ragged_border_moves_by_pixels_only(self):
        alpha = np.zeros((120, 100), np.float32)
        alpha[20:100, 20:80] = 1
        for seed in range(10):
            torn = ragged(alpha, np.random.default_rng(seed))
            self.assertTrue(torn[32:88, 32:68].all())
            self.assertFalse(torn[:8].any() or torn[:, :8].any())
            self.assertFalse(np.array_equal(torn, alpha))

    def test_what_stands_before_people_hides_some_of_them_but_not_the_upper_part(self):
        for seed in range(20):
            cover = hide(np.ones((120, 160), np.float32), np.random.default_rng(seed))
            self.assertTrue(cover[:30].all())
            self.assertTrue(0 < (cover == 0).mean() < 0.7)


def empty_room(grey: int) -> Sample:
    return Sample(Path("room"), np.full((90, 200, 3), grey, np.uint8), np.zeros(0, np.int64), np.zeros((0, 4), np.float32))


class Compositors(unittest.TestCase):
    def test_samples_show_what_their_boxes_say(self):
        person = CutOut(np.full((200, 80, 3), 255, np.uint8), np.ones((200, 80), np.float32), True)
        room = empty_room(0)
        compositor = Compositor([person], [room], 160, 120)
        counts = set()
        for seed in range(60):
            sample = compositor.sample(np.random.default_rng(seed))
            self.assertEqual(sample.image.shape, (120, 160, 3))
            self.assertEqual(len(sample.labels), len(sample.boxes))
            bright = (sample.image > 100).mean()
            self.assertTrue(bright > 0.01 if len(sample.boxes) else bright < 0.03)  # slivers have no box
            self.assertTrue((sample.boxes >= 0).all() and (sample.boxes <= [160, 120, 160, 120]).all())
            counts.add(len(sample.boxes))
        self.assertLessEqual({0, 1, 2}, counts)
        again = compositor.sample(np.random.default_rng(59))
        np.testing.assert_array_equal(again.image, sample.image)

    def test_clutter_alone_shows_nobody_and_no_room_as_it_was(self):
        rooms = [empty_room(grey) for grey in (0, 80, 160, 240)]
        compositor = Compositor([], rooms, 160, 120)
        for seed in range(5):
            sample = compositor.clutter_alone(np.random.default_rng(seed))
            self.assertEqual(sample.image.shape, (120, 160, 3))
            self.assertEqual((len(sample.boxes), len(sample.labels)), (0, 0))
            self.assertGreater(len(np.unique(sample.image)), 1)

    def test_some_samples_are_hard_ones(self):
        person = CutOut(np.full((200, 80, 3), 255, np.uint8), np.ones((200, 80), np.float32), True)
        room = empty_room(0)
        compositor = Compositor([person], [room], 160, 120, hard=[replace(room, path=Path("hard"))], hard_share=0.5)
        hard = sum(compositor.sample(np.random.default_rng(seed)).path == Path("hard") for seed in range(100))
        self.assertTrue(30 < hard < 70, hard)

    def test_stay_whole_and_keep_people_whom_a_side_of_the_image_cuts(self):
        image = np.zeros((240, 320, 3), np.uint8)
        image[40:, :80] = 200
        person = Sample(Path("composite"), image, np.zeros(1, np.int64), np.array([[0, 40, 80, 240]], np.float32))
        white = Sample(Path("white"), np.full((240, 320, 3), 255, np.uint8), np.zeros(0, np.int64), np.zeros((0, 4), np.float32))
        still = replace(COMPOSITE, paste=0, occlusion=0, hue=0, saturation=0, brightness=0, grey=0, blur=0, noise=0, mirror=0)
        slivers = 0
        for seed in range(300):
            shown, _, boxes = augmented(person, [white], 320, 240, still, np.random.default_rng(seed))
            self.assertLess(shown.max(), 210)  # nothing of another image, as in a mosaic
            columns = int((shown[..., 0] > 160).any(0).sum())
            self.assertTrue(len(boxes) == 1 or columns < 17, (seed, columns))
            slivers += 0 < columns < 25
        self.assertGreater(slivers, 3)


if __name__ == "__main__":
    unittest.main()
