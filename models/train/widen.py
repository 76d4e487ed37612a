#!/usr/bin/env python3
"""Makes a wider network of a trained one, that gives the same heads: a larger rung need not be trained from nothing.

Net2WiderNet of Chen et al., "Net2Net", ICLR 2016: each channel is repeated, and what reads it shares its weight among the copies. The
shares are drawn at random, so that the copies learn apart from each other.
"""
from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from checkpoints import read_checkpoint, save_checkpoint
from dataset import DataError
from network import NetworkOptions, Yolo, parameter_count


class WidenError(Exception):
    """The wider network's channels are no whole multiple of the other's."""


def widened_weight(name: str, weight: Tensor, shape: torch.Size, generator: torch.Generator) -> Tensor:
    """`weight` (outputs x inputs x rows x columns, or a value a channel) in the wider network's `shape`."""
    if any(new % old for new, old in zip(shape, weight.shape)):
        raise WidenError(f"{name}: {tuple(weight.shape)} does not go into {tuple(shape)} a whole number of times")
    if weight.ndim == 0:
        return weight.clone()
    wide = weight.repeat_interleave(shape[0] // weight.shape[0], 0)
    if weight.ndim < 2 or shape[1] == weight.shape[1]:
        return wide
    copies = shape[1] // weight.shape[1]
    shares = 0.5 + torch.rand(wide.shape[0], wide.shape[1], copies, generator=generator)
    shares /= shares.sum(2, keepdim=True)
    return (wide[:, :, None] * shares[..., None, None]).flatten(1, 2)


def widened(state: dict[str, Tensor], options: NetworkOptions, width: float, seed: int = 0) -> Yolo:
    """The network of `options` at `width`, which gives the same heads as the one whose `state` this is."""
    network = Yolo(replace(options, width=width)).eval()
    generator = torch.Generator().manual_seed(seed)
    network.load_state_dict({
        name: widened_weight(name, state[name].float() if state[name].is_floating_point() else state[name], value.shape, generator)
        for name, value in network.state_dict().items()})
    return network


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("out", type=Path, help="checkpoint for train.py --start-from")
    parser.add_argument("--width", type=float, required=True, help="of the wider network")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    try:
        saved = read_checkpoint(args.checkpoint)
        network = widened(saved["ema"], NetworkOptions(**saved["options"]), args.width, args.seed)
    except DataError as error:
        print(f"widen.py: {error}")
        return 65
    except WidenError as error:
        print(f"widen.py: {args.checkpoint}: {error}")
        return 65
    save_checkpoint(args.out, {**{k: saved[k] for k in ("anchors", "input")}, "options": network.options.to_dict(), "ema": network.state_dict()})
    print(f"{parameter_count(network):,} parameters")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
