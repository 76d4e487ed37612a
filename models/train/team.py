"""Processes that train one network together, each on batches of its own: gradients are averaged after every step, so the weights stay the
same in all of them."""
from __future__ import annotations

import os
import shutil
import tempfile
from typing import Iterable

import torch
from torch import distributed, nn


class Team:
    """This process's place among `size`; alone, nothing is exchanged."""

    def __init__(self, rank: int = 0, size: int = 1):
        self.rank, self.size = rank, size

    @property
    def leads(self) -> bool:
        """Whether this process reports and saves."""
        return self.rank == 0

    def average(self, parameters: Iterable[nn.Parameter], number: float) -> float:
        """Replaces the parameters' gradients by their means over the team; returns the mean of `number`, the same to the bit everywhere."""
        if self.size == 1:
            return number
        gradients = [p.grad for p in parameters if p.grad is not None]
        flat = torch.cat([g.reshape(-1).float() for g in gradients] + [torch.tensor([number], dtype=torch.float32)])
        distributed.all_reduce(flat)
        flat /= self.size
        offset = 0
        for gradient in gradients:
            gradient.copy_(flat[offset : offset + gradient.numel()].view_as(gradient))
            offset += gradient.numel()
        return float(flat[-1])


def fork_team(size: int) -> Team:
    """Makes `size - 1` copies of this process, which has read its data: they share its memory. Each returns with a rank of its own; the
    copies end where the caller lets them."""
    if size == 1:
        return Team()
    folder = tempfile.mkdtemp(prefix="posed-train-")
    rank = 0
    for i in range(1, size):
        if os.fork() == 0:
            rank = i
            break
    distributed.init_process_group("gloo", init_method=f"file://{folder}/meeting", rank=rank, world_size=size)
    distributed.barrier()  # everyone has met
    if rank == 0:
        shutil.rmtree(folder)
    return Team(rank, size)
