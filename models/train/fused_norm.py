"""Batch normalisation and SiLU of a bfloat16 training step in one pass (fused_norm.cpp), built for this machine when first asked for."""
from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
from pathlib import Path

import torch
from torch import Tensor, nn

SOURCE = Path(__file__).with_name("fused_norm.cpp")
FLAGS = ["-std=c++20", "-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512", "-fPIC", "-shared"]


def load_library() -> ctypes.CDLL:
    """Compiles once a source, machine and user; raises subprocess.CalledProcessError where the compiler does, OSError where there is none."""
    cpu = next((line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("flags")), "")
    key = hashlib.sha256((SOURCE.read_text() + cpu + " ".join(FLAGS)).encode()).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "posed"
    path = folder / f"fused_norm-{key}.so"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(f".{os.getpid()}")
        subprocess.run([os.environ.get("CXX", "g++"), *FLAGS, "-o", str(temporary), str(SOURCE), "-lm"], check=True)
        os.replace(temporary, path)
    return ctypes.CDLL(str(path))


def _pointer(t: Tensor) -> ctypes.c_void_p:
    return ctypes.c_void_p(t.data_ptr())


class NormSilu(torch.autograd.Function):
    """x: N x C x H x W, bfloat16. Returns the same shape, and the batch's mean and variance (C)."""

    library: ctypes.CDLL | None = None

    @staticmethod
    def forward(ctx, x: Tensor, weight: Tensor, bias: Tensor, eps: float, with_silu: bool):
        x = x.contiguous(memory_format=torch.channels_last)
        y = torch.empty_like(x)
        mean, variance = torch.empty_like(weight), torch.empty_like(weight)
        rows, channels = x.shape[0] * x.shape[2] * x.shape[3], x.shape[1]
        NormSilu.library.norm_silu_forward(_pointer(x), _pointer(weight), _pointer(bias), ctypes.c_float(eps), ctypes.c_int64(rows),
                                           ctypes.c_int64(channels), int(with_silu), _pointer(y), _pointer(mean), _pointer(variance))
        ctx.save_for_backward(x, weight, bias, mean, variance)
        ctx.eps, ctx.with_silu = eps, with_silu
        ctx.mark_non_differentiable(mean, variance)
        return y, mean, variance

    @staticmethod
    def backward(ctx, gradient: Tensor, *_):
        x, weight, bias, mean, variance = ctx.saved_tensors
        gradient = gradient.to(torch.bfloat16).contiguous(memory_format=torch.channels_last)
        dx = torch.empty_like(x)
        dweight, dbias = torch.empty_like(weight), torch.empty_like(bias)
        rows, channels = x.shape[0] * x.shape[2] * x.shape[3], x.shape[1]
        NormSilu.library.norm_silu_backward(
            _pointer(gradient), _pointer(x), _pointer(weight), _pointer(bias), _pointer(mean), _pointer(variance), ctypes.c_float(ctx.eps),
            ctypes.c_int64(rows), ctypes.c_int64(channels), int(ctx.with_silu), _pointer(dx), _pointer(dweight), _pointer(dbias))
        return dx, dweight, dbias, None, None


def normalised(x: Tensor, bn: nn.BatchNorm2d, with_silu: bool) -> Tensor:
    """As bn and SiLU in training, running statistics included."""
    y, mean, variance = NormSilu.apply(x, bn.weight, bn.bias, bn.eps, with_silu)
    with torch.no_grad():
        rows = x.numel() // x.shape[1]
        bn.running_mean.lerp_(mean, bn.momentum)
        bn.running_var.lerp_(variance * (rows / max(rows - 1, 1)), bn.momentum)
        bn.num_batches_tracked += 1
    return y


def enable() -> None:
    """From now on Conv of network.py takes this in training, for bfloat16 on a processor."""
    NormSilu.library = load_library()


def is_for(x: Tensor) -> bool:
    return NormSilu.library is not None and x.dtype == torch.bfloat16 and x.device.type == "cpu"
