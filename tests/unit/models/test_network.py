from __future__ import annotations

import unittest

import torch

from boxes import CENTRE_REACH, decode_boxes
from network import Cbam, NetworkOptions, Silu, Yolo, parameter_count, with_second_boxes


class ParameterCounts(unittest.TestCase):
    """Gan et al. 2024, table 1: 7.06, 4.88 and 5.02 million, one class."""

    def count(self, **options) -> int:
        return parameter_count(Yolo(NetworkOptions(width=0.5, classes=1, **options)))

    def test_yolov5s(self):
        self.assertEqual(self.count(ghost=False, cbam=False, fourth_layer=False), 7_063_542)

    def test_ghost(self):
        self.assertEqual(self.count(ghost=True, cbam=False, fourth_layer=False), 4_883_022)

    def test_improved(self):
        self.assertEqual(self.count(), 5_022_736)


class Forward(unittest.TestCase):
    def test_heads_have_a_value_for_each_anchor_of_each_cell(self):
        network = Yolo(NetworkOptions(width=0.125, classes=2)).eval()
        with torch.no_grad():
            shapes = [tuple(head.shape) for head in network(torch.zeros(2, 3, 64, 96))]
        self.assertEqual(shapes, [(2, 21, 16, 24), (2, 21, 8, 12), (2, 21, 4, 6), (2, 21, 2, 3)])

    def test_a_second_box_an_anchor_begins_about_where_the_first_one_is_and_less_sure(self):
        torch.manual_seed(1)
        one = Yolo(NetworkOptions(width=0.125)).eval()
        both = NetworkOptions(width=0.125, boxes_per_anchor=2)
        two = Yolo(both).eval()
        two.load_state_dict(with_second_boxes(one.state_dict(), one.options, both))
        image = torch.rand(1, 3, 64, 96)
        with torch.no_grad():
            for before, after in zip(one(image), two(image)):
                rows, columns = before.shape[2:]
                before, after = before.view(3, 6, rows, columns), after.view(3, 2, 6, rows, columns)
                torch.testing.assert_close(after[:, 0], before, atol=1e-5, rtol=1e-5)

                def flat(raw):
                    return raw.permute(0, 2, 3, 1).reshape(-1, 6)

                anchors = torch.full((flat(before).shape[0], 2), 3.0)
                boxes = [decode_boxes(flat(raw), anchors, reach) for raw, reach in zip((before, after[:, 1]), CENTRE_REACH)]
                torch.testing.assert_close(boxes[1], boxes[0], atol=0.1, rtol=0)
                torch.testing.assert_close(after[:, 1, 4], 0.5 * before[:, 4] - 2, atol=1e-5, rtol=1e-5)

    def test_without_the_fourth_layer_strides_begin_at_8(self):
        network = Yolo(NetworkOptions(width=0.125, fourth_layer=False)).eval()
        with torch.no_grad():
            self.assertEqual([h.shape[3] for h in network(torch.zeros(1, 3, 64, 64))], [8, 4, 2])

    def test_attention_of_few_channels_keeps_one_hidden_value(self):
        self.assertEqual(Cbam(8).squeeze.out_channels, 1)
        self.assertEqual(Cbam(64).squeeze.out_channels, 4)

    def test_silu_in_bfloat16_is_the_float_one_rounded(self):
        x = torch.linspace(-6, 6, 101).bfloat16()
        self.assertTrue(torch.equal(Silu()(x), torch.nn.functional.silu(x.float()).bfloat16()))
