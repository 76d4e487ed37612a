#include "detect/runner_program.h"

#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "detect/attention_block.h"
#include "detect/kernels/tensor_kernels.h"
#include "detect/memory_plan.h"
#include "detect/quantization_plan.h"

namespace posed {
namespace {

std::size_t bytes_of(const TensorView& view) {
  return view.shape.size() * view.value_bytes();
}

std::size_t pixels_of(const TensorShape& shape) {
  return static_cast<std::size_t>(shape.height) * static_cast<std::size_t>(shape.width);
}

template <typename T>
T* as(const TensorView& view) {
  return static_cast<T*>(view.data);
}

/// Where the aligned part of a block begins that has kBufferAlignment bytes to spare.
std::byte* aligned_start(std::vector<std::byte>& block) {
  void* start = block.data();
  std::size_t space = block.size();
  return static_cast<std::byte*>(std::align(kBufferAlignment, 1, start, space));
}

bool is_supported(const Operation& operation) {
  return std::holds_alternative<Convolution>(operation) || std::holds_alternative<Add>(operation) ||
         std::holds_alternative<Concat>(operation) || std::holds_alternative<Upsample2x>(operation) ||
         std::holds_alternative<MaxPool>(operation) || std::holds_alternative<SpaceToDepth>(operation) ||
         std::holds_alternative<Cbam>(operation);
}

}  // namespace

Status RunnerProgramBuilder::build() {
  if (const Status supported = check_supported(); !supported) {
    return supported;
  }
  choose_quantization();
  place_tensors();
  make_outputs();
  if (reads_interleaved_input()) {
    program_.steps.push_back({"input: interleave", interleave_step(view(0), 1), 0, 0});
  }
  for (std::size_t node = 0; node < program_.network.nodes().size(); ++node) {
    add_node_step(node);
  }
  for (std::size_t output = 0; output < program_.network.outputs().size(); ++output) {
    add_output_step(output);
  }
  place_scratchpad();
  return {};
}

Status RunnerProgramBuilder::check_supported() const {
  const Network& network = program_.network;
  for (const Node& node : network.nodes()) {
    if (!is_supported(node.operation) || (std::holds_alternative<SpaceToDepth>(node.operation) && node.inputs[0] != 0)) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("{}: node '{}' ({}) is none that the runner computes there; the OpenCV engine may",
                                    network.source(), node.name, to_string(node.operation)));
    }
  }
  if (program_.precision == Precision::Int8 && network.ranges().empty()) {
    return make_error(
        ErrorCode::Unsupported,
        fmt::format("{}: 8 bits need a calibrated network; make one with posectl model convert --calibrate", network.source()));
  }
  return {};
}

bool RunnerProgramBuilder::reads_interleaved_input() const {
  const std::vector<Node>& nodes = program_.network.nodes();
  return std::any_of(nodes.begin(), nodes.end(), [](const Node& node) {
    return !std::holds_alternative<SpaceToDepth>(node.operation) && std::count(node.inputs.begin(), node.inputs.end(), 0) != 0;
  });
}

bool RunnerProgramBuilder::is_read(int tensor) const {
  const std::vector<Node>& nodes = program_.network.nodes();
  return std::any_of(nodes.begin(), nodes.end(),
                     [tensor](const Node& node) { return std::count(node.inputs.begin(), node.inputs.end(), tensor) != 0; });
}

/// In 8 bits everything has a quantisation but what only an output reads and a convolution can deliver in floats: the heads.
void RunnerProgramBuilder::choose_quantization() {
  const Network& network = program_.network;
  const std::vector<Quantization> planned =
      program_.precision == Precision::Int8 ? plan_quantization(network) : std::vector<Quantization>();
  for (std::size_t tensor = 0; tensor < network.shapes().size(); ++tensor) {
    TensorView view{network.shapes()[tensor], std::nullopt, nullptr};
    const bool is_head = tensor != 0 && std::holds_alternative<Convolution>(network.nodes()[tensor - 1].operation) &&
                         !is_read(static_cast<int>(tensor));
    if (!planned.empty() && !is_head) {
      view.quantization = planned[tensor];
    }
    program_.tensors.push_back(view);
  }
}

std::size_t RunnerProgramBuilder::scratch_bytes(std::size_t node) const {
  const Node& cbam_node = program_.network.nodes()[node];
  const auto* cbam = std::get_if<Cbam>(&cbam_node.operation);
  if (cbam == nullptr) {
    return 0;
  }
  const TensorView& in = view(cbam_node.inputs[0]);
  const std::size_t floats = AttentionBlock(*cbam, in.shape).scratch_floats() + (in.quantization ? 2 * in.shape.size() : 0);
  return floats * sizeof(float);
}

/// Step 0 fills the interleaved input, step t makes tensor t, the outputs follow.
void RunnerProgramBuilder::place_tensors() {
  const Network& network = program_.network;
  const std::size_t nodes = network.nodes().size();
  std::vector<BufferLifetime> buffers;
  for (std::size_t tensor = 0; tensor < program_.tensors.size(); ++tensor) {
    buffers.push_back({bytes_of(program_.tensors[tensor]), tensor, tensor});
  }
  buffers[0].bytes = reads_interleaved_input() ? buffers[0].bytes : 0;
  const auto read_at = [&](int tensor, std::size_t step) { buffers[static_cast<std::size_t>(tensor)].last_step = step; };
  for (std::size_t node = 0; node < nodes; ++node) {
    for (const int input : network.nodes()[node].inputs) {
      read_at(input, node + 1);
    }
    buffers.push_back({scratch_bytes(node), node + 1, node + 1});
  }
  for (std::size_t output = 0; output < network.outputs().size(); ++output) {
    const std::size_t step = nodes + 1 + output;
    const int tensor = network.outputs()[output];
    read_at(tensor, step);
    buffers.push_back({view(tensor).quantization ? view(tensor).shape.size() * sizeof(float) : 0, step, step});
  }
  const MemoryPlan plan = plan_memory(buffers);
  program_.arena.resize(plan.bytes + kBufferAlignment);
  std::byte* const base = aligned_start(program_.arena);
  for (std::size_t buffer = 0; buffer < buffers.size(); ++buffer) {
    std::byte* const data = base + plan.offsets[buffer];
    if (buffer < program_.tensors.size()) {
      program_.tensors[buffer].data = data;
    } else {
      scratch_.push_back(data);
    }
  }
  program_.input.resize(network.input().size());
}

void RunnerProgramBuilder::add_node_step(std::size_t node) {
  std::string implementation = "own";
  StepFunction function = function_of(node, implementation);
  const Node& named = program_.network.nodes()[node];
  program_.steps.push_back({fmt::format("{}: {} {}", named.name, to_string(named.operation), implementation), std::move(function),
                            static_cast<int>(node) + 1, 0});
}

StepFunction RunnerProgramBuilder::function_of(std::size_t node, std::string& implementation) {
  const Node& described = program_.network.nodes()[node];
  const TensorView& in = view(described.inputs[0]);
  const TensorView& out = view(static_cast<int>(node) + 1);
  if (const auto* convolution = std::get_if<Convolution>(&described.operation)) {
    return primitive_step(program_.factory.convolution(*convolution, in, out), implementation);
  }
  if (const auto* pool = std::get_if<MaxPool>(&described.operation)) {
    return primitive_step(program_.factory.max_pool(*pool, in, out), implementation);
  }
  if (std::holds_alternative<SpaceToDepth>(described.operation)) {
    return interleave_step(out, 2);
  }
  if (std::holds_alternative<Concat>(described.operation)) {
    return concat_step(described, out);
  }
  if (std::holds_alternative<Upsample2x>(described.operation)) {
    return upsample_step(in, out);
  }
  if (const auto* cbam = std::get_if<Cbam>(&described.operation)) {
    return attention_step(*cbam, in, out, scratch_[node]);
  }
  return add_step(in, view(described.inputs[1]), out);
}

StepFunction RunnerProgramBuilder::primitive_step(DnnlPrimitive primitive, std::string& implementation) {
  implementation = primitive.implementation();
  program_.primitives.push_back(std::move(primitive));
  return [made = &program_.primitives.back(), stream = &program_.factory.stream()] { return made->run(*stream); };
}

StepFunction RunnerProgramBuilder::interleave_step(const TensorView& out, int step) const {
  const TensorShape shape = program_.network.input();
  return [planes = program_.input.data(), shape, out, step] {
    if (out.quantization) {
      tensor_kernels().interleave_u8(planes, shape.channels, shape.height, shape.width, step, *out.quantization,
                                     as<std::uint8_t>(out));
    } else {
      tensor_kernels().interleave(planes, shape.channels, shape.height, shape.width, step, as<float>(out));
    }
    return true;
  };
}

StepFunction RunnerProgramBuilder::add_step(const TensorView& a, const TensorView& b, const TensorView& out) const {
  return [a, b, out] {
    if (out.quantization) {
      tensor_kernels().add_u8(as<std::uint8_t>(a), *a.quantization, as<std::uint8_t>(b), *b.quantization, out.shape.size(),
                              *out.quantization, as<std::uint8_t>(out));
    } else {
      tensor_kernels().add(as<float>(a), as<float>(b), out.shape.size(), as<float>(out));
    }
    return true;
  };
}

StepFunction RunnerProgramBuilder::concat_step(const Node& node, const TensorView& out) const {
  std::vector<ConcatPart> parts;
  for (const int input : node.inputs) {
    const TensorView& part = view(input);
    parts.push_back({as<std::uint8_t>(part), static_cast<std::size_t>(part.shape.channels) * part.value_bytes()});
  }
  return [parts = std::move(parts), out] {
    tensor_kernels().concat(parts.data(), parts.size(), pixels_of(out.shape), as<std::uint8_t>(out));
    return true;
  };
}

StepFunction RunnerProgramBuilder::upsample_step(const TensorView& in, const TensorView& out) const {
  return [in, out] {
    tensor_kernels().upsample2x(as<std::uint8_t>(in), static_cast<std::size_t>(in.shape.height),
                                static_cast<std::size_t>(in.shape.width),
                                static_cast<std::size_t>(in.shape.channels) * in.value_bytes(), as<std::uint8_t>(out));
    return true;
  };
}

StepFunction RunnerProgramBuilder::attention_step(const Cbam& cbam, const TensorView& in, const TensorView& out,
                                                  std::byte* scratch) const {
  auto block = std::make_shared<const AttentionBlock>(cbam, in.shape);
  auto* const floats = reinterpret_cast<float*>(scratch);
  if (!in.quantization) {
    return [block = std::move(block), in, out, floats] {
      block->run(as<float>(in), as<float>(out), floats);
      return true;
    };
  }
  return [block = std::move(block), in, out, floats] {
    const std::size_t count = in.shape.size();
    float* const before = floats + block->scratch_floats();
    float* const after = before + count;
    tensor_kernels().dequantize(as<std::uint8_t>(in), count, *in.quantization, before);
    block->run(before, after, floats);
    tensor_kernels().quantize(after, count, *out.quantization, as<std::uint8_t>(out));
    return true;
  };
}

void RunnerProgramBuilder::make_outputs() {
  for (const int tensor : program_.network.outputs()) {
    program_.output_values.emplace_back(view(tensor).shape.size());
  }
  for (std::size_t i = 0; i < program_.output_values.size(); ++i) {
    const int tensor = program_.network.outputs()[i];
    const TensorShape& shape = view(tensor).shape;
    program_.outputs.push_back({program_.network.nodes()[static_cast<std::size_t>(tensor) - 1].name,
                                {1, shape.channels, shape.height, shape.width},
                                program_.output_values[i]});
  }
}

void RunnerProgramBuilder::add_output_step(std::size_t output) {
  const TensorView from = view(program_.network.outputs()[output]);
  auto* const floats = reinterpret_cast<float*>(scratch_[program_.network.nodes().size() + output]);
  std::vector<float>& values = program_.output_values[output];
  const auto deliver = [from, floats, planes = values.data()] {
    if (from.quantization) {
      tensor_kernels().dequantize(as<std::uint8_t>(from), from.shape.size(), *from.quantization, floats);
    }
    tensor_kernels().deinterleave(from.quantization ? floats : as<float>(from), static_cast<std::size_t>(from.shape.channels),
                                  pixels_of(from.shape), planes);
    return true;
  };
  program_.steps.push_back({fmt::format("output {}: deinterleave own", output), deliver, -1, 0});
}

/// One for all primitives, as they run one after the other.
void RunnerProgramBuilder::place_scratchpad() {
  std::size_t bytes = 0;
  for (const DnnlPrimitive& primitive : program_.primitives) {
    bytes = std::max(bytes, primitive.scratchpad_bytes());
  }
  program_.scratchpad.resize(bytes + kBufferAlignment);
  for (DnnlPrimitive& primitive : program_.primitives) {
    primitive.set_scratchpad(aligned_start(program_.scratchpad));
  }
}

}  // namespace posed
