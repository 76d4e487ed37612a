#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <oneapi/dnnl/dnnl.hpp>

#include "core/result.h"
#include "detect/kernels/tensor_kernels.h"
#include "detect/network.h"

namespace posed {

/// A tensor in memory, interleaved: floats, or 8-bit values where it has a quantisation.
struct TensorView {
  TensorShape shape;
  std::optional<Quantization> quantization;
  void* data = nullptr;

  std::size_t value_bytes() const { return quantization ? 1 : sizeof(float); }
};

/// One of oneDNN's primitives with its arguments: weights in the layout that it wants, tensors where the views say. Thread-bound.
class DnnlPrimitive {
 public:
  const std::string& implementation() const { return implementation_; }
  std::size_t scratchpad_bytes() const { return scratchpad_bytes_; }
  /// To be called once before the first run; the memory may be shared with primitives that run at other times.
  void set_scratchpad(void* memory);
  bool run(const dnnl::stream& stream) const {
    return dnnl_primitive_execute(primitive_.get(), stream.get(), static_cast<int>(arguments_.size()), arguments_.data()) ==
           dnnl_success;
  }

 private:
  friend class DnnlFactory;

  dnnl::primitive primitive_;
  std::vector<dnnl::memory> memories_;
  std::vector<dnnl_exec_arg_t> arguments_;
  std::string implementation_;
  std::size_t scratchpad_bytes_ = 0;
};

/// Makes primitives on oneDNN's CPU engine. Thread-bound. oneDNN's exceptions pass (dnnl::error); the runner catches them.
class DnnlFactory {
 public:
  DnnlFactory() : engine_(dnnl::engine::kind::cpu, 0), stream_(engine_) {}

  const dnnl::stream& stream() const { return stream_; }

  /// In 8 bits where the input has a quantisation; its output may then still be floats.
  DnnlPrimitive convolution(const Convolution& operation, const TensorView& in, const TensorView& out);
  DnnlPrimitive max_pool(const MaxPool& operation, const TensorView& in, const TensorView& out);

 private:
  dnnl::memory memory_of(const TensorView& view) const;
  dnnl::memory packed_weights(const Convolution& operation, const TensorView& in, const dnnl::memory::desc& layout,
                              const void* values, dnnl::memory::data_type type);
  void add_argument(DnnlPrimitive& primitive, int index, dnnl::memory memory) const;
  void finish(DnnlPrimitive& primitive, const dnnl::memory::desc& scratchpad, const char* implementation) const;

  dnnl::engine engine_;
  dnnl::stream stream_;
};

}  // namespace posed
