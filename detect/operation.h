#pragma once

#include <cstdint>
#include <string_view>
#include <variant>
#include <vector>

/// What the nodes of a network compute, each on the tensors of one image.
namespace posed {

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

}  // namespace posed
