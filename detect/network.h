#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/result.h"
#include "detect/operation.h"

/// The plain description of a convolutional network for one image: what a file holds, whatever its format. Who runs it builds what
/// it needs from this (detect/network_runner.h).
namespace posed {

/// Of one image's tensor; its values are float unless said otherwise.
struct TensorShape {
  int channels = 0;
  int height = 0;
  int width = 0;

  std::size_t size() const {
    return static_cast<std::size_t>(channels) * static_cast<std::size_t>(height) * static_cast<std::size_t>(width);
  }
  friend bool operator==(const TensorShape&, const TensorShape&) = default;
};

/// Tensors have numbers: 0 is the network's input, node i makes tensor i + 1.
struct Node {
  std::string name;
  Operation operation;
  std::vector<int> inputs;
};

struct Anchor {
  float width = 0;   ///< [pixels of the network's input]
  float height = 0;  ///< [pixels of the network's input]
};
constexpr int kMaxBoxesPerAnchor = 2;

/// What the values mean, for those who decode them; the strides and anchors are empty where the file says nothing.
struct NetworkMetadata {
  std::string name;
  std::vector<std::string> classes;
  std::vector<int> strides;                  ///< of each output [pixels of the network's input]
  std::vector<std::vector<Anchor>> anchors;  ///< of each output
  int boxes_per_anchor = 1;                  ///< 1 to kMaxBoxesPerAnchor; the second one is of somebody who overlaps another person
};

/// The values that a tensor takes, from calibration (detect/calibration.h).
struct ValueRange {
  float low = 0;
  float high = 0;
};

/// The shape of what `node` makes of tensors of these shapes, or what is wrong with it. Reentrant.
tl::expected<TensorShape, std::string> infer_shape(const Node& node, const std::vector<TensorShape>& shapes);

/// A network that is sound: nodes in order of computation, every tensor's shape known and positive, weights of the right number and
/// finite, outputs that exist, metadata that fits them. Immutable but for the ranges; reentrant.
class Network {
 public:
  /// `source` names the file in messages. Error: BadData, with the node and what is wrong with it.
  static Result<Network> create(std::string source, TensorShape input, std::vector<Node> nodes, std::vector<int> outputs,
                                NetworkMetadata metadata);

  /// The same network, value ranges and all, for images of another size. Its anchors stay: it finds people best who are as large, in
  /// pixels of the input, as those it was trained on. Error: InvalidArgument, where a side is no multiple of the largest stride or
  /// an operation does not fit that size.
  Result<Network> with_input(int width, int height) const;

  const std::string& source() const { return source_; }
  const TensorShape& input() const { return shapes_.front(); }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<TensorShape>& shapes() const { return shapes_; }  ///< of each tensor
  const std::vector<int>& outputs() const { return outputs_; }        ///< tensors
  const NetworkMetadata& metadata() const { return metadata_; }

  /// Of each tensor; empty where the network is not calibrated.
  const std::vector<ValueRange>& ranges() const { return ranges_; }
  /// Error: BadData unless there is one for each tensor, finite and low < high.
  Status set_ranges(std::vector<ValueRange> ranges);

  std::size_t parameter_count() const;
  /// Of the convolutions, for one image.
  std::size_t multiply_accumulates() const;

 private:
  Network() = default;

  std::string source_;
  std::vector<Node> nodes_;
  std::vector<TensorShape> shapes_;
  std::vector<int> outputs_;
  NetworkMetadata metadata_;
  std::vector<ValueRange> ranges_;
};

}  // namespace posed
