#include "detect/network_runner.h"

#include <algorithm>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "detect/network_passes.h"
#include "tests/unit/detect/engine_outputs.h"
#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

using ::testing::HasSubstr;

constexpr double kPyTorchTolerance = 1e-4;

/// Each reading is a millisecond later than the last.
class CountingClock final : public Clock {
 public:
  TimeNs now_ns() const noexcept override { return now_ns_ += kNsPerMs; }
  void sleep_until(TimeNs deadline_ns) const override { now_ns_ = deadline_ns; }
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return monotonic_ns; }

 private:
  mutable TimeNs now_ns_ = 0;
};

std::unique_ptr<NetworkRunner> small_runner(Precision precision) {
  const Network network = precision == Precision::Int8 ? test::calibrated_small_network() : test::small_network();
  auto runner = NetworkRunner::create(network, precision).value();
  test::fill_test_input(runner->input());
  return runner;
}

TEST(NetworkRunner, FloatsEqualPyTorch) {
  const auto runner = small_runner(Precision::Float32);
  const RunOutcome outcome = runner->run({}).value();
  EXPECT_TRUE(outcome.finished);
  EXPECT_EQ(outcome.steps_run, runner->step_count());
  ASSERT_EQ(runner->outputs().size(), 2U);
  EXPECT_EQ(runner->outputs()[0].dimensions, (std::vector<int>{1, 18, 16, 24}));
  EXPECT_EQ(runner->outputs()[1].dimensions, (std::vector<int>{1, 18, 8, 12}));
  const std::vector<float> values = test::all_outputs(*runner);
  const std::vector<float> expected = test::expected_outputs();
  ASSERT_EQ(values.size(), expected.size());
  EXPECT_LT(test::difference(values, expected).largest, kPyTorchTolerance);
}

TEST(NetworkRunner, RunsAtAnotherSizeOfTheInput) {
  const Network larger = test::small_network().with_input(192, 128).value();
  const auto runner = NetworkRunner::create(larger, Precision::Float32).value();
  EXPECT_EQ(runner->input_shape(), (TensorShape{3, 128, 192}));
  test::fill_test_input(runner->input());
  ASSERT_TRUE(runner->run(Deadline{}));
  EXPECT_EQ(runner->outputs()[1].dimensions, (std::vector<int>{1, 18, 16, 24}));
  const auto back = NetworkRunner::create(larger.with_input(96, 64).value(), Precision::Float32).value();
  test::fill_test_input(back->input());
  ASSERT_TRUE(back->run(Deadline{}));
  EXPECT_LT(test::difference(test::all_outputs(*back), test::expected_outputs()).largest, kPyTorchTolerance);
}

TEST(NetworkRunner, EightBitsAreCloseToFloats) {
  const auto runner = small_runner(Precision::Int8);
  ASSERT_TRUE(runner->run({})->finished);
  const test::Difference difference = test::difference(test::all_outputs(*runner), test::expected_outputs());
  EXPECT_LT(difference.relative, 0.05);
  EXPECT_GT(difference.relative, 1e-5) << "these are no eight bits";
}

TEST(NetworkRunner, RunsAgainAlikeAndKeepsItsInput) {
  for (const Precision precision : {Precision::Float32, Precision::Int8}) {
    const auto runner = small_runner(precision);
    const std::vector<float> input(runner->input().begin(), runner->input().end());
    ASSERT_TRUE(runner->run({}));
    const std::vector<float> first = test::all_outputs(*runner);
    ASSERT_TRUE(runner->run({}));
    EXPECT_EQ(test::all_outputs(*runner), first);
    EXPECT_TRUE(std::equal(input.begin(), input.end(), runner->input().begin()));
    std::fill(runner->input().begin(), runner->input().end(), 0.0F);
    ASSERT_TRUE(runner->run({}));
    EXPECT_NE(test::all_outputs(*runner), first);
  }
}

TEST(NetworkRunner, StopsAfterTheStepInWhichTheDeadlinePasses) {
  const auto runner = small_runner(Precision::Float32);
  ASSERT_TRUE(runner->run({}));
  const std::vector<float> before = test::all_outputs(*runner);
  for (const std::size_t steps : {std::size_t{0}, std::size_t{1}, std::size_t{17}, runner->step_count() - 1}) {
    // The clock reads 1 ms before the first step and a millisecond more after each.
    const CountingClock clock;
    const Deadline deadline{&clock, kNsPerMs * static_cast<TimeNs>(steps + 1)};
    const RunOutcome outcome = runner->run(deadline).value();
    EXPECT_FALSE(outcome.finished);
    EXPECT_EQ(outcome.steps_run, steps);
    EXPECT_EQ(outcome.elapsed_ns, kNsPerMs * static_cast<TimeNs>(steps));
    EXPECT_EQ(outcome.longest_step_ns, steps == 0 ? 0 : kNsPerMs);
  }
  // An abandoned run leaves nothing behind that a later one could trip over.
  ASSERT_TRUE(runner->run({})->finished);
  EXPECT_EQ(test::all_outputs(*runner), before);
}

TEST(NetworkRunner, FinishesWhereTheDeadlineIsNeverReached) {
  const auto runner = small_runner(Precision::Float32);
  const CountingClock clock;
  const Deadline deadline{&clock, kNsPerMs * static_cast<TimeNs>(runner->step_count() + 1)};
  EXPECT_TRUE(runner->run(deadline)->finished) << "the last step ended when the deadline came";
}

TEST(NetworkRunner, RemembersTheLongestStep) {
  const auto runner = small_runner(Precision::Float32);
  EXPECT_EQ(runner->longest_step_ns(), 0);
  const CountingClock clock;
  ASSERT_TRUE(runner->run({&clock, kNsPerSecond}));
  EXPECT_EQ(runner->longest_step_ns(), kNsPerMs);
  EXPECT_EQ(runner->step_duration_ns(3), kNsPerMs);
}

TEST(NetworkRunner, RunsOnSeveralThreadsAtOnce) {
  const auto expected = small_runner(Precision::Float32);
  ASSERT_TRUE(expected->run({}));
  const std::vector<float> values = test::all_outputs(*expected);
  std::vector<std::vector<float>> results(3);
  std::vector<std::thread> threads;
  for (std::vector<float>& result : results) {
    threads.emplace_back([&result] {
      const auto runner = small_runner(Precision::Float32);
      for (int run = 0; run < 3; ++run) {
        EXPECT_TRUE(runner->run({}));
      }
      result = test::all_outputs(*runner);
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  for (const std::vector<float>& result : results) {
    EXPECT_EQ(result, values);
  }
}

TEST(NetworkRunner, ObserverSeesEveryTensorOnce) {
  const auto runner = small_runner(Precision::Float32);
  const Network simple = simplify(test::small_network()).value();
  std::vector<int> seen;
  ASSERT_TRUE(runner->run_observed([&](int tensor, std::span<const float> values) {
    seen.push_back(tensor);
    EXPECT_EQ(values.size(), simple.shapes()[static_cast<std::size_t>(tensor)].size());
  }));
  ASSERT_EQ(seen.size(), simple.shapes().size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i], static_cast<int>(i));
  }
  EXPECT_FALSE(small_runner(Precision::Int8)->run_observed([](int, std::span<const float>) {}));
}

TEST(NetworkRunner, EightBitsNeedCalibration) {
  const auto runner = NetworkRunner::create(test::small_network(), Precision::Int8);
  ASSERT_FALSE(runner);
  EXPECT_EQ(runner.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(runner.error().message, HasSubstr("--calibrate"));
}

TEST(NetworkRunner, NamesTheNodeThatItCannotCompute) {
  const Network network = Network::create("net.onnx", {2, 4, 4}, {{"pool 3", GlobalPool{}, {0}}}, {1}, {}).value();
  const auto runner = NetworkRunner::create(network, Precision::Float32);
  ASSERT_FALSE(runner);
  EXPECT_EQ(runner.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(runner.error().message, HasSubstr("net.onnx: node 'pool 3' (GlobalPool)"));
}

/// A network whose output is also read, and whose input is read as it is: both unlike the shipped ones.
Network plain_network() {
  Convolution convolution;
  convolution.out_channels = 2;
  convolution.weights = {1, 0, 0, -1};
  convolution.bias = {0.25F, 0.5F};
  return Network::create("f", {2, 2, 2}, {{"c", convolution, {0}}, {"sum", Add{}, {1, 0}}, {"up", Upsample2x{}, {2}}}, {1, 3}, {})
      .value();
}

TEST(NetworkRunner, DeliversOutputsThatAreAlsoRead) {
  Network network = plain_network();
  ASSERT_TRUE(network.set_ranges({{0, 1}, {-1, 1.5F}, {0, 2}, {0, 2}}));
  const std::vector<float> input{0, 0.2F, 0.4F, 0.6F, 1, 0.8F, 0.6F, 0.2F};
  for (const Precision precision : {Precision::Float32, Precision::Int8}) {
    const auto runner = NetworkRunner::create(network, precision).value();
    std::copy(input.begin(), input.end(), runner->input().begin());
    ASSERT_TRUE(runner->run({})->finished);
    const float tolerance = precision == Precision::Int8 ? 0.015F : 1e-6F;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(runner->outputs()[0].values[i], input[i] + 0.25F, tolerance);
      EXPECT_NEAR(runner->outputs()[0].values[4 + i], 0.5F - input[4 + i], tolerance);
      const std::size_t enlarged = i / 2 * 8 + i % 2 * 2;  // of rows of four
      EXPECT_NEAR(runner->outputs()[1].values[enlarged + 5], 2 * input[i] + 0.25F, 2 * tolerance);
      EXPECT_NEAR(runner->outputs()[1].values[16 + enlarged], 0.5F, 2 * tolerance);
    }
  }
}

}  // namespace
}  // namespace posed
