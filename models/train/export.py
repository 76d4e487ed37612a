#!/usr/bin/env python3
"""A checkpoint's averaged network as ONNX: opset 12, a fixed input, raw heads as outputs.

Batch normalisation is folded into the convolutions. Decoding is left to whoever runs it; what that takes is in the file's
properties, as JSON: posed.name, posed.classes, posed.strides, posed.anchors (for each output a list of [width, height] in pixels of
the input) and posed.input ([channels, height, width]); and, where an anchor has two boxes, posed.boxes_per_anchor.
"""
from __future__ import annotations

import argparse
import copy
import json
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from checkpoints import load_checkpoint
from dataset import DataError
from network import Conv, Yolo

OPSET = 12
INPUT = "images"


def folded(network: Yolo) -> Yolo:
    """A copy in which each convolution has its normalisation in its weights and bias."""
    network = copy.deepcopy(network).eval()
    for module in network.modules():
        if isinstance(module, Conv):
            module.conv = fuse_conv_bn_eval(module.conv, module.bn)
            module.bn = nn.Identity()
    return network


def halve_weights(model: onnx.ModelProto) -> None:
    """Convolutions' weights of 16 bits, each with a Cast to the 32 in which all computes: half the file."""
    weights = {node.input[1] for node in model.graph.node if node.op_type == "Conv"}
    casts = []
    for constant in model.graph.initializer:
        if constant.name in weights:
            values = numpy_helper.to_array(constant).astype(np.float16)
            name, stored = constant.name, constant.name + ".half"
            constant.CopyFrom(numpy_helper.from_array(values, stored))
            casts.append(onnx.helper.make_node("Cast", [stored], [name], name=name + ".cast", to=onnx.TensorProto.FLOAT))
    nodes = [*casts, *model.graph.node]
    del model.graph.node[:]
    model.graph.node.extend(nodes)


def export(network: Yolo, anchors: np.ndarray, classes: list[str], name: str, width: int, height: int, path: Path, half: bool = False) -> None:
    """Anchors are layers x 3 x 2 [pixels]. Both sides of the input are multiples of the coarsest stride."""
    strides = network.options.strides
    if width % strides[-1] or height % strides[-1]:
        raise DataError(f"input {width}x{height}: both sides must be multiples of {strides[-1]}")
    if len(classes) != network.options.classes:
        raise DataError(f"{len(classes)} names of classes for a network of {network.options.classes}")
    outputs = [f"head_{stride}" for stride in strides]
    torch.onnx.export(folded(network), torch.zeros(1, 3, height, width), str(path), opset_version=OPSET, input_names=[INPUT],
                      output_names=outputs, do_constant_folding=True)
    model = onnx.load(str(path))
    properties = {"posed.name": name, "posed.classes": classes, "posed.strides": list(strides),
                  "posed.anchors": np.asarray(anchors).tolist(), "posed.input": [3, height, width]}
    if network.options.boxes_per_anchor > 1:  # 1 is what a reader takes where nothing is said
        properties["posed.boxes_per_anchor"] = network.options.boxes_per_anchor
    onnx.helper.set_model_props(model, {key: json.dumps(value) for key, value in properties.items()})
    if half:
        halve_weights(model)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("out", type=Path, help="ONNX file to write; its name without the ending becomes the network's")
    parser.add_argument("--size", type=int, nargs=2, default=(320, 256), metavar=("WIDTH", "HEIGHT"), help="of the input")
    parser.add_argument("--half", action="store_true", help="weights of 16 bits: half the file, which OpenCV 4.6 cannot read")
    parser.add_argument("--classes", nargs="+", default=["person"])
    args = parser.parse_args()
    try:
        network, saved = load_checkpoint(args.checkpoint)
        export(network, np.array(saved["anchors"]), args.classes, args.out.stem, *args.size, args.out, args.half)
    except DataError as error:
        print(f"export.py: {error}")
        return 65
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
