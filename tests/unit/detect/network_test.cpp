#include "detect/network.h"

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using ::testing::HasSubstr;

constexpr TensorShape kInput{2, 4, 6};

Convolution convolution(int in_channels, int out_channels, int kernel, int stride, int padding) {
  Convolution operation;
  operation.out_channels = out_channels;
  operation.kernel = kernel;
  operation.stride = stride;
  operation.padding = padding;
  operation.weights.assign(static_cast<std::size_t>(out_channels * in_channels * kernel * kernel), 0.5F);
  operation.bias.assign(static_cast<std::size_t>(out_channels), 0.0F);
  return operation;
}

Cbam cbam(int channels, int hidden) {
  const auto zeros = [](int count) { return std::vector<float>(static_cast<std::size_t>(count), 0.0F); };
  return {hidden, zeros(channels * hidden), zeros(hidden), zeros(channels * hidden), zeros(channels), 7, zeros(98), 0};
}

Result<Network> one_node(Operation operation, std::vector<int> inputs = {0}) {
  return Network::create("file.onnx", kInput, {{"node 7", std::move(operation), std::move(inputs)}}, {1}, {});
}

TEST(Network, InfersEachOperationsShape) {
  const struct {
    Operation operation;
    std::vector<int> inputs;
    TensorShape shape;
  } cases[] = {
      {convolution(2, 5, 3, 2, 1), {0}, {5, 2, 3}},
      {ChannelAffine{{1, 1}, {0, 0}}, {0}, kInput},
      {Activate{Activation::Silu}, {0}, kInput},
      {Add{}, {0, 0}, kInput},
      {Multiply{}, {0, 0}, kInput},
      {Concat{}, {0, 0, 0}, {6, 4, 6}},
      {Upsample2x{}, {0}, {2, 8, 12}},
      {MaxPool{2, 2, 0}, {0}, {2, 2, 3}},
      {GlobalPool{Reduction::Max}, {0}, {2, 1, 1}},
      {ChannelPool{Reduction::Mean}, {0}, {1, 4, 6}},
      {Subsample2x{1, 0}, {0}, {2, 2, 3}},
      {SpaceToDepth{}, {0}, {8, 2, 3}},
      {cbam(2, 1), {0}, kInput},
  };
  static_assert(std::size(cases) == std::variant_size_v<Operation>);
  for (const auto& [operation, inputs, shape] : cases) {
    const Result<Network> network = one_node(operation, inputs);
    ASSERT_TRUE(network) << network.error().message;
    EXPECT_EQ(network->shapes()[1], shape) << to_string(operation);
  }
}

TEST(Network, NamesFileNodeAndFault) {
  Convolution short_weights = convolution(2, 5, 3, 1, 1);
  short_weights.weights.pop_back();
  Convolution infinite = convolution(2, 5, 3, 1, 1);
  infinite.bias[2] = std::numeric_limits<float>::infinity();
  Convolution odd_groups = convolution(2, 5, 3, 1, 1);
  odd_groups.groups = 2;
  Convolution many = convolution(2, 1, 1, 1, 0);
  many.out_channels = std::numeric_limits<int>::max();
  Cbam even_kernel = cbam(2, 1);
  even_kernel.kernel = 6;
  const struct {
    Operation operation;
    std::vector<int> inputs;
    const char* fault;
  } cases[] = {
      {short_weights, {0}, "the weights' tensor has 89 values, 90 are needed"},
      {infinite, {0}, "the bias has a value that is no finite number"},
      {odd_groups, {0}, "2 groups do not divide 2 input and 5 output channels"},
      {many, {0}, "do not divide"},
      {convolution(2, 5, 9, 1, 1), {0}, "a window of 9 with padding 1 does not fit its input 2x4x6"},
      {convolution(2, 5, 3, 0, 1), {0}, "kernel 3, stride 0, padding 1 are no window"},
      {ChannelAffine{{1}, {0}}, {0}, "has 1 values, 2 are needed"},
      {Activate{}, {0}, "activates nothing"},
      {Add{}, {0}, "has 1 inputs"},
      {Concat{}, {}, "has 0 inputs"},
      {Add{}, {0, 1}, "reads tensor 1, which is not computed before it"},
      {Add{}, {0, -1}, "reads tensor -1"},
      {Subsample2x{2, 0}, {0}, "begins with row 2"},
      {cbam(3, 1), {0}, "has 3 values, 2 are needed"},
      {even_kernel, {0}, "a kernel of 6 are no attention block"},
  };
  for (const auto& [operation, inputs, fault] : cases) {
    const Result<Network> network = one_node(operation, inputs);
    ASSERT_FALSE(network) << fault;
    EXPECT_EQ(network.error().code, ErrorCode::BadData);
    EXPECT_THAT(network.error().message, HasSubstr("file.onnx: node 'node 7' ("));
    EXPECT_THAT(network.error().message, HasSubstr(fault));
  }
}

TEST(Network, RefusesShapesThatDoNotMeet) {
  const std::vector<Node> nodes{{"half", MaxPool{2, 2, 0}, {0}}, {"sum", Add{}, {0, 1}}};
  const Result<Network> sum = Network::create("f", kInput, nodes, {2}, {});
  ASSERT_FALSE(sum);
  EXPECT_THAT(sum.error().message, HasSubstr("node 'sum' (Add): adds 2x2x3 to 2x4x6"));
  EXPECT_FALSE(Network::create("f", kInput, {nodes[0], {"join", Concat{}, {0, 1}}}, {2}, {}));
  EXPECT_FALSE(Network::create("f", kInput, {nodes[0], {"product", Multiply{}, {0, 1}}}, {2}, {}));
  EXPECT_FALSE(Network::create("f", {2, 5, 6}, {{"odd", SpaceToDepth{}, {0}}}, {1}, {}));
}

TEST(Network, RefusesImpossibleInputsAndOutputs) {
  const std::vector<Node> nodes{{"up", Upsample2x{}, {0}}};
  EXPECT_FALSE(Network::create("f", {0, 4, 6}, nodes, {1}, {}));
  EXPECT_FALSE(Network::create("f", {3, 1 << 15, 6}, nodes, {1}, {}));
  EXPECT_FALSE(Network::create("f", {1 << 10, 1 << 13, 1 << 13}, nodes, {1}, {}));
  EXPECT_FALSE(Network::create("f", {1, 1 << 14, 6}, nodes, {1}, {})) << "what it is enlarged to is too large";
  EXPECT_FALSE(Network::create("f", kInput, nodes, {}, {}));
  EXPECT_FALSE(Network::create("f", kInput, nodes, {0}, {}));
  EXPECT_FALSE(Network::create("f", kInput, nodes, {2}, {}));
}

TEST(Network, MetadataMustFitTheOutputs) {
  const std::vector<Node> nodes{{"head", convolution(2, 12, 2, 2, 0), {0}}};
  const NetworkMetadata good{"n", {"person"}, {2}, {{{1, 2}, {3, 4}}}};
  EXPECT_TRUE(Network::create("f", kInput, nodes, {1}, good));
  const auto fault = [&](const std::function<void(NetworkMetadata&)>& change) {
    NetworkMetadata metadata = good;
    change(metadata);
    const Result<Network> network = Network::create("f", kInput, nodes, {1}, metadata);
    return network ? std::string("none") : network.error().message;
  };
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.strides = {4}; }), HasSubstr("which stride 4 does not make of an input of 2x4x6"));
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.strides = {2, 4}; }), HasSubstr("2 strides and 1 lists of anchors for 1 outputs"));
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.anchors[0].pop_back(); }),
              HasSubstr("1 anchors of 1 boxes and 1 classes take 6 channels"));
  EXPECT_EQ(fault([](NetworkMetadata& m) { m.anchors[0].pop_back(), m.boxes_per_anchor = 2; }), "none");
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.boxes_per_anchor = 2; }),
              HasSubstr("2 anchors of 2 boxes and 1 classes take 24 channels"));
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.boxes_per_anchor = 3; }), HasSubstr("3 boxes an anchor; there may be 1 or 2"));
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.classes.clear(); }), HasSubstr("no classes"));
  EXPECT_THAT(fault([](NetworkMetadata& m) { m.anchors[0][1].width = -1; }), HasSubstr("an anchor of -1 x 4 pixels"));
}

TEST(Network, RangesMustBeOneForEachTensor) {
  Network network = one_node(Upsample2x{}).value();
  EXPECT_FALSE(network.set_ranges({{0, 1}}));
  EXPECT_FALSE(network.set_ranges({{0, 1}, {1, 1}}));
  EXPECT_FALSE(network.set_ranges({{0, 1}, {0, std::numeric_limits<float>::infinity()}}));
  EXPECT_TRUE(network.ranges().empty());
  EXPECT_TRUE(network.set_ranges({{0, 1}, {-1, 1}}));
  EXPECT_EQ(network.ranges().size(), 2U);
}

TEST(Network, TakesImagesOfAnotherSize) {
  const std::vector<Node> nodes{{"head", convolution(2, 12, 2, 2, 0), {0}}};
  Network network = Network::create("f", kInput, nodes, {1}, {"n", {"person"}, {2}, {{{1, 2}, {3, 4}}}}).value();
  ASSERT_TRUE(network.set_ranges({{0, 1}, {-1, 1}}));
  const Network larger = network.with_input(8, 10).value();
  EXPECT_EQ(larger.input(), (TensorShape{2, 10, 8}));
  EXPECT_EQ(larger.shapes()[1], (TensorShape{12, 5, 4}));
  EXPECT_EQ(larger.parameter_count(), network.parameter_count());
  EXPECT_EQ(larger.metadata().name, "n");
  ASSERT_EQ(larger.ranges().size(), 2U);
  EXPECT_EQ(larger.ranges()[1].low, -1);
}

TEST(Network, NamesASizeThatItCannotTake) {
  const std::vector<Node> nodes{{"head", convolution(2, 12, 2, 2, 0), {0}}};
  const Network network = Network::create("f", kInput, nodes, {1}, {"n", {"person"}, {2}, {{{1, 2}, {3, 4}}}}).value();
  const auto fault = [](const Result<Network>& resized) { return resized ? "none" : resized.error().message; };
  EXPECT_EQ(fault(network.with_input(8, 9)), "f: an input of 8x9: its sides must be multiples of 2");
  EXPECT_EQ(fault(network.with_input(0, 8)), "f: an input of 0x8: its sides must be multiples of 2");
  EXPECT_EQ(network.with_input(8, 9).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(fault(network.with_input(1 << 20, 8)),
            "f: the input: a tensor of 2x8x1048576 is empty or too large; so it is with an input of 1048576x8");
}

TEST(Network, CountsParametersAndWork) {
  const Network network = one_node(convolution(2, 5, 3, 2, 1)).value();
  EXPECT_EQ(network.parameter_count(), 5U * 2 * 9 + 5);
  EXPECT_EQ(network.multiply_accumulates(), 5U * 2 * 9 * 2 * 3);
}

}  // namespace
}  // namespace posed
