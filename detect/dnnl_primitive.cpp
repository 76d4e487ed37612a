#include "detect/dnnl_primitive.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "detect/quantization_plan.h"

namespace posed {
namespace {

using dnnl::memory;
using DataType = memory::data_type;
using Tag = memory::format_tag;

memory::dims dims_of(const TensorShape& shape) {
  return {1, shape.channels, shape.height, shape.width};
}

memory::desc desc_of(const TensorView& view) {
  return {dims_of(view.shape), view.quantization ? DataType::u8 : DataType::f32, Tag::nhwc};
}

memory::dims weight_dims(const Convolution& operation, int in_channels) {
  const int k = operation.kernel;
  if (operation.groups == 1) {
    return {operation.out_channels, in_channels, k, k};
  }
  return {operation.groups, operation.out_channels / operation.groups, in_channels / operation.groups, k, k};
}

dnnl::algorithm algorithm_of(Activation activation) {
  switch (activation) {
    case Activation::Silu: return dnnl::algorithm::eltwise_swish;
    case Activation::Relu: return dnnl::algorithm::eltwise_relu;
    case Activation::Sigmoid: return dnnl::algorithm::eltwise_logistic;
    case Activation::None: break;
  }
  return dnnl::algorithm::undef;
}

/// The slope of SiLU's negative side, and of ReLU's.
float alpha_of(Activation activation) {
  return activation == Activation::Silu ? 1.0F : 0.0F;
}

/// The largest weight in 8 bits. Without VNNI, oneDNN adds two products of an activation and a weight in 16 bits, which must not
/// overflow: 2 * 255 * 64 does not.
int weight_limit() {
  switch (dnnl::get_effective_cpu_isa()) {
    case dnnl::cpu_isa::sse41:
    case dnnl::cpu_isa::avx:
    case dnnl::cpu_isa::avx2:
    case dnnl::cpu_isa::avx512_core: return 64;
    default: return 127;
  }
}

/// The attributes of a convolution; `accumulator_scales` turn its 32-bit sums into real values, empty where it works in floats.
dnnl::primitive_attr attributes(Activation activation, std::vector<float> accumulator_scales, const TensorView& in,
                                const TensorView& out) {
  dnnl::primitive_attr attr;
  attr.set_scratchpad_mode(dnnl::scratchpad_mode::user);
  const float to_steps = out.quantization ? 1.0F / out.quantization->scale : 1.0F;
  if (activation != Activation::None) {
    dnnl::post_ops post_ops;
    post_ops.append_eltwise(to_steps, algorithm_of(activation), alpha_of(activation), 0.0F);
    attr.set_post_ops(post_ops);
  } else {
    std::for_each(accumulator_scales.begin(), accumulator_scales.end(), [to_steps](float& scale) { scale *= to_steps; });
  }
  if (!accumulator_scales.empty()) {
    constexpr int kEachOutputChannel = 1 << 1;
    attr.set_output_scales(kEachOutputChannel, accumulator_scales);
  }
  if (in.quantization && in.quantization->zero_point != 0) {
    attr.set_zero_points(DNNL_ARG_SRC, 0, {in.quantization->zero_point});
  }
  if (out.quantization && out.quantization->zero_point != 0) {
    attr.set_zero_points(DNNL_ARG_DST, 0, {out.quantization->zero_point});
  }
  return attr;
}

}  // namespace

void DnnlPrimitive::set_scratchpad(void* memory) {
  for (const dnnl_exec_arg_t& argument : arguments_) {
    if (argument.arg == DNNL_ARG_SCRATCHPAD) {
      dnnl::error::wrap_c_api(dnnl_memory_set_data_handle(argument.memory, memory), "scratchpad");
    }
  }
}

memory DnnlFactory::memory_of(const TensorView& view) const {
  return {desc_of(view), engine_, view.data};
}

void DnnlFactory::add_argument(DnnlPrimitive& primitive, int index, memory memory) const {
  primitive.arguments_.push_back({index, memory.get()});
  primitive.memories_.push_back(std::move(memory));
}

void DnnlFactory::finish(DnnlPrimitive& primitive, const memory::desc& scratchpad, const char* implementation) const {
  primitive.implementation_ = implementation;
  primitive.scratchpad_bytes_ = scratchpad.get_size();
  if (primitive.scratchpad_bytes_ != 0) {
    add_argument(primitive, DNNL_ARG_SCRATCHPAD, memory(scratchpad, engine_, nullptr));
  }
}

memory DnnlFactory::packed_weights(const Convolution& operation, const TensorView& in, const memory::desc& layout,
                                   const void* values, DataType type) {
  const memory::desc plain(weight_dims(operation, in.shape.channels), type, operation.groups == 1 ? Tag::oihw : Tag::goihw);
  memory from(plain, engine_, const_cast<void*>(values));  // NOLINT(cppcoreguidelines-pro-type-const-cast): oneDNN only reads it
  memory to(layout, engine_);
  dnnl::reorder(from, to).execute(stream_, from, to);
  stream_.wait();
  return to;
}

DnnlPrimitive DnnlFactory::convolution(const Convolution& operation, const TensorView& in, const TensorView& out) {
  const bool int8 = in.quantization.has_value();
  QuantizedWeights quantized;
  std::vector<float> scales;
  std::vector<float> bias = operation.bias;
  if (int8) {
    quantized = quantize_weights(operation, weight_limit());
    for (std::size_t channel = 0; channel < bias.size(); ++channel) {
      scales.push_back(in.quantization->scale * quantized.scales[channel]);
      bias[channel] /= scales[channel];
    }
  }
  const memory::dims strides{operation.stride, operation.stride};
  const memory::dims padding{operation.padding, operation.padding};
  const memory::desc weights(weight_dims(operation, in.shape.channels), int8 ? DataType::s8 : DataType::f32, Tag::any);
  const memory::desc bias_desc({operation.out_channels}, DataType::f32, Tag::x);
  const dnnl::convolution_forward::primitive_desc chosen(
      dnnl::convolution_forward::desc(dnnl::prop_kind::forward_inference, dnnl::algorithm::convolution_direct, desc_of(in), weights,
                                      bias_desc, desc_of(out), strides, padding, padding),
      attributes(operation.activation, std::move(scales), in, out), engine_);

  DnnlPrimitive primitive;
  primitive.primitive_ = dnnl::convolution_forward(chosen);
  add_argument(primitive, DNNL_ARG_SRC, memory_of(in));
  add_argument(primitive, DNNL_ARG_WEIGHTS,
               int8 ? packed_weights(operation, in, chosen.weights_desc(), quantized.values.data(), DataType::s8)
                    : packed_weights(operation, in, chosen.weights_desc(), operation.weights.data(), DataType::f32));
  memory bias_memory(bias_desc, engine_);
  std::copy(bias.begin(), bias.end(), static_cast<float*>(bias_memory.get_data_handle()));
  add_argument(primitive, DNNL_ARG_BIAS, std::move(bias_memory));
  add_argument(primitive, DNNL_ARG_DST, memory_of(out));
  finish(primitive, chosen.scratchpad_desc(), chosen.impl_info_str());
  return primitive;
}

DnnlPrimitive DnnlFactory::max_pool(const MaxPool& operation, const TensorView& in, const TensorView& out) {
  dnnl::primitive_attr attr;
  attr.set_scratchpad_mode(dnnl::scratchpad_mode::user);
  const memory::dims strides{operation.stride, operation.stride};
  const memory::dims kernel{operation.kernel, operation.kernel};
  const memory::dims padding{operation.padding, operation.padding};
  const dnnl::pooling_forward::primitive_desc chosen(
      dnnl::pooling_forward::desc(dnnl::prop_kind::forward_inference, dnnl::algorithm::pooling_max, desc_of(in), desc_of(out),
                                  strides, kernel, padding, padding),
      attr, engine_);
  DnnlPrimitive primitive;
  primitive.primitive_ = dnnl::pooling_forward(chosen);
  add_argument(primitive, DNNL_ARG_SRC, memory_of(in));
  add_argument(primitive, DNNL_ARG_DST, memory_of(out));
  finish(primitive, chosen.scratchpad_desc(), chosen.impl_info_str());
  return primitive;
}

}  // namespace posed
