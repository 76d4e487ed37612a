#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "detect/calibration.h"
#include "detect/network_passes.h"
#include "detect/network_runner.h"
#include "detect/quantization_plan.h"
#include "tests/unit/detect/engine_outputs.h"
#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

Convolution identity(int channels) {
  Convolution operation;
  operation.out_channels = channels;
  operation.groups = channels;
  operation.weights.assign(static_cast<std::size_t>(channels), 1.0F);
  operation.bias.assign(static_cast<std::size_t>(channels), 0.0F);
  return operation;
}

TEST(QuantizationPlan, CopiesShareOneQuantization) {
  const std::vector<Node> nodes{{"a", identity(2), {0}}, {"b", identity(2), {0}},    {"up", Upsample2x{}, {1}},
                                {"c", identity(2), {3}}, {"join", Concat{}, {1, 2}}, {"d", identity(4), {5}}};
  Network network = Network::create("f", {2, 4, 4}, nodes, {4, 6}, {}).value();
  ASSERT_TRUE(network.set_ranges({{0, 1}, {-1, 2}, {-4, 1}, {-1, 2}, {0, 8}, {-4, 2}, {0, 3}}));
  const std::vector<Quantization> plan = plan_quantization(network);
  for (const std::size_t tensor : {1U, 2U, 3U, 5U}) {
    EXPECT_FLOAT_EQ(plan[tensor].scale, 6.0F / 255) << tensor;
    EXPECT_EQ(plan[tensor].zero_point, 170) << tensor;
  }
  EXPECT_FLOAT_EQ(plan[4].scale, 8.0F / 255);
  EXPECT_EQ(plan[4].zero_point, 0);
}

TEST(QuantizationPlan, AlwaysHoldsZero) {
  Network network = Network::create("f", {2, 4, 4}, {{"a", identity(2), {0}}}, {1}, {}).value();
  ASSERT_TRUE(network.set_ranges({{0.5F, 1}, {-3, -1}}));
  const std::vector<Quantization> plan = plan_quantization(network);
  EXPECT_EQ(plan[0].zero_point, 0);
  EXPECT_FLOAT_EQ(plan[0].scale, 1.0F / 255);
  EXPECT_EQ(plan[1].zero_point, 255);
}

TEST(QuantizeWeights, EachChannelByItsLargest) {
  Convolution convolution;
  convolution.out_channels = 3;
  convolution.weights = {1, -2, 0.5F, 100, 0, 0};
  convolution.bias = {0, 0, 0};
  const QuantizedWeights quantized = quantize_weights(convolution);
  EXPECT_EQ(quantized.values, (std::vector<std::int8_t>{64, -127, 1, 127, 0, 0}));
  EXPECT_FLOAT_EQ(quantized.scales[0], 2.0F / 127);
  EXPECT_FLOAT_EQ(quantized.scales[1], 100.0F / 127);
  EXPECT_EQ(quantized.scales[2], 1.0F) << "a channel of zeros";
  EXPECT_EQ(quantize_weights(convolution, 64).values[1], -64);
}

TEST(Calibration, FindsTheRangesOfAllImages) {
  const Network network = Network::create("f", {2, 4, 4}, {{"a", identity(2), {0}}}, {1}, {}).value();
  const auto image = [](std::size_t index, std::span<float> input) {
    for (std::size_t i = 0; i < input.size(); ++i) {
      input[i] = index == 0 ? 0.5F : -static_cast<float>(i);
    }
    return Status{};
  };
  const Network calibrated = calibrate(network, 2, image, CalibrationMethod::MinMax).value();
  EXPECT_EQ(calibrated.ranges()[1].low, -31);
  EXPECT_EQ(calibrated.ranges()[1].high, 0.5F);
}

TEST(Calibration, LeastSquaresLeavesALonelyPeakOut) {
  const Network network = Network::create("f", {1, 256, 256}, {{"a", identity(1), {0}}}, {1}, {}).value();
  const auto image = [](std::size_t, std::span<float> input) {
    for (std::size_t i = 0; i < input.size(); ++i) {
      input[i] = static_cast<float>(i % 100) / 25.0F;
    }
    input[7] = 4.4F;
    return Status{};
  };
  EXPECT_EQ(calibrate(network, 1, image, CalibrationMethod::MinMax)->ranges()[1].high, 4.4F);
  const float high = calibrate(network, 1, image)->ranges()[1].high;
  EXPECT_LT(high, 4.2F);
  EXPECT_GT(high, 3.9F);
}

TEST(Calibration, AnImageKeepsItsExactSteps) {
  const Network calibrated = test::calibrated_small_network();
  EXPECT_EQ(calibrated.ranges()[0].low, 0);
  EXPECT_EQ(calibrated.ranges()[0].high, 1);
  EXPECT_EQ(calibrated.ranges().size(), calibrated.shapes().size());
}

TEST(Calibration, OfANetworkThatIsAlwaysZeroGivesARange) {
  Convolution zero = identity(2);
  zero.weights.assign(2, 0.0F);
  const Network network = Network::create("f", {2, 4, 4}, {{"a", zero, {0}}}, {1}, {}).value();
  const auto image = [](std::size_t, std::span<float> input) {
    test::fill_test_input(input);
    return Status{};
  };
  const Result<Network> calibrated = calibrate(network, 1, image);
  ASSERT_TRUE(calibrated) << calibrated.error().message;
  EXPECT_TRUE(NetworkRunner::create(*calibrated, Precision::Int8));
}

TEST(Calibration, RefusesWhatCannotBeCalibrated) {
  const auto image = [](std::size_t, std::span<float> input) {
    test::fill_test_input(input);
    return Status{};
  };
  EXPECT_EQ(calibrate(test::small_network(), 0, image).error().code, ErrorCode::InvalidArgument);
  const auto broken = [](std::size_t, std::span<float>) -> Status { return make_error(ErrorCode::BadData, "image 3 is broken"); };
  EXPECT_EQ(calibrate(test::small_network(), 1, broken).error().message, "image 3 is broken");
  const auto infinite = [](std::size_t, std::span<float> input) {
    std::fill(input.begin(), input.end(), std::numeric_limits<float>::infinity());
    return Status{};
  };
  EXPECT_FALSE(calibrate(test::small_network(), 1, infinite));
}

TEST(Calibration, BothMethodsServe) {
  for (const CalibrationMethod method : {CalibrationMethod::MinMax, CalibrationMethod::MeanSquaredError}) {
    const auto runner = NetworkRunner::create(test::calibrated_small_network(method), Precision::Int8).value();
    test::fill_test_input(runner->input(), 777);
    ASSERT_TRUE(runner->run({}));
    const std::vector<float> eight = test::all_outputs(*runner);
    const auto floats = NetworkRunner::create(test::small_network(), Precision::Float32).value();
    test::fill_test_input(floats->input(), 777);
    ASSERT_TRUE(floats->run({}));
    EXPECT_LT(test::difference(eight, test::all_outputs(*floats)).relative, 0.05);
  }
}

}  // namespace
}  // namespace posed
