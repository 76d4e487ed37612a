#include "detect/person_detector.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "detect/network_file.h"
#include "tests/support/manual_clock.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using testing::HasSubstr;

constexpr int kCell = 32;
constexpr int kWidth = 3 * kCell;
constexpr int kHeight = 2 * kCell;
constexpr TimeNs kFrame = 33 * kNsPerMs;
constexpr float kSteepness = 9;  // of a score's logit, from black to white

/// For each cell of the image a box of its own size, the surer the brighter the cell: its logit is 0 where that is
/// half as bright as white.
Network brightness_detector() {
  constexpr int kValues = 6;  // x, y, width, height, objectness, class
  constexpr std::size_t kPixels = 3 * kCell * kCell;
  Convolution convolution;
  convolution.out_channels = kValues;
  convolution.kernel = kCell;
  convolution.stride = kCell;
  convolution.weights.resize(kValues * kPixels);
  std::fill_n(convolution.weights.begin() + 4 * kPixels, kPixels, kSteepness / kPixels);
  convolution.bias = {0, 0, 0, 0, -kSteepness / 2, 0};
  NetworkMetadata metadata;
  metadata.name = "brightness";
  metadata.classes = {"person"};
  metadata.strides = {kCell};
  metadata.anchors = {{{kCell, kCell}}};
  return Network::create("brightness", {3, kHeight, kWidth}, {{"head", convolution, {0}}}, {1}, metadata).value();
}

/// A detector of bright cells, and an image whose cells are as bright as a test says.
class PersonDetectorTest : public testing::Test {
 protected:
  PersonDetectorTest() {
    const std::string file = folder / "brightness.posednet";
    EXPECT_TRUE(write_network(brightness_detector(), WeightFormat::Float32, file));
    config.models = {file};
    frame.stamp_utc_ns = 1'700'000'000 * kNsPerSecond;
    frame.bgr = {pixels.data(), kWidth, kHeight, 3L * kWidth, 3};
  }

  void make(double memory_s) {
    config.memory_s = memory_s;
    config.score = 0.4;
    detector = std::move(PersonDetector::create(config, kWidth, kHeight, clock).value());
  }

  /// What is found in the next frame, where a cell of column 0 to 2 in the upper row is so bright that its score is as given.
  std::vector<Detection> look(int column, float score) {
    std::fill(pixels.begin(), pixels.end(), std::uint8_t{0});
    const float brightness = 0.5F + std::log(score / (1 - score)) / kSteepness;
    for (int row = 0; row < kCell; ++row) {
      std::fill_n(pixels.begin() + 3 * (row * kWidth + column * kCell), 3 * kCell,
                  static_cast<std::uint8_t>(std::lround(255 * brightness)));
    }
    ++frame.sequence;
    frame.stamp_utc_ns += kFrame;
    Detections found;
    EXPECT_TRUE(detector->detect_unhurried(frame, 0, found)->finished);
    EXPECT_EQ(found.stamp_utc_ns, frame.stamp_utc_ns);
    return {found.found().begin(), found.found().end()};
  }

  TemporaryFolder folder;
  ManualClock clock;
  DetectorConfig config;
  std::unique_ptr<PersonDetector> detector;
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(kWidth * kHeight * 3);
  RgbdFrame frame;
};

TEST_F(PersonDetectorTest, ReportsAnUnsureBoxOfWhoWasSurelySeen) {
  make(1.0);
  ASSERT_EQ(look(1, 0.9F).size(), 1U);
  const std::vector<Detection> found = look(1, 0.25F);  // too little by itself
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].score, 0.6F, 0.03F);
  EXPECT_NEAR(found[0].box.x_min, kCell - 0.5F, 0.01F);
}

TEST_F(PersonDetectorTest, ReportsNoUnsureBoxOfWhoWasNot) {
  make(1.0);
  EXPECT_TRUE(look(1, 0.25F).empty());
  ASSERT_EQ(look(1, 0.9F).size(), 1U);
  EXPECT_TRUE(look(2, 0.25F).empty()) << "there nobody was";
}

TEST_F(PersonDetectorTest, WithoutAMemoryEachImageIsByItself) {
  make(0.0);
  ASSERT_EQ(look(1, 0.9F).size(), 1U);
  EXPECT_TRUE(look(1, 0.25F).empty());
}

TEST_F(PersonDetectorTest, AFrameThatIsGivenUpSaysNothingAndLeavesTheMemoryAsItWas) {
  config.budget_s = 0;  // spent before the first step
  make(1.0);
  ASSERT_EQ(look(1, 0.9F).size(), 1U);
  for (int given_up = 0; given_up < 6; ++given_up) {  // had they shown nobody, the person would be forgotten
    frame.stamp_utc_ns += kFrame;
    Detections found;
    const auto outcome = detector->detect(frame, found);
    ASSERT_TRUE(outcome);
    EXPECT_FALSE(outcome->finished);
    EXPECT_EQ(found.count, 0U);
  }
  EXPECT_EQ(look(1, 0.25F).size(), 1U);
}

/// Each time somebody looks at it, it is a millisecond later.
class TickingClock final : public Clock {
 public:
  TimeNs now_ns() const noexcept override { return ticks_++ * kNsPerMs; }
  void sleep_until(TimeNs) const override {}
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return monotonic_ns; }

 private:
  mutable std::atomic<TimeNs> ticks_ = 0;
};

TEST_F(PersonDetectorTest, ABudgetThatIsSpentBetweenTwoSizesCutsTheLookShort) {
  config.models.front() += "@96x64+192x128";
  config.memory_s = 0;
  const TickingClock ticking;
  enum Fate { kGivenUp, kCutShort, kFinished };
  std::vector<Fate> fates;
  std::fill(pixels.begin(), pixels.end(), std::uint8_t{255});
  for (int budget_ms = 1; budget_ms < 40; ++budget_ms) {
    config.budget_s = 1e-3 * budget_ms;
    detector = std::move(PersonDetector::create(config, kWidth, kHeight, ticking).value());
    Detections found;
    const auto outcome = detector->detect(frame, found);
    ASSERT_TRUE(outcome);
    EXPECT_EQ(outcome->finished, found.count > 0);
    fates.push_back(!outcome->finished ? kGivenUp : outcome->cut_short ? kCutShort : kFinished);
  }
  EXPECT_TRUE(std::is_sorted(fates.begin(), fates.end()));
  EXPECT_THAT(fates, testing::IsSupersetOf({kGivenUp, kCutShort, kFinished}));
}

TEST_F(PersonDetectorTest, NamesTheModelThatIsMissing) {
  config.models = {folder / "nobody.posednet"};
  const auto refused = PersonDetector::create(config, kWidth, kHeight, clock);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidConfig);
  EXPECT_THAT(refused.error().message, HasSubstr("detector.models: "));
  EXPECT_THAT(refused.error().message, HasSubstr("nobody.posednet"));
}

}  // namespace
}  // namespace posed
