from __future__ import annotations

import contextlib
import io
import json
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
import onnx
import torch

from checkpoints import read_checkpoint
from dataset import DataError
from engines import CheckpointDetector, OnnxDetector
from export import export
from network import NetworkOptions, Yolo
from train import PRESETS, DivergedError, Settings, Training, parse_arguments, rate_at


def write_images(folder: Path, count: int = 6) -> None:
    """Noise, with two bright boxes in each."""
    rng = np.random.default_rng(5)
    for i in range(count):
        image = rng.integers(0, 90, (64, 64, 3), np.uint8)
        lines = []
        for x, height in ((4, 20 + i), (36, 40 - 2 * i)):
            y, width = int(rng.integers(2, 20)), 12 + i
            image[y : y + height, x : x + width] = 230
            lines.append(f"0 {(x + width / 2) / 64} {(y + height / 2) / 64} {width / 64} {height / 64}\n")
        cv2.imwrite(str(folder / f"{i}.png"), image)
        (folder / f"{i}.txt").write_text("".join(lines))


class WithImages(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)
        (self.path / "data").mkdir()
        write_images(self.path / "data")

    def training(self, out: str, *more: str) -> Training:
        arguments = ["--data", str(self.path / "data"), "--out", str(self.path / out), "--width", "0.125", "--width-px", "64",
                     "--height-px", "64", "--batch", "3", "--epochs", "2", "--warm-up-steps", "2", "--workers", "0", "--device", "cpu", *more]
        with contextlib.redirect_stdout(io.StringIO()):
            return Training(parse_arguments(arguments))

    def run_silently(self, training: Training, last_step: int | None = None) -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            training.run(last_step)


class Resuming(WithImages):
    def test_gives_the_weights_of_a_run_that_was_not_interrupted(self):
        whole = self.training("whole")
        self.run_silently(whole)
        self.run_silently(self.training("parts"), last_step=2)
        rest = self.training("parts")
        self.assertEqual(rest.step, 2)
        self.run_silently(rest)
        self.assertEqual((whole.step, rest.step), (4, 4))
        for mine, theirs in ((whole.network, rest.network), (whole.ema.network, rest.ema.network)):
            for (name, a), b in zip(mine.state_dict().items(), theirs.state_dict().values()):
                self.assertTrue(torch.equal(a, b), name)

    def test_a_finished_run_is_left_alone(self):
        training = self.training("out")
        self.run_silently(training)
        again = self.training("out")
        self.run_silently(again)
        self.assertEqual(again.step, 4)

    def test_a_run_by_time_ends_when_its_time_is_spent(self):
        training = self.training("timed", "--time-budget-min", "0.0001")
        self.run_silently(training)
        self.assertEqual((training.step, training.progress()), (1, 1.0))

    def test_a_run_that_diverges_stops_and_leaves_its_last_checkpoint(self):
        self.run_silently(self.training("parts"), last_step=1)
        training = self.training("parts")
        with torch.no_grad():
            next(training.network.parameters()).fill_(torch.nan)
        with self.assertRaisesRegex(DivergedError, "step 1: .*checkpoint.pt is from before"):
            self.run_silently(training)
        weights = read_checkpoint(self.path / "parts" / "checkpoint.pt")["network"]
        self.assertTrue(all(torch.isfinite(value).all() for value in weights.values()))

    def test_hard_composites_without_people_are_refused(self):
        with self.assertRaisesRegex(DataError, r"somebody who is cut out \(0\)"):
            self.training("run", "--hard-composites", str(self.path / "data"))

    def test_a_missing_folder_is_an_error_of_the_data(self):
        with self.assertRaisesRegex(DataError, "no such folder"):
            Training(parse_arguments(["--data", str(self.path / "absent"), "--out", str(self.path / "x")]))


class StartingFrom(WithImages):
    def setUp(self):
        super().setUp()
        self.run_silently(self.training("first", "--boxes-per-anchor", "2"), last_step=1)
        self.checkpoint = self.path / "first" / "checkpoint.pt"

    def test_begins_with_the_averaged_weights_and_the_anchors(self):
        before = read_checkpoint(self.checkpoint)
        training = self.training("second", "--boxes-per-anchor", "2", "--start-from", str(self.checkpoint), "--seed", "3")
        for name, value in training.network.state_dict().items():
            torch.testing.assert_close(value, before["ema"][name], rtol=0, atol=0)
        self.assertEqual(training.anchors.tolist(), before["anchors"])

    def test_a_network_that_is_another_one_is_an_error_that_says_how(self):
        for more, words in (((), "boxes_per_anchor 2, not 1"), (("--boxes-per-anchor", "2", "--no-cbam"), "cbam True, not False")):
            with self.assertRaisesRegex(DataError, words):
                self.training("second", *more, "--start-from", str(self.checkpoint))

    def test_a_missing_file_is_an_error_that_names_it(self):
        with self.assertRaisesRegex(DataError, "nothing.pt: no such file"):
            self.training("second", "--start-from", str(self.path / "nothing.pt"))


class Schedule(unittest.TestCase):
    def test_warms_up_and_then_descends_to_the_final_share(self):
        s = Settings(learning_rate=0.1, final_rate=0.01, warm_up_steps=10)
        self.assertAlmostEqual(rate_at(0, 0.0, s), 0.01)
        self.assertAlmostEqual(rate_at(9, 0.0, s), 0.1)
        self.assertAlmostEqual(rate_at(500, 0.5, s), 0.1 * (0.01 + 0.99 / 2))
        self.assertAlmostEqual(rate_at(1000, 1.0, s), 0.001)

    def test_the_papers_settings(self):
        paper = PRESETS["paper"]
        self.assertEqual((paper.width_px, paper.height_px, paper.batch, paper.epochs), (640, 480, 4, 300))
        self.assertEqual((paper.optimizer, paper.learning_rate, paper.weight_decay), ("sgd", 0.01, 0.0005))


class Export(WithImages):
    def randomised(self) -> Yolo:
        """Normalisation that has something to fold."""
        torch.manual_seed(3)
        network = Yolo(NetworkOptions(width=0.125))
        for module in network.modules():
            if isinstance(module, torch.nn.BatchNorm2d):
                module.running_mean.normal_(0, 0.1)
                module.running_var.uniform_(0.5, 1.5)
                module.weight.data.uniform_(0.8, 1.2)
                module.bias.data.normal_(0, 0.1)
        return network.eval()

    def test_onnx_gives_what_pytorch_gives(self):
        network, path = self.randomised(), self.path / "tiny.onnx"
        anchors = np.arange(24, dtype=float).reshape(4, 3, 2) + 4
        export(network, anchors, ["person"], "tiny", 96, 64, path)
        detector = OnnxDetector(path)
        image = np.random.default_rng(1).integers(0, 256, (64, 96, 3), np.uint8)
        with torch.no_grad():
            expected = network(torch.from_numpy(image[:, :, ::-1].copy()).permute(2, 0, 1)[None].float() / 255)
        for head, wanted in zip(detector.heads(image), expected):
            self.assertGreater(float(wanted.std()), 1e-3)
            np.testing.assert_allclose(head, wanted.numpy(), atol=1e-4)
        np.testing.assert_array_equal(detector.anchors, anchors)
        self.assertEqual(detector.boxes_per_anchor, 1)

    def test_weights_of_16_bits_halve_the_file(self):
        network = self.randomised()
        models = {}
        for name in ("whole", "half"):
            export(network, np.ones((4, 3, 2)), ["person"], name, 96, 64, self.path / f"{name}.onnx", half=name == "half")
            models[name] = onnx.load(str(self.path / f"{name}.onnx"))
        constants = {name: {c.name: onnx.numpy_helper.to_array(c) for c in model.graph.initializer} for name, model in models.items()}
        casts = {node.output[0]: node.input[0] for node in models["half"].graph.node if node.op_type == "Cast"}
        convolutions = [node for node in models["half"].graph.node if node.op_type == "Conv"]
        self.assertGreater(len(convolutions), 50)
        for node in convolutions:
            stored, whole = constants["half"][casts[node.input[1]]], constants["whole"][node.input[1]]
            self.assertEqual(stored.dtype, np.float16)
            np.testing.assert_allclose(stored.astype(np.float32), whole, rtol=1e-3, atol=1e-6)
        sizes = {name: (self.path / f"{name}.onnx").stat().st_size for name in models}
        self.assertLess(sizes["half"], 0.7 * sizes["whole"])

    def test_properties_say_what_decoding_takes(self):
        path = self.path / "tiny.onnx"
        export(self.randomised(), np.ones((4, 3, 2)), ["person"], "tiny", 96, 64, path)
        model = onnx.load(str(path))
        properties = {p.key: json.loads(p.value) for p in model.metadata_props}
        self.assertEqual(properties, {"posed.name": "tiny", "posed.classes": ["person"], "posed.strides": [4, 8, 16, 32],
                                      "posed.anchors": [[[1.0, 1.0]] * 3] * 4, "posed.input": [3, 64, 96]})
        self.assertEqual(model.opset_import[0].version, 12)
        self.assertNotIn("BatchNormalization", {node.op_type for node in model.graph.node})

    def test_properties_say_where_an_anchor_has_two_boxes(self):
        path = self.path / "two.onnx"
        export(Yolo(NetworkOptions(width=0.125, boxes_per_anchor=2)), np.ones((4, 3, 2)), ["person"], "two", 96, 64, path)
        model = onnx.load(str(path))
        self.assertEqual([p.value for p in model.metadata_props if p.key == "posed.boxes_per_anchor"], ["2"])
        self.assertEqual([o.type.tensor_type.shape.dim[1].dim_value for o in model.graph.output], [36] * 4)

    def test_a_checkpoint_can_look_at_images(self):
        training = self.training("out")
        self.run_silently(training)
        boxes, scores = CheckpointDetector(self.path / "out" / "checkpoint.pt", 64, 64)(np.zeros((48, 64, 3), np.uint8))
        self.assertEqual(boxes.shape, (len(scores), 4))

    def test_an_input_that_does_not_divide_is_refused(self):
        with self.assertRaisesRegex(DataError, "multiples of 32"):
            export(self.randomised(), np.ones((4, 3, 2)), ["person"], "tiny", 90, 64, self.path / "x.onnx")
