#include "detect/opencv_network.h"

#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/manual_clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/detect/engine_outputs.h"
#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

using ::testing::HasSubstr;

TEST(OpenCvNetwork, EqualsPyTorch) {
  const auto engine = OpenCvNetwork::create(test::small_onnx_path()).value();
  EXPECT_EQ(engine->input_shape(), (TensorShape{3, 64, 96}));
  ASSERT_EQ(engine->outputs().size(), 2U);
  EXPECT_EQ(engine->outputs()[0].dimensions, (std::vector<int>{1, 18, 16, 24}));
  test::fill_test_input(engine->input());
  const RunOutcome outcome = engine->run({}).value();
  EXPECT_TRUE(outcome.finished);
  const std::vector<float> values = test::all_outputs(*engine);
  const std::vector<float> expected = test::expected_outputs();
  ASSERT_EQ(values.size(), expected.size());
  EXPECT_LT(test::difference(values, expected).largest, 1e-4);
}

TEST(OpenCvNetwork, BeginsNothingAfterTheDeadline) {
  const auto engine = OpenCvNetwork::create(test::small_onnx_path()).value();
  const ManualClock clock(100);
  const RunOutcome outcome = engine->run({&clock, 100}).value();
  EXPECT_FALSE(outcome.finished);
  EXPECT_EQ(outcome.steps_run, 0U);
  EXPECT_TRUE(engine->run({&clock, 101})->finished);
}

TEST(OpenCvNetwork, RefusesWhatIsNoNetwork) {
  const TemporaryFolder folder;
  const auto foreign = OpenCvNetwork::create(folder.write("foreign.onnx", "no network"));
  ASSERT_FALSE(foreign);
  EXPECT_THAT(foreign.error().message, HasSubstr("foreign.onnx"));
  const auto missing = OpenCvNetwork::create(folder / "missing.onnx");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace posed
