#!/usr/bin/env python3
"""Trains a detector. See README.md; `train.py --help` lists the options."""
from __future__ import annotations

import argparse
import copy
import csv
import math
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

import fused_norm
from anchors import fit_anchors
from augment import AUGMENTATIONS, COMPOSITE, Augmentation, augmented
from checkpoints import read_checkpoint, save_checkpoint
from composites import Compositor, read_cut_outs
from dataset import DataError, Sample, letterbox, read_folder
from loss import DetectionLoss
from metrics import AveragePrecision, decode, suppress
from network import ANCHORS_PER_LAYER, NetworkOptions, Yolo, parameter_count, with_second_boxes
from team import Team, fork_team


@dataclass(frozen=True)
class Settings:
    """How to train. `paper`: as Gan et al. 2024, section 4.1; `small`: what two processor cores can do in hours."""

    width_px: int = 256
    height_px: int = 256
    batch: int = 8
    epochs: int = 80
    optimizer: str = "adamw"
    learning_rate: float = 2e-3
    final_rate: float = 0.01  # share of the learning rate at the end of the cosine
    weight_decay: float = 0.02
    warm_up_steps: int = 200
    ema_half_life_steps: int = 300
    close_mosaic: float = 0.85  # share of the training after which there are no mosaics
    augmentation: str = "general"  # of augment.AUGMENTATIONS
    composites: float = 0.4  # share of images that are composites, where there are cut-outs
    size_steps: int = 0  # sides of a step's images are up to so many times 64 pixels shorter or longer, drawn for each step


PRESETS = {
    "small": Settings(),
    "paper": Settings(640, 480, 4, 300, "sgd", 0.01, 0.1, 5e-4, 1000, 2000, 0.95),
}


class DivergedError(Exception):
    """The loss is no finite number any more; the last checkpoint is from before."""


class MovingAverage:
    """Exponential moving average of all weights and statistics (EMA); it is what is evaluated and shipped."""

    def __init__(self, network: nn.Module, half_life_steps: int):
        self.network = copy.deepcopy(network).eval()
        self.decay = 0.5 ** (1 / half_life_steps)
        for p in self.network.parameters():
            p.requires_grad_(False)

    def update(self, network: nn.Module, step: int) -> None:
        decay = min(self.decay, (1 + step) / (10 + step))
        with torch.no_grad():
            for mine, theirs in zip(self.network.state_dict().values(), network.state_dict().values()):
                if mine.dtype.is_floating_point:
                    mine.lerp_(theirs, 1 - decay)
                else:
                    mine.copy_(theirs)


SIZE_STEP_PX = 64  # a multiple of the largest stride, as the sides of an input are


def input_size(s: Settings, seed: int, step: int) -> tuple[int, int]:
    """Width and height of a step's images, the same for all of a team."""
    longer = SIZE_STEP_PX * int(np.random.default_rng((seed, 2, step)).integers(-s.size_steps, s.size_steps + 1))
    return s.width_px + longer, s.height_px + longer


class Batches(torch.utils.data.Dataset):
    """The batch of a step is a function of the seed, the step and the place in the team alone, so that a resumed run sees what it would
    have seen.

    (With a time budget, the step from which there are no mosaics depends on the time that was taken.) `late` is shared with the processes
    that make batches: how near the end of a run that goes by time is, cannot be told from the number of steps.
    """

    def __init__(self, samples: list[Sample], settings: Settings, augmentation: Augmentation, seed: int, steps: int, first: int,
                 compositor: Compositor | None = None, team: Team = Team()):
        self.samples, self.settings, self.augmentation, self.compositor = samples, settings, augmentation, compositor
        self.seed, self.steps, self.first, self.team = seed, steps, first, team
        self.late = torch.zeros(1, dtype=torch.bool).share_memory_()

    def __len__(self) -> int:
        return self.steps - self.first

    def __getitem__(self, offset: int) -> tuple[Tensor, Tensor]:
        step = self.first + offset
        s = self.settings
        number = step * self.team.size + self.team.rank
        per_epoch = max(len(self.samples) // s.batch, 1)
        order = np.random.default_rng((self.seed, number // per_epoch)).permutation(len(self.samples))
        rng = np.random.default_rng((self.seed, 1, number))
        mosaics = step < s.close_mosaic * self.steps and not self.late
        options = self.augmentation if mosaics else replace(self.augmentation, mosaic=0.0)
        width, height = input_size(s, self.seed, step)
        images, targets = [], []
        for i in range(s.batch):
            sample = self.samples[order[(number % per_epoch * s.batch + i) % len(order)]]
            how = options
            if self.compositor and rng.random() < s.composites:
                sample, how = self.compositor.sample(rng), COMPOSITE
            image, labels, boxes = augmented(sample, self.samples, width, height, how, rng)
            images.append(torch.from_numpy(image[:, :, ::-1].copy()).permute(2, 0, 1))
            for label, (x0, y0, x1, y1) in zip(labels, boxes):
                targets.append([i, label, (x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0])
        return torch.stack(images), torch.tensor(targets, dtype=torch.float32).reshape(-1, 6)


def rate_at(step: int, progress: float, s: Settings) -> float:
    """Linear warm-up over the first steps, then a cosine of the progress (0 to 1) down to `final_rate`."""
    warm = min(1.0, (step + 1) / max(s.warm_up_steps, 1))
    cosine = s.final_rate + (1 - s.final_rate) * 0.5 * (1 + math.cos(math.pi * progress))
    return s.learning_rate * warm * cosine


def make_optimizer(network: nn.Module, s: Settings) -> torch.optim.Optimizer:
    """Weights decay; biases and normalisation do not."""
    decayed = [p for p in network.parameters() if p.ndim > 1]
    free = [p for p in network.parameters() if p.ndim <= 1]
    groups = [{"params": decayed, "weight_decay": s.weight_decay}, {"params": free, "weight_decay": 0.0}]
    if s.optimizer == "sgd":
        return torch.optim.SGD(groups, s.learning_rate, momentum=0.937, nesterov=True)
    return torch.optim.AdamW(groups, s.learning_rate, betas=(0.9, 0.98))


@torch.no_grad()
def average_precision(network: nn.Module, samples: list[Sample], width: int, height: int, anchors: np.ndarray) -> AveragePrecision:
    network.eval()
    options = network.options
    ap = AveragePrecision()
    for sample in samples:
        image, scale, left, top = letterbox(sample.image, width, height)
        x = torch.from_numpy(image[:, :, ::-1].copy()).permute(2, 0, 1)[None].float() / 255
        found, confidence = suppress(decode(network(x), anchors, options.strides, options.classes, 0.01, options.boxes_per_anchor)[0])
        ap.add((found - [left, top, left, top]) / scale, confidence, sample.boxes)
    return ap


def fitted_anchors(samples: list[Sample], s: Settings, layers: int, seed: int) -> np.ndarray:
    """layers x 3 x 2 [pixels of the training input], finest layer first."""
    sizes = []
    for sample in samples:
        scale = min(s.width_px / sample.image.shape[1], s.height_px / sample.image.shape[0])
        sizes.append((sample.boxes[:, 2:] - sample.boxes[:, :2]) * scale)
    sizes = np.concatenate(sizes)
    sizes = sizes[sizes.min(1) >= Augmentation().least_side]
    return fit_anchors(sizes, layers * ANCHORS_PER_LAYER, seed).reshape(layers, ANCHORS_PER_LAYER, 2).astype(float).round(1)


def weights_to_start_from(path: Path, wanted: NetworkOptions) -> tuple[dict[str, Tensor], np.ndarray]:
    """Averaged weights (EMA) of a checkpoint for a network of these options, and its anchors. Two boxes an anchor can be begun from one."""
    start = read_checkpoint(path)
    had = NetworkOptions(**start["options"])
    differences = [f"{name} {theirs}, not {ours}" for (name, theirs), ours in zip(had.to_dict().items(), wanted.to_dict().values())
                   if theirs != ours and not (name == "boxes_per_anchor" and theirs < ours)]
    if differences:
        raise DataError(f"{path}: a network of {'; '.join(differences)}")
    return with_second_boxes(start["ema"], had, wanted), np.array(start["anchors"])


class Training:
    """A run from its first step or from its last checkpoint to its end."""

    def __init__(self, args: argparse.Namespace):
        self.args = args
        self.out = args.out
        self.out.mkdir(parents=True, exist_ok=True)
        self.checkpoint_path = self.out / "checkpoint.pt"
        saved = read_checkpoint(self.checkpoint_path) if self.checkpoint_path.exists() else None
        self.settings = Settings(**saved["settings"]) if saved else replace(
            PRESETS[args.preset], **{k: v for k, v in vars(args).items() if k in Settings.__dataclass_fields__ and v is not None})
        torch.manual_seed(args.seed)
        options = NetworkOptions(**saved["options"]) if saved else NetworkOptions(
            width=args.width, ghost=not args.no_ghost, cbam=not args.no_cbam, fourth_layer=not args.no_fourth_layer,
            boxes_per_anchor=args.boxes_per_anchor)
        if min(self.settings.width_px, self.settings.height_px) <= self.settings.size_steps * SIZE_STEP_PX:
            raise DataError(f"{self.settings.size_steps} steps of {SIZE_STEP_PX} pixels leave nothing of images of "
                            f"{self.settings.width_px}x{self.settings.height_px}")
        self.samples = [s for folder in args.data for s in read_folder(folder, options.classes, args.longest_side)]
        self.valid = read_folder(args.valid, options.classes) if args.valid else []
        self.compositor = self.read_compositor() if args.cut_outs or args.hard_composites else None
        self.device = torch.device(args.device)
        self.network = Yolo(options)
        if saved:
            self.network.load_state_dict(saved["network"])
            self.anchors = np.array(saved["anchors"])
        elif args.start_from:
            weights, self.anchors = weights_to_start_from(args.start_from, options)
            self.network.load_state_dict(weights)
        else:
            self.anchors = fitted_anchors(self.samples, self.settings, len(options.strides), args.seed)
        self.network.to(self.device, memory_format=torch.channels_last)
        self.ema = MovingAverage(self.network, self.settings.ema_half_life_steps)
        self.optimizer = make_optimizer(self.network, self.settings)
        self.loss = DetectionLoss(torch.tensor(self.anchors), options.strides, options.classes, options.boxes_per_anchor).to(self.device)
        self.step, self.seconds = 0, 0.0
        self.before = self.begun = 0.0  # seconds of earlier sessions, and when this one began
        if saved:
            self.ema.network.load_state_dict(saved["ema"])
            self.optimizer.load_state_dict(saved["optimizer"])
            self.step, self.seconds = saved["step"], saved["seconds"]
        self.team = Team()
        self.steps = self.settings.epochs * max(len(self.samples) // (self.settings.batch * args.processes), 1)
        print(f"{parameter_count(self.network):,} parameters, {len(self.samples)} images, steps {self.step} to {self.steps}, "
              f"anchors {self.anchors.tolist()}", flush=True)

    def read_compositor(self) -> Compositor:
        people = [c for folder in self.args.cut_outs for c in read_cut_outs(folder)]
        backgrounds = [s for s in self.samples if not len(s.boxes)]
        if not people or not backgrounds:
            raise DataError(f"composites need somebody who is cut out ({len(people)}) and images that show nobody ({len(backgrounds)})")
        print(f"composites of {len(people)} people and {len(backgrounds)} backgrounds", flush=True)
        hard = [s for folder in self.args.hard_composites for s in read_folder(folder, longest_side=self.args.longest_side)]
        return Compositor(people, backgrounds, hard=hard)

    def state(self) -> dict:
        return {"settings": vars(self.settings), "options": self.network.options.to_dict(), "anchors": self.anchors.tolist(),
                "input": [self.settings.width_px, self.settings.height_px], "network": self.network.state_dict(),
                "ema": self.ema.network.state_dict(), "optimizer": self.optimizer.state_dict(), "step": self.step, "seconds": self.seconds}

    def progress(self) -> float:
        """0 at the beginning, 1 at the end: by steps, or by the time that was taken where that is further."""
        by_time = self.seconds / (60 * self.args.time_budget_min) if self.args.time_budget_min else 0.0
        return min(max(self.step / self.steps, by_time), 1.0)

    def learn(self, images: Tensor, targets: Tensor) -> dict[str, float]:
        for group in self.optimizer.param_groups:
            group["lr"] = rate_at(self.step, self.progress(), self.settings)
        x = images.to(self.device).contiguous(memory_format=torch.channels_last).float() / 255
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.args.bf16):
            heads = self.network(x)
        total, parts = self.loss(heads, targets.to(self.device))
        self.optimizer.zero_grad(set_to_none=True)
        total.backward()
        self.seconds = self.team.average(self.network.parameters(), self.before + time.monotonic() - self.begun)
        # Of the mean of the team's gradients, so that all of a team give up at the same step.
        if not torch.isfinite(nn.utils.clip_grad_norm_(self.network.parameters(), 10.0)):
            raise DivergedError(f"step {self.step}: the gradients are no finite numbers (loss {float(total):g}); {self.checkpoint_path} is from before")
        self.optimizer.step()
        self.ema.update(self.network, self.step)
        self.step += 1
        return parts

    def report(self, sums: dict[str, float], count: int) -> None:
        ap = None
        if self.valid:
            ap = average_precision(copy.deepcopy(self.ema.network).cpu(), self.valid, *self.args.valid_size, self.anchors).value()
        row = {"step": self.step, "epoch": round(self.step * self.settings.batch * self.team.size / len(self.samples), 2), "seconds": round(self.seconds),
               **{k: round(v / max(count, 1), 5) for k, v in sums.items()}, "ap50": "" if ap is None else round(ap, 4)}
        path = self.out / "log.csv"
        is_new = not path.exists()
        with path.open("a", newline="") as file:
            writer = csv.DictWriter(file, row)
            if is_new:
                writer.writeheader()
            writer.writerow(row)
        print(row, flush=True)

    def run(self, last_step: int | None = None) -> None:
        """To the end, or to `last_step`; whatever is left is done by another run from the checkpoint."""
        augmentation = AUGMENTATIONS[self.settings.augmentation]
        batches = Batches(self.samples, self.settings, augmentation, self.args.seed, self.steps, self.step, self.compositor, self.team)
        loader = torch.utils.data.DataLoader(batches, batch_size=None, shuffle=False, num_workers=self.args.workers,
                                             prefetch_factor=4 if self.args.workers else 2)
        sums: dict[str, float] = {}
        count = 0
        self.begun = saved = reported = time.monotonic()
        self.before = self.seconds
        if self.progress() >= 1:
            print(f"done already, after {self.step} steps", flush=True)
            return
        self.network.train()
        for images, targets in loader:
            for name, value in self.learn(images, targets).items():
                sums[name] = sums.get(name, 0.0) + value
            count += 1
            now = time.monotonic()
            batches.late[0] = self.progress() >= self.settings.close_mosaic
            done = self.progress() >= 1
            if self.team.leads and (done or now - saved > 60 * self.args.save_min):
                save_checkpoint(self.checkpoint_path, self.state())
                saved = now
            if self.team.leads and (done or now - reported > 60 * self.args.report_min):
                self.report(sums, count)
                sums, count, reported = {}, 0, time.monotonic()
            if done:
                return
            if self.step == last_step or (self.args.stop_after_min and self.seconds - self.before > 60 * self.args.stop_after_min):
                if self.team.leads:
                    save_checkpoint(self.checkpoint_path, self.state())
                    print(f"stopped at step {self.step} of {self.steps}; the same command goes on from here", flush=True)
                return


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--data", type=Path, nargs="+", required=True, help="folders of images and labels")
    parser.add_argument("--cut-outs", type=Path, nargs="+", default=[],
                        help="folders of people cut out (NAME.jpg, NAME_mask.png), for composites with the images of --data that show nobody")
    parser.add_argument("--hard-composites", type=Path, nargs="+", default=[],
                        help="folders of composites that a detector got wrong (mine_composites.py), for a part of the composites")
    parser.add_argument("--valid", type=Path, help="folder to measure on; never trained on")
    parser.add_argument("--valid-size", type=int, nargs=2, default=(320, 320), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--out", type=Path, required=True, help="folder of checkpoint.pt and log.csv; a run found there goes on")
    parser.add_argument("--start-from", type=Path, help="checkpoint whose weights a new run begins with")
    parser.add_argument("--preset", choices=PRESETS, default="small")
    parser.add_argument("--width", type=float, default=0.25, help="multiplies the network's channels")
    parser.add_argument("--no-ghost", action="store_true")
    parser.add_argument("--no-cbam", action="store_true")
    parser.add_argument("--no-fourth-layer", action="store_true")
    parser.add_argument("--boxes-per-anchor", type=int, choices=(1, 2), default=1,
                        help="2: one more for somebody who overlaps another person; --start-from may have 1")
    for name, field in Settings.__dataclass_fields__.items():
        parser.add_argument("--" + name.replace("_", "-"), type={"int": int, "float": float, "str": str}[field.type], default=None,
                            choices=AUGMENTATIONS if name == "augmentation" else None, help=f"instead of the preset's {name}")
    parser.add_argument("--longest-side", type=int, default=480, help="larger images are shrunk to this when they are read [pixels]")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--processes", type=int, default=1, help="that train together, each with a batch of its own a step")
    parser.add_argument("--workers", type=int, default=1, help="processes that make batches")
    parser.add_argument("--bf16", action="store_true", help="convolutions in bfloat16: faster where the processor has it")
    parser.add_argument("--fused", action="store_true", help="with --bf16 on a processor: normalisation and SiLU in one (needs g++)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--save-min", type=float, default=3.0, help="minutes between checkpoints")
    parser.add_argument("--report-min", type=float, default=10.0, help="minutes between reports")
    parser.add_argument("--time-budget-min", type=float, default=0.0,
                        help="the schedule ends when the sessions of the run together have taken so many minutes, if not before; 0: by epochs")
    parser.add_argument("--stop-after-min", type=float, default=0.0, help="stop after so many minutes, to go on later; 0: at the end")
    return parser.parse_args(arguments)


def main() -> int:
    args = parse_arguments()
    torch.set_num_threads(args.threads)
    if args.fused:
        fused_norm.enable()
    try:
        training = Training(args)
        training.team = fork_team(args.processes)
        training.run()
    except (DataError, DivergedError) as error:
        print(f"train.py: {error}")
        return 65
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
