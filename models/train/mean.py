#!/usr/bin/env python3
"""The weighted mean of the averaged weights of several checkpoints of one network, as a checkpoint to export or to train on from.

Weights of one training, or of trainings that began alike, may be averaged so (Izmailov et al., "Averaging weights leads to wider optima and
better generalization", UAI 2018; Wortsman et al., "Model soups", ICML 2022).
"""
from __future__ import annotations

import argparse
from pathlib import Path

import torch

from checkpoints import read_checkpoint
from dataset import DataError

KEPT = ("options", "anchors", "input", "settings")


def mean_of(checkpoints: list[tuple[Path, float]]) -> dict:
    """What is not averaged is the first one's. Shares need not add up to 1."""
    total = sum(share for _, share in checkpoints)
    if not total > 0 or min(share for _, share in checkpoints) < 0:
        raise DataError(f"shares of {[share for _, share in checkpoints]}: none may be negative, nor all 0")
    read = [read_checkpoint(path) for path, _ in checkpoints]
    first = read[0]
    sums: dict[str, torch.Tensor] = {}
    for (path, share), saved in zip(checkpoints, read):
        if saved["options"] != first["options"] or saved["anchors"] != first["anchors"]:
            raise DataError(f"{path}: another network than {checkpoints[0][0]}, or other anchors")
        for name, value in saved["ema"].items():
            if value.dtype.is_floating_point:
                sums[name] = sums.get(name, 0) + value.double() * (share / total)
    ema = {name: sums[name].float() if name in sums else value for name, value in first["ema"].items()}
    return {**{key: first[key] for key in KEPT}, "ema": ema}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="checkpoint to write")
    parser.add_argument("checkpoints", nargs="+", metavar="CHECKPOINT[@SHARE]", help="with shares of 1 unless given")
    parser.add_argument("--half", action="store_true", help="in 16 bits: half as large")
    args = parser.parse_args()
    try:
        parts = []
        for text in args.checkpoints:
            path, _, share = text.partition("@")
            try:
                parts.append((Path(path), float(share or 1)))
            except ValueError:
                raise DataError(f'{text}: "{share}" is not a share') from None
        mean = mean_of(parts)
    except DataError as error:
        print(f"mean.py: {error}")
        return 65
    if args.half:
        mean["ema"] = {name: v.half() if v.dtype.is_floating_point else v for name, v in mean["ema"].items()}
    torch.save(mean, args.out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
