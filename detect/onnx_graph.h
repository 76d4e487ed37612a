#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "detect/network.h"

namespace onnx {
class GraphProto;
class NodeProto;
class TensorProto;
}  // namespace onnx

namespace posed {

/// Why a graph is not taken.
struct OnnxRefusal {
  ErrorCode code = ErrorCode::BadData;
  std::string what;
};

/// A small constant of the graph: the numbers of an initializer or of a Constant node.
struct OnnxConstant {
  std::vector<int> dimensions;
  std::vector<float> floats;           ///< where it holds floating-point numbers
  std::vector<std::int64_t> integers;  ///< where it holds integers
};

/// The size of a graph's one input. Throws OnnxRefusal where it has none, several, or one that is no image of a fixed size.
TensorShape onnx_input_shape(const onnx::GraphProto& graph);

/// Turns the nodes of an ONNX graph into those of a `Network`, one after the other. Thread-bound. What it refuses it throws as
/// `OnnxRefusal`, which read_onnx catches.
class OnnxGraphBuilder {
 public:
  /// Reads the input, the initializers, the nodes and the outputs.
  explicit OnnxGraphBuilder(const onnx::GraphProto& graph);

  TensorShape input() const { return shapes_.front(); }
  std::vector<Node>& nodes() { return nodes_; }
  std::vector<int>& outputs() { return outputs_; }

 private:
  /// Rows or columns that a Slice left out; two of them, one along each axis, make a `Subsample2x`.
  struct HalfSlice {
    int tensor = 0;
    bool rows = false;
    int first = 0;
  };

  void add_node(const onnx::NodeProto& proto);
  int append(const onnx::NodeProto& proto, Operation operation, std::vector<int> inputs);
  void identity(const onnx::NodeProto& proto);
  void convolution(const onnx::NodeProto& proto);
  void batch_normalization(const onnx::NodeProto& proto);
  void max_pool(const onnx::NodeProto& proto);
  void reduce(const onnx::NodeProto& proto, Reduction reduction);
  void resize(const onnx::NodeProto& proto);
  void slice(const onnx::NodeProto& proto);
  void multiply(const onnx::NodeProto& proto);

  int tensor_of(const onnx::NodeProto& proto, int input) const;
  const OnnxConstant& constant_of(const onnx::NodeProto& proto, int input) const;
  const TensorShape& shape_of(int tensor) const { return shapes_[static_cast<std::size_t>(tensor)]; }

  std::map<std::string, OnnxConstant, std::less<>> constants_;
  std::map<std::string, int, std::less<>> tensors_;
  std::map<std::string, HalfSlice, std::less<>> half_slices_;
  std::vector<TensorShape> shapes_;
  std::vector<Node> nodes_;
  std::vector<int> outputs_;
};

}  // namespace posed
