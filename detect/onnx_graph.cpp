#include "detect/onnx_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <onnx/onnx_pb.h>

#include "detect/half.h"

namespace posed {
namespace {

constexpr std::int64_t kMaxElements = std::int64_t{1} << 28;

[[noreturn]] void refuse(const onnx::NodeProto& node, std::string_view what, ErrorCode code = ErrorCode::Unsupported) {
  throw OnnxRefusal{code, fmt::format("node '{}' ({}): {}", node.name(), node.op_type(), what)};
}

const onnx::AttributeProto* find_attribute(const onnx::NodeProto& node, std::string_view name) {
  for (const onnx::AttributeProto& attribute : node.attribute()) {
    if (attribute.name() == name) {
      return &attribute;
    }
  }
  return nullptr;
}

std::int64_t int_attribute(const onnx::NodeProto& node, std::string_view name, std::int64_t otherwise) {
  const onnx::AttributeProto* attribute = find_attribute(node, name);
  return attribute == nullptr ? otherwise : attribute->i();
}

std::string string_attribute(const onnx::NodeProto& node, std::string_view name, std::string_view otherwise) {
  const onnx::AttributeProto* attribute = find_attribute(node, name);
  return attribute == nullptr ? std::string(otherwise) : attribute->s();
}

std::vector<std::int64_t> ints_attribute(const onnx::NodeProto& node, std::string_view name,
                                         const std::vector<std::int64_t>& otherwise) {
  const onnx::AttributeProto* attribute = find_attribute(node, name);
  return attribute == nullptr ? otherwise : std::vector<std::int64_t>(attribute->ints().begin(), attribute->ints().end());
}

int to_int(const onnx::NodeProto& node, std::int64_t value) {
  if (value < std::numeric_limits<int>::min() || value > std::numeric_limits<int>::max()) {
    refuse(node, fmt::format("{} is beyond any size", value), ErrorCode::BadData);
  }
  return static_cast<int>(value);
}

/// The one value that an attribute's `count` numbers all have.
int uniform_attribute(const onnx::NodeProto& node, std::string_view name, std::size_t count, std::int64_t otherwise) {
  const std::vector<std::int64_t> values = ints_attribute(node, name, std::vector<std::int64_t>(count, otherwise));
  if (values.size() != count || std::any_of(values.begin(), values.end(), [&](std::int64_t value) { return value != values[0]; })) {
    refuse(node, fmt::format("{} = [{}]: {} equal numbers are supported", name, fmt::join(values, ", "), count));
  }
  return to_int(node, values[0]);
}

void require_defaults(const onnx::NodeProto& node) {
  if (const std::string padding = string_attribute(node, "auto_pad", "NOTSET"); padding != "NOTSET") {
    refuse(node, fmt::format("auto_pad = {}: only explicit padding is supported", padding));
  }
  if (uniform_attribute(node, "dilations", 2, 1) != 1) {
    refuse(node, "dilations are not supported");
  }
  if (int_attribute(node, "ceil_mode", 0) != 0) {
    refuse(node, "ceil_mode is not supported");
  }
}

/// The numbers of a tensor that are stored as bytes, little-endian as ONNX prescribes and as every supported machine is.
template <typename T>
std::vector<T> from_raw(const std::string& raw, std::size_t count, const std::string& name) {
  if (raw.size() != count * sizeof(T)) {
    throw OnnxRefusal{ErrorCode::BadData, fmt::format("constant '{}' has {} bytes for {} values", name, raw.size(), count)};
  }
  std::vector<T> values(count);
  if (!raw.empty()) {  // memcpy takes no null pointer, also for nothing
    std::memcpy(values.data(), raw.data(), raw.size());
  }
  return values;
}

template <typename T, typename Repeated>
std::vector<T> values_of(const onnx::TensorProto& tensor, const Repeated& repeated, std::size_t count) {
  if (tensor.has_raw_data()) {
    return from_raw<T>(tensor.raw_data(), count, tensor.name());
  }
  if (static_cast<std::size_t>(repeated.size()) != count) {
    throw OnnxRefusal{ErrorCode::BadData, fmt::format("constant '{}' has {} of {} values", tensor.name(), repeated.size(), count)};
  }
  return std::vector<T>(repeated.begin(), repeated.end());
}

OnnxConstant read_constant(const onnx::TensorProto& tensor) {
  if (tensor.data_location() == onnx::TensorProto::EXTERNAL) {
    throw OnnxRefusal{ErrorCode::Unsupported,
                      fmt::format("constant '{}' is kept in another file; export with the weights inside", tensor.name())};
  }
  OnnxConstant constant;
  std::int64_t count = 1;
  for (const std::int64_t size : tensor.dims()) {
    if (size < 0 || size > kMaxElements || (count *= size) > kMaxElements) {
      throw OnnxRefusal{ErrorCode::BadData, fmt::format("constant '{}' has an impossible size", tensor.name())};
    }
    constant.dimensions.push_back(static_cast<int>(size));
  }
  const auto elements = static_cast<std::size_t>(count);
  switch (tensor.data_type()) {
    case onnx::TensorProto::FLOAT: constant.floats = values_of<float>(tensor, tensor.float_data(), elements); break;
    case onnx::TensorProto::FLOAT16:
      for (const std::uint16_t half : values_of<std::uint16_t>(tensor, tensor.int32_data(), elements)) {
        constant.floats.push_back(half_to_float(half));
      }
      break;
    case onnx::TensorProto::INT64: constant.integers = values_of<std::int64_t>(tensor, tensor.int64_data(), elements); break;
    default: break;  // whoever uses it refuses it: some exporters leave constants of other types that nothing reads
  }
  return constant;
}

TensorShape image_shape(const onnx::ValueInfoProto& value) {
  const onnx::TensorShapeProto& shape = value.type().tensor_type().shape();
  if (value.type().tensor_type().elem_type() != onnx::TensorProto::FLOAT || shape.dim_size() != 4) {
    throw OnnxRefusal{ErrorCode::Unsupported, fmt::format("input '{}' is no tensor of floats in four dimensions", value.name())};
  }
  std::array<int, 4> sizes{};
  for (int i = 0; i < 4; ++i) {
    const std::int64_t size = shape.dim(i).has_dim_value() ? shape.dim(i).dim_value() : 0;
    if (size < 1 || size > std::numeric_limits<int>::max()) {
      throw OnnxRefusal{ErrorCode::Unsupported,
                        fmt::format("input '{}' has no fixed size; export with batch, height and width fixed", value.name())};
    }
    sizes[static_cast<std::size_t>(i)] = static_cast<int>(size);
  }
  if (sizes[0] != 1) {
    throw OnnxRefusal{ErrorCode::Unsupported, fmt::format("input '{}' is for {} images; export for one", value.name(), sizes[0])};
  }
  return {sizes[1], sizes[2], sizes[3]};
}

/// The one input that is no constant.
const onnx::ValueInfoProto& input_of(const onnx::GraphProto& graph) {
  const onnx::ValueInfoProto* input = nullptr;
  for (const onnx::ValueInfoProto& value : graph.input()) {
    const auto& constants = graph.initializer();
    if (std::any_of(constants.begin(), constants.end(),
                    [&](const onnx::TensorProto& constant) { return constant.name() == value.name(); })) {
      continue;
    }
    if (input != nullptr) {
      throw OnnxRefusal{ErrorCode::Unsupported, fmt::format("a second input '{}'; one is supported", value.name())};
    }
    input = &value;
  }
  if (input == nullptr) {
    throw OnnxRefusal{ErrorCode::BadData, "the graph has no input"};
  }
  return *input;
}

}  // namespace

TensorShape onnx_input_shape(const onnx::GraphProto& graph) {
  return image_shape(input_of(graph));
}

OnnxGraphBuilder::OnnxGraphBuilder(const onnx::GraphProto& graph) {
  for (const onnx::TensorProto& tensor : graph.initializer()) {
    constants_[tensor.name()] = read_constant(tensor);
  }
  tensors_[input_of(graph).name()] = 0;
  shapes_.push_back(onnx_input_shape(graph));
  for (const onnx::NodeProto& node : graph.node()) {
    add_node(node);
  }
  for (const onnx::ValueInfoProto& value : graph.output()) {
    const auto found = tensors_.find(value.name());
    if (found == tensors_.end()) {
      throw OnnxRefusal{ErrorCode::BadData, fmt::format("output '{}' is computed by no node", value.name())};
    }
    outputs_.push_back(found->second);
  }
}

void OnnxGraphBuilder::add_node(const onnx::NodeProto& proto) {
  const std::string& type = proto.op_type();
  if (proto.output_size() < 1 || (!proto.domain().empty() && proto.domain() != "ai.onnx")) {
    refuse(proto,
           proto.output_size() < 1 ? std::string("has no output") : fmt::format("domain '{}' is not supported", proto.domain()));
  }
  if (type == "Constant") {
    const onnx::AttributeProto* value = find_attribute(proto, "value");
    if (value == nullptr || !value->has_t()) {
      refuse(proto, "a constant that is no tensor");
    }
    constants_[proto.output(0)] = read_constant(value->t());
  } else if (type == "Identity") {
    identity(proto);
  } else if (type == "Cast") {
    if (int_attribute(proto, "to", 0) != onnx::TensorProto::FLOAT || constant_of(proto, 0).floats.empty()) {
      refuse(proto, "only constants of 16 bits are converted, to floats of 32");
    }
    identity(proto);
  } else if (type == "Conv") {
    convolution(proto);
  } else if (type == "BatchNormalization") {
    batch_normalization(proto);
  } else if (type == "Sigmoid" || type == "Relu") {
    append(proto, Activate{type == "Relu" ? Activation::Relu : Activation::Sigmoid}, {tensor_of(proto, 0)});
  } else if (type == "Add") {
    append(proto, Add{}, {tensor_of(proto, 0), tensor_of(proto, 1)});
  } else if (type == "Mul") {
    multiply(proto);
  } else if (type == "Concat") {
    std::vector<int> inputs;
    for (int i = 0; i < proto.input_size(); ++i) {
      inputs.push_back(tensor_of(proto, i));
    }
    if (const std::int64_t axis = int_attribute(proto, "axis", 1); axis != 1 && axis != -3) {
      refuse(proto, fmt::format("axis = {}: only channels (1) can be joined", axis));
    }
    append(proto, Concat{}, std::move(inputs));
  } else if (type == "MaxPool") {
    max_pool(proto);
  } else if (type == "GlobalAveragePool" || type == "GlobalMaxPool") {
    append(proto, GlobalPool{type == "GlobalMaxPool" ? Reduction::Max : Reduction::Mean}, {tensor_of(proto, 0)});
  } else if (type == "ReduceMean" || type == "ReduceMax") {
    reduce(proto, type == "ReduceMax" ? Reduction::Max : Reduction::Mean);
  } else if (type == "Resize") {
    resize(proto);
  } else if (type == "Slice") {
    slice(proto);
  } else {
    refuse(proto, "this operator is not supported; the OpenCV engine may run this file");
  }
}

/// Of a tensor, or of weights: exporters write equal constants once.
void OnnxGraphBuilder::identity(const onnx::NodeProto& proto) {
  const auto constant = proto.input_size() > 0 ? constants_.find(proto.input(0)) : constants_.end();
  if (constant != constants_.end()) {
    constants_[proto.output(0)] = OnnxConstant(constant->second);
  } else {
    tensors_[proto.output(0)] = tensor_of(proto, 0);
  }
}

int OnnxGraphBuilder::append(const onnx::NodeProto& proto, Operation operation, std::vector<int> inputs) {
  Node node{proto.name().empty() ? proto.output(0) : proto.name(), std::move(operation), std::move(inputs)};
  const auto shape = infer_shape(node, shapes_);
  if (!shape) {
    refuse(proto, shape.error(), ErrorCode::BadData);
  }
  shapes_.push_back(*shape);
  nodes_.push_back(std::move(node));
  const int tensor = static_cast<int>(nodes_.size());
  tensors_[proto.output(0)] = tensor;
  return tensor;
}

int OnnxGraphBuilder::tensor_of(const onnx::NodeProto& proto, int input) const {
  if (input >= proto.input_size()) {
    refuse(proto, fmt::format("input {} is missing", input), ErrorCode::BadData);
  }
  const std::string& name = proto.input(input);
  const auto found = tensors_.find(name);
  if (found != tensors_.end()) {
    return found->second;
  }
  if (constants_.contains(name)) {
    refuse(proto, fmt::format("input '{}' is a constant, which is not supported there", name));
  }
  if (half_slices_.contains(name)) {
    refuse(proto, fmt::format("input '{}' is sliced along one axis alone, which is not supported", name));
  }
  refuse(proto, fmt::format("input '{}' is computed by no node before it", name), ErrorCode::BadData);
}

const OnnxConstant& OnnxGraphBuilder::constant_of(const onnx::NodeProto& proto, int input) const {
  const auto found = input < proto.input_size() ? constants_.find(proto.input(input)) : constants_.end();
  if (found == constants_.end()) {
    refuse(proto, fmt::format("input {} must be a constant", input));
  }
  return found->second;
}

void OnnxGraphBuilder::convolution(const onnx::NodeProto& proto) {
  require_defaults(proto);
  const OnnxConstant& weights = constant_of(proto, 1);
  if (weights.dimensions.size() != 4 || weights.dimensions[2] != weights.dimensions[3] || weights.floats.empty()) {
    refuse(proto, "the weights are no square kernels of floats");
  }
  Convolution operation;
  operation.out_channels = weights.dimensions[0];
  operation.kernel = weights.dimensions[2];
  operation.groups = to_int(proto, int_attribute(proto, "group", 1));
  operation.stride = uniform_attribute(proto, "strides", 2, 1);
  operation.padding = uniform_attribute(proto, "pads", 4, 0);
  operation.weights = weights.floats;
  operation.bias = proto.input_size() > 2 && !proto.input(2).empty()
                       ? constant_of(proto, 2).floats
                       : std::vector<float>(static_cast<std::size_t>(operation.out_channels), 0.0F);
  append(proto, std::move(operation), {tensor_of(proto, 0)});
}

void OnnxGraphBuilder::batch_normalization(const onnx::NodeProto& proto) {
  const onnx::AttributeProto* epsilon_attribute = find_attribute(proto, "epsilon");
  const double epsilon = epsilon_attribute == nullptr ? 1e-5 : static_cast<double>(epsilon_attribute->f());
  const std::vector<float>& gamma = constant_of(proto, 1).floats;
  const std::vector<float>& beta = constant_of(proto, 2).floats;
  const std::vector<float>& mean = constant_of(proto, 3).floats;
  const std::vector<float>& variance = constant_of(proto, 4).floats;
  if (beta.size() != gamma.size() || mean.size() != gamma.size() || variance.size() != gamma.size()) {
    refuse(proto, "its four lists of constants differ in length", ErrorCode::BadData);
  }
  ChannelAffine operation;
  for (std::size_t i = 0; i < gamma.size(); ++i) {
    const double scale = static_cast<double>(gamma[i]) / std::sqrt(static_cast<double>(variance[i]) + epsilon);
    operation.scale.push_back(static_cast<float>(scale));
    operation.shift.push_back(static_cast<float>(static_cast<double>(beta[i]) - scale * static_cast<double>(mean[i])));
  }
  append(proto, std::move(operation), {tensor_of(proto, 0)});
}

void OnnxGraphBuilder::max_pool(const onnx::NodeProto& proto) {
  require_defaults(proto);
  const int input = tensor_of(proto, 0);
  const TensorShape& shape = shape_of(input);
  const std::vector<std::int64_t> kernel = ints_attribute(proto, "kernel_shape", {});
  const int padding = uniform_attribute(proto, "pads", 4, 0);
  if (kernel.size() == 2 && kernel[0] == shape.height && kernel[1] == shape.width && padding == 0) {
    append(proto, GlobalPool{Reduction::Max}, {input});  // how adaptive pooling to one pixel is exported
    return;
  }
  append(proto, MaxPool{uniform_attribute(proto, "kernel_shape", 2, 1), uniform_attribute(proto, "strides", 2, 1), padding},
         {input});
}

void OnnxGraphBuilder::reduce(const onnx::NodeProto& proto, Reduction reduction) {
  std::vector<std::int64_t> axes = ints_attribute(proto, "axes", {});
  std::transform(axes.begin(), axes.end(), axes.begin(), [](std::int64_t axis) { return axis < 0 ? axis + 4 : axis; });
  std::sort(axes.begin(), axes.end());
  if (int_attribute(proto, "keepdims", 1) != 1) {
    refuse(proto, "keepdims = 0 is not supported");
  }
  if (axes == std::vector<std::int64_t>{1}) {
    append(proto, ChannelPool{reduction}, {tensor_of(proto, 0)});
  } else if (axes == std::vector<std::int64_t>{2, 3}) {
    append(proto, GlobalPool{reduction}, {tensor_of(proto, 0)});
  } else {
    refuse(proto, fmt::format("axes = [{}]: [1] and [2, 3] are supported", fmt::join(axes, ", ")));
  }
}

void OnnxGraphBuilder::resize(const onnx::NodeProto& proto) {
  const std::string mode = string_attribute(proto, "mode", "nearest");
  const std::string coordinates = string_attribute(proto, "coordinate_transformation_mode", "half_pixel");
  const std::string rounding = string_attribute(proto, "nearest_mode", "round_prefer_floor");
  // Both repeat each pixel where the factor is two.
  const bool repeats = (coordinates == "asymmetric" && (rounding == "floor" || rounding == "round_prefer_floor")) ||
                       (coordinates == "half_pixel" && rounding == "round_prefer_floor");
  if (mode != "nearest" || !repeats) {
    refuse(proto,
           fmt::format("{} with {} coordinates and {}: only repeating each pixel is supported", mode, coordinates, rounding));
  }
  if (const OnnxConstant& scales = constant_of(proto, 2); scales.floats != std::vector<float>{1, 1, 2, 2}) {
    refuse(proto, fmt::format("scales = [{}]: only [1, 1, 2, 2] is supported", fmt::join(scales.floats, ", ")));
  }
  append(proto, Upsample2x{}, {tensor_of(proto, 0)});
}

void OnnxGraphBuilder::slice(const onnx::NodeProto& proto) {
  const auto one = [&](int input) {
    const std::vector<std::int64_t>& values = constant_of(proto, input).integers;
    if (values.size() != 1) {
      refuse(proto, "slices along one axis at a time are supported");
    }
    return values[0];
  };
  const std::int64_t start = one(1);
  const std::int64_t end = one(2);
  const std::int64_t axis = one(3);
  const std::int64_t step = one(4);
  if ((axis != 2 && axis != 3) || step != 2 || (start != 0 && start != 1)) {
    refuse(proto, fmt::format("axis {}, start {}, step {}: only every second row or column is supported", axis, start, step));
  }
  const bool rows = axis == 2;
  const auto earlier = proto.input_size() > 0 ? half_slices_.find(proto.input(0)) : half_slices_.end();
  const int tensor = earlier != half_slices_.end() ? earlier->second.tensor : tensor_of(proto, 0);
  if (end < (rows ? shape_of(tensor).height : shape_of(tensor).width)) {
    refuse(proto, fmt::format("end {}: only slices to the end are supported", end));
  }
  const HalfSlice half{tensor, rows, static_cast<int>(start)};
  if (earlier == half_slices_.end()) {
    half_slices_[proto.output(0)] = half;
    return;
  }
  if (earlier->second.rows == rows) {
    refuse(proto, "slices the same axis twice");
  }
  const HalfSlice& other = earlier->second;
  append(proto, rows ? Subsample2x{half.first, other.first} : Subsample2x{other.first, half.first}, {tensor});
}

void OnnxGraphBuilder::multiply(const onnx::NodeProto& proto) {
  int first = tensor_of(proto, 0);
  int second = tensor_of(proto, 1);
  if (shape_of(first).size() < shape_of(second).size()) {
    std::swap(first, second);
  }
  append(proto, Multiply{}, {first, second});
}

}  // namespace posed
