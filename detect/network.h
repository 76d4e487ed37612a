#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/result.h"

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

enum class Activation : std::uint8_t { None, Silu, Relu, Sigmoid };  ///< Silu is x * sigmoid(x)

struct Convolution {
  int out_channels = 0;
  int groups = 1;
  int kernel = 1;              ///< both ways
  int stride = 1;              ///< both ways
  int padding = 0;             ///< zeros on each of the four sides
  std::vector<float> weights;  ///< [out_channels][in_channels / groups][kernel][kernel]
  std::vector<float> bias;     ///< [out_channels]
  Activation activation = Activation::None;
};
/// y = scale[channel] x + shift[channel]: what batch normalisation is once it is trained.
struct ChannelAffine {
  std::vector<float> scale;
  std::vector<float> shift;
};
struct Activate {
  Activation activation = Activation::None;
};
struct Add {};         ///< of two tensors of one shape
struct Multiply {};    ///< of two tensors; the second may be 1 wide, high or deep where the first is not
struct Concat {};      ///< along the channels
struct Upsample2x {};  ///< nearest neighbour
struct MaxPool {
  int kernel = 1;
  int stride = 1;
  int padding = 0;  ///< never the maximum
};
enum class Reduction : std::uint8_t { Mean, Max };
/// Over height and width: C x H x W becomes C x 1 x 1.
struct GlobalPool {
  Reduction reduction = Reduction::Mean;
};
/// Over the channels: C x H x W becomes 1 x H x W.
struct ChannelPool {
  Reduction reduction = Reduction::Mean;
};
/// Every second row and column, beginning with these (0 or 1).
struct Subsample2x {
  int first_row = 0;
  int first_column = 0;
};
/// Four half-size images side by side in the channels, of the first (row, column) (0,0), (1,0), (0,1), (1,1): YOLOv5's "Focus".
struct SpaceToDepth {};
/// Convolutional block attention (Woo et al., "CBAM", ECCV 2018): x' = x s(M(mean_hw(x)) + M(max_hw(x))) with the perceptron
/// M(v) = W2 relu(W1 v + b1) + b2, then y = x' s(conv([mean_c(x'), max_c(x')])); s is the sigmoid.
struct Cbam {
  int hidden = 0;
  std::vector<float> weights1;         ///< [hidden][channels]
  std::vector<float> bias1;            ///< [hidden]
  std::vector<float> weights2;         ///< [channels][hidden]
  std::vector<float> bias2;            ///< [channels]
  int kernel = 7;                      ///< odd; padded to keep the size
  std::vector<float> spatial_weights;  ///< [2][kernel][kernel], mean before max
  float spatial_bias = 0;
};

using Operation = std::variant<Convolution, ChannelAffine, Activate, Add, Multiply, Concat, Upsample2x, MaxPool, GlobalPool,
                               ChannelPool, Subsample2x, SpaceToDepth, Cbam>;
std::string_view to_string(const Operation& operation);

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
/// What the values mean, for those who decode them; the strides and anchors are empty where the file says nothing.
struct NetworkMetadata {
  std::string name;
  std::vector<std::string> classes;
  std::vector<int> strides;                  ///< of each output [pixels of the network's input]
  std::vector<std::vector<Anchor>> anchors;  ///< of each output
};

/// The values that a tensor takes, from calibration (detect/calibration.h).
struct ValueRange {
  float low = 0;
  float high = 0;
};

/// A network that is sound: nodes in order of computation, every tensor's shape known and positive, weights of the right number and
/// finite, outputs that exist, metadata that fits them. Immutable but for the ranges; reentrant.
class Network {
 public:
  /// `source` names the file in messages. Error: BadData, with the node and what is wrong with it.
  static Result<Network> create(std::string source, TensorShape input, std::vector<Node> nodes, std::vector<int> outputs,
                                NetworkMetadata metadata);

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
