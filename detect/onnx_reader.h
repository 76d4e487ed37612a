#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/result.h"
#include "detect/network.h"

namespace posed {

/// Reads an ONNX file of operator set 11 to 17 with one image of a fixed size as input and the operations of `Operation`. The
/// metadata are in the model's properties, as JSON: "posed.name" a string, "posed.classes" a list of strings, "posed.strides" a
/// list of numbers and "posed.anchors" a list of lists of [width, height] for each output, "posed.input" [channels, height, width],
/// "posed.boxes_per_anchor" 1 or 2; all may be absent. Reentrant. Errors: NotFound; Io; BadData, with file, node and operator: no
/// ONNX, truncated, not sound; Unsupported: an operator, or a way of using it, that `Operation` has not.
Result<Network> read_onnx(const std::filesystem::path& path);

/// The size of the input alone, of any operators; for whoever gives the file to another engine. Errors likewise.
Result<TensorShape> read_onnx_input(const std::filesystem::path& path);

/// The network of a file in memory; `source` names it in messages.
Result<Network> parse_onnx(std::span<const std::uint8_t> bytes, const std::string& source);

}  // namespace posed
