#include "detect/network.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

namespace posed {
namespace {

// Far above any network for a robot, far below where sizes overflow.
constexpr int kMaxChannels = 1 << 14;
constexpr int kMaxSide = 1 << 14;
constexpr std::size_t kMaxTensorSize = std::size_t{1} << 28;
constexpr int kMaxKernel = 255;

using ShapeResult = tl::expected<TensorShape, std::string>;

tl::unexpected<std::string> wrong(std::string what) {
  return tl::unexpected<std::string>(std::move(what));
}

std::string to_text(const TensorShape& shape) {
  return fmt::format("{}x{}x{}", shape.channels, shape.height, shape.width);
}

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

tl::expected<void, std::string> check_values(const std::vector<float>& values, std::size_t count, std::string_view what) {
  if (values.size() != count) {
    return wrong(fmt::format("{} has {} values, {} are needed", what, values.size(), count));
  }
  if (!all_finite(values)) {
    return wrong(fmt::format("{} has a value that is no finite number", what));
  }
  return {};
}

std::size_t product(std::initializer_list<int> factors) {
  return std::accumulate(factors.begin(), factors.end(), std::size_t{1},
                         [](std::size_t all, int factor) { return all * static_cast<std::size_t>(factor); });
}

/// The output's shape, or what is wrong.
struct ShapeInference {
  const std::vector<TensorShape>& inputs;

  ShapeResult operator()(const Convolution& op) const;
  ShapeResult operator()(const ChannelAffine& op) const;
  ShapeResult operator()(const Activate& op) const;
  ShapeResult operator()(const Add& op) const;
  ShapeResult operator()(const Multiply& op) const;
  ShapeResult operator()(const Concat& op) const;
  ShapeResult operator()(const Upsample2x& op) const;
  ShapeResult operator()(const MaxPool& op) const;
  ShapeResult operator()(const GlobalPool& op) const;
  ShapeResult operator()(const ChannelPool& op) const;
  ShapeResult operator()(const Subsample2x& op) const;
  ShapeResult operator()(const SpaceToDepth& op) const;
  ShapeResult operator()(const Cbam& op) const;

 private:
  ShapeResult window(int out_channels, int kernel, int stride, int padding) const;
};

ShapeResult ShapeInference::window(int out_channels, int kernel, int stride, int padding) const {
  const TensorShape& x = inputs[0];
  if (kernel < 1 || kernel > kMaxKernel || stride < 1 || stride > kMaxKernel || padding < 0 || padding >= kernel) {
    return wrong(fmt::format("kernel {}, stride {}, padding {} are no window", kernel, stride, padding));
  }
  if (x.height + 2 * padding < kernel || x.width + 2 * padding < kernel) {
    return wrong(fmt::format("a window of {} with padding {} does not fit its input {}", kernel, padding, to_text(x)));
  }
  return TensorShape{out_channels, (x.height + 2 * padding - kernel) / stride + 1, (x.width + 2 * padding - kernel) / stride + 1};
}

ShapeResult ShapeInference::operator()(const Convolution& op) const {
  const int in_channels = inputs[0].channels;
  if (op.out_channels < 1 || op.out_channels > kMaxChannels || op.groups < 1 || in_channels % op.groups != 0 ||
      op.out_channels % op.groups != 0) {
    return wrong(fmt::format("{} groups do not divide {} input and {} output channels", op.groups, in_channels, op.out_channels));
  }
  const ShapeResult shape = window(op.out_channels, op.kernel, op.stride, op.padding);
  if (!shape) {
    return shape;
  }
  if (const auto weights = check_values(op.weights, product({op.out_channels, in_channels / op.groups, op.kernel, op.kernel}),
                                        "the weights' tensor");
      !weights) {
    return wrong(weights.error());
  }
  if (const auto bias = check_values(op.bias, product({op.out_channels}), "the bias"); !bias) {
    return wrong(bias.error());
  }
  return shape;
}

ShapeResult ShapeInference::operator()(const ChannelAffine& op) const {
  for (const std::vector<float>* values : {&op.scale, &op.shift}) {
    if (const auto checked = check_values(*values, product({inputs[0].channels}), "a channel's factor or shift"); !checked) {
      return wrong(checked.error());
    }
  }
  return inputs[0];
}

ShapeResult ShapeInference::operator()(const Activate& op) const {
  if (op.activation == Activation::None) {
    return wrong("activates nothing");
  }
  return inputs[0];
}

ShapeResult ShapeInference::operator()(const Add& /*op*/) const {
  if (inputs[0] != inputs[1]) {
    return wrong(fmt::format("adds {} to {}", to_text(inputs[1]), to_text(inputs[0])));
  }
  return inputs[0];
}

ShapeResult ShapeInference::operator()(const Multiply& /*op*/) const {
  const TensorShape& x = inputs[0];
  const TensorShape& y = inputs[1];
  const auto fits = [](int whole, int part) { return part == whole || part == 1; };
  if (!fits(x.channels, y.channels) || !fits(x.height, y.height) || !fits(x.width, y.width)) {
    return wrong(fmt::format("multiplies {} by {}", to_text(x), to_text(y)));
  }
  return x;
}

ShapeResult ShapeInference::operator()(const Concat& /*op*/) const {
  TensorShape shape{0, inputs[0].height, inputs[0].width};
  for (const TensorShape& input : inputs) {
    if (input.height != shape.height || input.width != shape.width) {
      return wrong(fmt::format("joins {} to {}", to_text(input), to_text(inputs[0])));
    }
    shape.channels += input.channels;
  }
  return shape;
}

ShapeResult ShapeInference::operator()(const Upsample2x& /*op*/) const {
  return TensorShape{inputs[0].channels, 2 * inputs[0].height, 2 * inputs[0].width};
}

ShapeResult ShapeInference::operator()(const MaxPool& op) const {
  return window(inputs[0].channels, op.kernel, op.stride, op.padding);
}

ShapeResult ShapeInference::operator()(const GlobalPool& /*op*/) const {
  return TensorShape{inputs[0].channels, 1, 1};
}

ShapeResult ShapeInference::operator()(const ChannelPool& /*op*/) const {
  return TensorShape{1, inputs[0].height, inputs[0].width};
}

ShapeResult ShapeInference::operator()(const Subsample2x& op) const {
  if ((op.first_row != 0 && op.first_row != 1) || (op.first_column != 0 && op.first_column != 1)) {
    return wrong(fmt::format("begins with row {} and column {}, which are not 0 or 1", op.first_row, op.first_column));
  }
  return TensorShape{inputs[0].channels, (inputs[0].height + 1 - op.first_row) / 2, (inputs[0].width + 1 - op.first_column) / 2};
}

ShapeResult ShapeInference::operator()(const SpaceToDepth& /*op*/) const {
  if (inputs[0].height % 2 != 0 || inputs[0].width % 2 != 0) {
    return wrong(fmt::format("halves {}, whose sides are not even", to_text(inputs[0])));
  }
  return TensorShape{4 * inputs[0].channels, inputs[0].height / 2, inputs[0].width / 2};
}

ShapeResult ShapeInference::operator()(const Cbam& op) const {
  const int channels = inputs[0].channels;
  if (op.hidden < 1 || op.hidden > kMaxChannels || op.kernel < 1 || op.kernel > kMaxKernel || op.kernel % 2 == 0) {
    return wrong(fmt::format("{} hidden values and a kernel of {} are no attention block", op.hidden, op.kernel));
  }
  const std::pair<const std::vector<float>*, std::size_t> parts[] = {{&op.weights1, product({op.hidden, channels})},
                                                                     {&op.bias1, product({op.hidden})},
                                                                     {&op.weights2, product({channels, op.hidden})},
                                                                     {&op.bias2, product({channels})},
                                                                     {&op.spatial_weights, product({2, op.kernel, op.kernel})}};
  for (const auto& [values, count] : parts) {
    if (const auto checked = check_values(*values, count, "a weights' tensor"); !checked) {
      return wrong(checked.error());
    }
  }
  return std::isfinite(op.spatial_bias) ? ShapeResult(inputs[0]) : wrong("the spatial bias is no finite number");
}

ShapeResult check_size(const TensorShape& shape) {
  if (shape.channels < 1 || shape.height < 1 || shape.width < 1 || shape.channels > kMaxChannels || shape.height > kMaxSide ||
      shape.width > kMaxSide || shape.size() > kMaxTensorSize) {
    return wrong(fmt::format("a tensor of {} is empty or too large", to_text(shape)));
  }
  return shape;
}

/// How many inputs an operation takes: {least, most}.
std::pair<std::size_t, std::size_t> input_count(const Operation& operation) {
  if (std::holds_alternative<Add>(operation) || std::holds_alternative<Multiply>(operation)) {
    return {2, 2};
  }
  return std::holds_alternative<Concat>(operation) ? std::pair<std::size_t, std::size_t>{1, 64}
                                                   : std::pair<std::size_t, std::size_t>{1, 1};
}

/// What is wrong with the metadata; empty where nothing is.
std::string check_metadata(const NetworkMetadata& metadata, const TensorShape& input, const std::vector<TensorShape>& outputs) {
  if (metadata.strides.empty() && metadata.anchors.empty()) {
    return {};
  }
  if (metadata.strides.size() != outputs.size() || metadata.anchors.size() != outputs.size()) {
    return fmt::format("{} strides and {} lists of anchors for {} outputs", metadata.strides.size(), metadata.anchors.size(),
                       outputs.size());
  }
  if (metadata.classes.empty()) {
    return "no classes, but strides and anchors";
  }
  if (metadata.boxes_per_anchor < 1 || metadata.boxes_per_anchor > kMaxBoxesPerAnchor) {
    return fmt::format("{} boxes an anchor; there may be 1 or {}", metadata.boxes_per_anchor, kMaxBoxesPerAnchor);
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const int stride = metadata.strides[i];
    const TensorShape& output = outputs[i];
    if (stride < 1 || stride > kMaxSide || output.height * stride != input.height || output.width * stride != input.width) {
      return fmt::format("output {} is {}, which stride {} does not make of an input of {}", i, to_text(output), stride,
                         to_text(input));
    }
    const std::size_t boxes = metadata.anchors[i].size() * static_cast<std::size_t>(metadata.boxes_per_anchor);
    const std::size_t channels = boxes * (5 + metadata.classes.size());
    if (metadata.anchors[i].empty() || channels != static_cast<std::size_t>(output.channels)) {
      return fmt::format("output {} is {}, but {} anchors of {} boxes and {} classes take {} channels", i, to_text(output),
                         metadata.anchors[i].size(), metadata.boxes_per_anchor, metadata.classes.size(), channels);
    }
    for (const Anchor& anchor : metadata.anchors[i]) {
      if (!(anchor.width > 0) || !(anchor.height > 0) || !std::isfinite(anchor.width) || !std::isfinite(anchor.height)) {
        return fmt::format("output {} has an anchor of {} x {} pixels", i, anchor.width, anchor.height);
      }
    }
  }
  return {};
}

}  // namespace

std::string_view to_string(const Operation& operation) {
  static constexpr std::string_view kNames[] = {"Convolution", "ChannelAffine", "Activate", "Add",        "Multiply",
                                                "Concat",      "Upsample2x",    "MaxPool",  "GlobalPool", "ChannelPool",
                                                "Subsample2x", "SpaceToDepth",  "Cbam"};
  static_assert(std::size(kNames) == std::variant_size_v<Operation>);
  return kNames[operation.index()];
}

tl::expected<TensorShape, std::string> infer_shape(const Node& node, const std::vector<TensorShape>& shapes) {
  const auto [least, most] = input_count(node.operation);
  if (node.inputs.size() < least || node.inputs.size() > most) {
    return wrong(fmt::format("has {} inputs", node.inputs.size()));
  }
  std::vector<TensorShape> inputs;
  for (const int input : node.inputs) {
    if (input < 0 || static_cast<std::size_t>(input) >= shapes.size()) {
      return wrong(fmt::format("reads tensor {}, which is not computed before it", input));
    }
    inputs.push_back(shapes[static_cast<std::size_t>(input)]);
  }
  return std::visit(ShapeInference{inputs}, node.operation).and_then(check_size);
}

Result<Network> Network::create(std::string source, TensorShape input, std::vector<Node> nodes, std::vector<int> outputs,
                                NetworkMetadata metadata) {
  const auto bad = [&source](std::string_view what) { return make_error(ErrorCode::BadData, fmt::format("{}: {}", source, what)); };
  if (const ShapeResult checked = check_size(input); !checked) {
    return bad(fmt::format("the input: {}", checked.error()));
  }
  Network network;
  network.shapes_.push_back(input);
  for (const Node& node : nodes) {
    const ShapeResult shape = infer_shape(node, network.shapes_);
    if (!shape) {
      return bad(fmt::format("node '{}' ({}): {}", node.name, to_string(node.operation), shape.error()));
    }
    network.shapes_.push_back(*shape);
  }
  std::vector<TensorShape> output_shapes;
  for (const int output : outputs) {
    if (output < 1 || static_cast<std::size_t>(output) >= network.shapes_.size()) {
      return bad(fmt::format("an output is tensor {}, which no node computes", output));
    }
    output_shapes.push_back(network.shapes_[static_cast<std::size_t>(output)]);
  }
  if (outputs.empty()) {
    return bad("the network has no output");
  }
  if (const std::string problem = check_metadata(metadata, input, output_shapes); !problem.empty()) {
    return bad(fmt::format("the metadata do not fit the network: {}", problem));
  }
  network.source_ = std::move(source);
  network.nodes_ = std::move(nodes);
  network.outputs_ = std::move(outputs);
  network.metadata_ = std::move(metadata);
  return network;
}

Result<Network> Network::with_input(int width, int height) const {
  const int stride = metadata_.strides.empty() ? 1 : *std::max_element(metadata_.strides.begin(), metadata_.strides.end());
  if (width < 1 || height < 1 || width % stride != 0 || height % stride != 0) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: an input of {}x{}: its sides must be multiples of {}", source_, width, height, stride));
  }
  Result<Network> resized = create(source_, {input().channels, height, width}, nodes_, outputs_, metadata_);
  if (!resized) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}; so it is with an input of {}x{}", resized.error().message, width, height));
  }
  resized->ranges_ = ranges_;
  return resized;
}

Status Network::set_ranges(std::vector<ValueRange> ranges) {
  if (ranges.size() != shapes_.size()) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{}: {} value ranges for {} tensors", source_, ranges.size(), shapes_.size()));
  }
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (!std::isfinite(ranges[i].low) || !std::isfinite(ranges[i].high) || !(ranges[i].low < ranges[i].high)) {
      return make_error(ErrorCode::BadData, fmt::format("{}: the value range of tensor {}, {} to {}, is none", source_, i,
                                                        ranges[i].low, ranges[i].high));
    }
  }
  ranges_ = std::move(ranges);
  return {};
}

std::size_t Network::parameter_count() const {
  std::size_t count = 0;
  for (const Node& node : nodes_) {
    if (const auto* convolution = std::get_if<Convolution>(&node.operation)) {
      count += convolution->weights.size() + convolution->bias.size();
    } else if (const auto* affine = std::get_if<ChannelAffine>(&node.operation)) {
      count += affine->scale.size() + affine->shift.size();
    } else if (const auto* cbam = std::get_if<Cbam>(&node.operation)) {
      count += cbam->weights1.size() + cbam->bias1.size() + cbam->weights2.size() + cbam->bias2.size() +
               cbam->spatial_weights.size() + 1;
    }
  }
  return count;
}

std::size_t Network::multiply_accumulates() const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const TensorShape& y = shapes_[i + 1];
    const std::size_t pixels = product({y.height, y.width});
    if (const auto* convolution = std::get_if<Convolution>(&nodes_[i].operation)) {
      count += convolution->weights.size() * pixels;
    } else if (const auto* cbam = std::get_if<Cbam>(&nodes_[i].operation)) {
      count += 2 * (cbam->weights1.size() + cbam->weights2.size()) + cbam->spatial_weights.size() * pixels;
    }
  }
  return count;
}

}  // namespace posed
