#include "detect/network_passes.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

std::map<std::string, int> kinds(const Network& network) {
  std::map<std::string, int> count;
  for (const Node& node : network.nodes()) {
    ++count[std::string(to_string(node.operation))];
  }
  return count;
}

Convolution pointwise(int in_channels, int out_channels, std::vector<float> bias) {
  Convolution operation;
  operation.out_channels = out_channels;
  operation.weights.assign(static_cast<std::size_t>(in_channels * out_channels), 2.0F);
  operation.bias = std::move(bias);
  return operation;
}

TEST(Simplify, LeavesOnlyWhatTheRunnerComputes) {
  const Network simple = simplify(test::small_network()).value();
  const std::map<std::string, int> expected{{"Add", 3},     {"Cbam", 2},         {"Concat", 11},   {"Convolution", 29},
                                            {"MaxPool", 3}, {"SpaceToDepth", 1}, {"Upsample2x", 1}};
  EXPECT_EQ(kinds(simple), expected);
  EXPECT_EQ(simple.metadata().name, "small test network");
  EXPECT_EQ(simple.outputs().size(), 2U);
}

TEST(Simplify, TwiceIsOnceAndKeepsRanges) {
  Network simple = simplify(test::small_network()).value();
  ASSERT_TRUE(simple.set_ranges(std::vector<ValueRange>(simple.shapes().size(), {-1, 2})));
  const Network again = simplify(simple).value();
  EXPECT_EQ(kinds(again), kinds(simple));
  EXPECT_EQ(again.ranges().size(), simple.ranges().size());
}

TEST(Simplify, ForgetsRangesOfTensorsThatItRenumbers) {
  Network network = test::small_network();
  ASSERT_TRUE(network.set_ranges(std::vector<ValueRange>(network.shapes().size(), {-1, 2})));
  EXPECT_TRUE(simplify(network)->ranges().empty());
}

TEST(Simplify, FoldsChannelFactorsIntoTheConvolution) {
  const Network network =
      Network::create("f", {1, 2, 2}, {{"c", pointwise(1, 2, {1, 3}), {0}}, {"n", ChannelAffine{{10, 100}, {5, 7}}, {1}}}, {2}, {})
          .value();
  const Network simple = simplify(network).value();
  ASSERT_EQ(simple.nodes().size(), 1U);
  const auto& convolution = std::get<Convolution>(simple.nodes()[0].operation);
  EXPECT_EQ(convolution.weights, (std::vector<float>{20, 200}));
  EXPECT_EQ(convolution.bias, (std::vector<float>{15, 307}));
}

TEST(Simplify, KeepsAConvolutionThatOthersReadToo) {
  // The convolution's plain output is an output of the network, so the activation after it must stay a node of its own.
  const Network network =
      Network::create("f", {1, 2, 2}, {{"c", pointwise(1, 1, {0}), {0}}, {"a", Activate{Activation::Relu}, {1}}}, {1, 2}, {})
          .value();
  EXPECT_EQ(kinds(simplify(network).value()), (std::map<std::string, int>{{"Activate", 1}, {"Convolution", 1}}));
}

TEST(Simplify, RecognisesSiluInEitherOrder) {
  for (const std::vector<int>& factors : {std::vector<int>{1, 2}, std::vector<int>{2, 1}}) {
    const Network network =
        Network::create("f", {1, 2, 2},
                        {{"c", pointwise(1, 1, {0}), {0}}, {"s", Activate{Activation::Sigmoid}, {1}}, {"m", Multiply{}, factors}},
                        {3}, {})
            .value();
    const Network simple = simplify(network).value();
    ASSERT_EQ(simple.nodes().size(), 1U);
    EXPECT_EQ(std::get<Convolution>(simple.nodes()[0].operation).activation, Activation::Silu);
  }
}

TEST(Simplify, TakesSlicesInAnotherOrderForWhatTheyAre) {
  std::vector<Node> nodes;
  for (const auto& [row, column] : {std::pair(0, 0), std::pair(0, 1), std::pair(1, 0), std::pair(1, 1)}) {
    nodes.push_back({"slice", Subsample2x{row, column}, {0}});
  }
  nodes.push_back({"join", Concat{}, {1, 2, 3, 4}});
  EXPECT_EQ(kinds(simplify(Network::create("f", {3, 4, 4}, nodes, {5}, {}).value()).value()).count("SpaceToDepth"), 0U);
  nodes[4].inputs = {1, 3, 2, 4};
  EXPECT_EQ(kinds(simplify(Network::create("f", {3, 4, 4}, nodes, {5}, {}).value()).value()).at("SpaceToDepth"), 1);
}

TEST(Simplify, RemovesWhatNoOutputNeeds) {
  const Network network =
      Network::create("f", {1, 2, 2}, {{"unread", Upsample2x{}, {0}}, {"c", pointwise(1, 1, {0}), {0}}}, {2}, {}).value();
  const Network simple = simplify(network).value();
  ASSERT_EQ(simple.nodes().size(), 1U);
  EXPECT_EQ(simple.nodes()[0].name, "c");
  EXPECT_EQ(simple.outputs(), std::vector<int>{1});
}

TEST(Simplify, AttentionWithTwoPerceptronsIsNoCbam) {
  // The second branch's weights differ, so one shared perceptron cannot stand for both.
  Network network = test::small_network();
  std::vector<Node> nodes = network.nodes();
  int changed = 0;
  for (std::size_t i = 0; i < nodes.size() && changed == 0; ++i) {
    const auto* pool = std::get_if<GlobalPool>(&nodes[i].operation);
    if (pool != nullptr && pool->reduction == Reduction::Max) {
      const auto reader = std::find_if(nodes.begin(), nodes.end(),
                                       [&](const Node& node) { return node.inputs == std::vector<int>{static_cast<int>(i) + 1}; });
      std::get<Convolution>(reader->operation).weights[0] += 1;
      ++changed;
    }
  }
  ASSERT_EQ(changed, 1);
  const Network other = Network::create("f", network.input(), nodes, network.outputs(), network.metadata()).value();
  EXPECT_EQ(kinds(simplify(other).value()).at("Cbam"), 1);
}

}  // namespace
}  // namespace posed
