#include "detect/box_decoder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using testing::HasSubstr;

float logit(float p) {
  return std::log(p / (1 - p));
}

/// One output and its memory, all far below any threshold.
struct Output {
  explicit Output(std::vector<int> dimensions, float value = -20) {
    std::size_t size = 1;
    for (const int d : dimensions) {
      size *= static_cast<std::size_t>(d);
    }
    values.assign(size, value);
    output = {"output", std::move(dimensions), values};
  }
  std::vector<float> values;
  InferenceOutput output;
};

class AnchorDecoder : public testing::Test {
 protected:
  AnchorDecoder() {
    metadata.strides = {8, 16};
    metadata.anchors = {{{10, 20}, {30, 40}}, {{50, 60}, {70, 80}}};
  }

  /// Value `k` of anchor `a` in a cell of the first output.
  float& at(int a, int k, int row, int column) {
    return fine.values[static_cast<std::size_t>(((a * 6 + k) * 4 + row) * 8 + column)];
  }

  std::vector<InferenceOutput> outputs() const { return {fine.output, coarse.output}; }

  TensorShape input{3, 32, 64};
  NetworkMetadata metadata;
  Output fine{{1, 12, 4, 8}};
  Output coarse{{1, 12, 2, 4}};
};

TEST_F(AnchorDecoder, AZeroMeansTheMiddleOfTheCellAndTheAnchorsSize) {
  for (int k = 0; k < 4; ++k) {
    at(1, k, 2, 5) = 0;
  }
  at(1, 4, 2, 5) = logit(0.75F);
  const auto decoder = BoxDecoder::create(HeadKind::Anchors, input, outputs(), metadata, 0);
  ASSERT_TRUE(decoder) << decoder.error().message;
  std::vector<Candidate> found;
  decoder->decode(outputs(), 0.5F, found);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].detection.score, 0.75F, 1e-6F) << "with one class it is the objectness";
  EXPECT_NEAR(found[0].detection.box.x_min, 5.5F * 8 - 15, 1e-4F);
  EXPECT_NEAR(found[0].detection.box.x_max, 5.5F * 8 + 15, 1e-4F);
  EXPECT_NEAR(found[0].detection.box.y_min, 2.5F * 8 - 20, 1e-4F);
  EXPECT_NEAR(found[0].detection.box.y_max, 2.5F * 8 + 20, 1e-4F);
}

TEST_F(AnchorDecoder, SizesAreBoundedByFourTimesTheAnchor) {
  for (int k = 0; k < 4; ++k) {
    at(0, k, 0, 0) = 50;
  }
  at(0, 4, 0, 0) = 50;
  const auto decoder = BoxDecoder::create(HeadKind::Anchors, input, outputs(), metadata, 0);
  std::vector<Candidate> found;
  decoder->decode(outputs(), 0.5F, found);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].detection.box.x_max - found[0].detection.box.x_min, 40, 1e-3F);
  EXPECT_NEAR(found[0].detection.box.y_max - found[0].detection.box.y_min, 80, 1e-3F);
  EXPECT_NEAR(0.5F * (found[0].detection.box.x_max + found[0].detection.box.x_min), 1.5F * 8, 1e-3F)
      << "a centre reaches half a cell beyond its own";
}

TEST_F(AnchorDecoder, OfTwoBoxesTheSecondReachesTwiceAsFarAndHasThePlaceOfTheFirst) {
  metadata.boxes_per_anchor = 2;
  metadata.anchors = {{{10, 20}}, {{50, 60}}};
  for (int box = 0; box < 2; ++box) {
    at(box, 0, 1, 3) = 50;
    at(box, 1, 1, 3) = -50;
    at(box, 2, 1, 3) = at(box, 3, 1, 3) = 0;
    at(box, 4, 1, 3) = logit(box == 0 ? 0.75F : 0.25F);
  }
  const auto decoder = BoxDecoder::create(HeadKind::Anchors, input, outputs(), metadata, 0);
  ASSERT_TRUE(decoder) << decoder.error().message;
  std::vector<Candidate> found;
  decoder->decode(outputs(), 0.1F, found);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0].detection.score, 0.75F, 1e-6F);
  EXPECT_NEAR(found[0].detection.box.x_min, 4.5F * 8 - 5, 1e-3F);
  EXPECT_NEAR(found[0].detection.box.y_max, 0.5F * 8 + 10, 1e-3F);
  EXPECT_NEAR(found[1].detection.score, 0.25F, 1e-6F);
  EXPECT_NEAR(found[1].detection.box.x_min, 5.5F * 8 - 5, 1e-3F);
  EXPECT_NEAR(found[1].detection.box.y_max, -0.5F * 8 + 10, 1e-3F);
  EXPECT_EQ(found[0].place, found[1].place);
  for (int k = 0; k < 5; ++k) {
    at(0, k, 1, 4) = 3;  // the next column
  }
  for (int k = 0; k < 5; ++k) {
    coarse.values[static_cast<std::size_t>(8 * k + 5)] = 3;  // the same column and row of the next output
  }
  decoder->decode(outputs(), 0.1F, found);
  ASSERT_EQ(found.size(), 4U);
  std::set<std::size_t> places;
  for (const Candidate& c : found) {
    places.insert(c.place);
  }
  EXPECT_EQ(places.size(), 3U) << "no other box has that place";
}

TEST_F(AnchorDecoder, GarbageGivesNoBox) {
  std::fill(fine.values.begin(), fine.values.end(), std::numeric_limits<float>::quiet_NaN());
  std::fill(coarse.values.begin(), coarse.values.end(), std::numeric_limits<float>::infinity());
  const auto decoder = BoxDecoder::create(HeadKind::Anchors, input, outputs(), metadata, 0);
  std::vector<Candidate> found;
  decoder->decode(outputs(), 0.5F, found);
  for (const Candidate& c : found) {
    EXPECT_TRUE(std::isfinite(c.detection.box.area()));
    EXPECT_GE(c.detection.score, 0.5F);
  }
}

TEST_F(AnchorDecoder, RefusesWhatDoesNotFit) {
  NetworkMetadata without = metadata;
  without.anchors.pop_back();
  EXPECT_THAT(BoxDecoder::create(HeadKind::Anchors, input, outputs(), without, 0).error().message, HasSubstr("anchors for 1"));
  NetworkMetadata other = metadata;
  other.strides = {8, 8};
  EXPECT_THAT(BoxDecoder::create(HeadKind::Anchors, input, outputs(), other, 0).error().message, HasSubstr("output 1"));
  EXPECT_THAT(BoxDecoder::create(HeadKind::Anchors, input, outputs(), metadata, 1).error().message, HasSubstr("class 1"));
  EXPECT_FALSE(BoxDecoder::create(HeadKind::Boxes, input, outputs(), metadata, 0));
  for (const int boxes : {0, 3}) {
    metadata.boxes_per_anchor = boxes;
    EXPECT_FALSE(BoxDecoder::create(HeadKind::Anchors, input, outputs(), metadata, 0)) << boxes;
  }
}

TEST(RowDecoder, DecodedBoxesOfTheWantedClassAreTaken) {
  Output rows({1, 2, 7}, 0.0F);
  const std::vector<float> person{40, 30, 20, 10, 0.9F, 0.1F, 0.8F};
  const std::vector<float> chair{10, 10, 20, 10, 0.9F, 0.9F, 0.1F};
  std::copy(person.begin(), person.end(), rows.values.begin());
  std::copy(chair.begin(), chair.end(), rows.values.begin() + 7);
  const std::vector<InferenceOutput> outputs{rows.output};
  const auto decoder = BoxDecoder::create(HeadKind::Boxes, {3, 64, 64}, outputs, {}, 1);
  ASSERT_TRUE(decoder) << decoder.error().message;
  std::vector<Candidate> found;
  decoder->decode(outputs, 0.5F, found);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].detection.score, 0.72F, 1e-6F);
  EXPECT_EQ(found[0].detection.box, (BoundingBox{30, 25, 50, 35}));
}

TEST(RowDecoder, YoloxCellsFollowTheStrides) {
  // 32 x 32: 16 cells of stride 8, 4 of 16, 1 of 32.
  Output rows({1, 21, 6}, 0.0F);
  const auto set = [&](std::size_t row, float x, float y) {
    const std::vector<float> values{x, y, std::log(2.0F), 0, 1, 0.9F};
    std::copy(values.begin(), values.end(), rows.values.begin() + static_cast<std::ptrdiff_t>(6 * row));
  };
  set(6, 0.5F, 0.5F);    // stride 8, row 1, column 2
  set(19, 0.5F, 0.25F);  // stride 16, row 1, column 1
  set(20, 0, 0);         // stride 32
  const std::vector<InferenceOutput> outputs{rows.output};
  const auto decoder = BoxDecoder::create(HeadKind::Yolox, {3, 32, 32}, outputs, {}, 0);
  ASSERT_TRUE(decoder) << decoder.error().message;
  std::vector<Candidate> found;
  decoder->decode(outputs, 0.5F, found);
  ASSERT_EQ(found.size(), 3U);
  const auto centre = [](const Candidate& c) {
    const BoundingBox& box = c.detection.box;
    return std::pair{0.5F * (box.x_min + box.x_max), 0.5F * (box.y_min + box.y_max)};
  };
  EXPECT_EQ(centre(found[0]), std::pair(20.0F, 12.0F));
  EXPECT_EQ(centre(found[1]), std::pair(24.0F, 20.0F));
  EXPECT_EQ(centre(found[2]), std::pair(0.0F, 0.0F));
  EXPECT_NEAR(found[2].detection.box.x_max - found[2].detection.box.x_min, 64, 1e-3F);
  EXPECT_NEAR(found[2].detection.box.y_max - found[2].detection.box.y_min, 32, 1e-3F);
  EXPECT_FALSE(BoxDecoder::create(HeadKind::Yolox, {3, 32, 64}, outputs, {}, 0)) << "another number of cells";
}

TEST(SuppressOverlaps, KeepsTheMostConfidentOfThoseThatOverlap) {
  std::vector<Candidate> found{
      {{{0, 0, 10, 10}, 0.5F}, 0}, {{{1, 0, 11, 10}, 0.9F}, 1}, {{{30, 0, 40, 10}, 0.7F}, 2}, {{{5, 0, 15, 10}, 0.6F}, 3}};
  suppress_overlaps(found, 0.5F, 10);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_FLOAT_EQ(found[0].detection.score, 0.9F);
  EXPECT_FLOAT_EQ(found[1].detection.score, 0.7F);
  EXPECT_FLOAT_EQ(found[2].detection.score, 0.6F) << "overlaps by 6 of 14 only";
}

TEST(SuppressOverlaps, AnAnchorsTwoBoxesSpareEachOtherAndNobodyElse) {
  const Detection front{{0, 0, 10, 10}, 0.9F};
  const Detection behind{{2, 0, 12, 10}, 0.5F};
  const Detection again{{1, 0, 11, 10}, 0.7F};
  std::vector<Candidate> found{{behind, 7}, {again, 3}, {front, 7}};
  suppress_overlaps(found, 0.5F, 10);
  EXPECT_THAT(found, testing::ElementsAre(Candidate{front, 7}, Candidate{behind, 7}));
  found = {{behind, 2}, {again, 3}, {front, 7}};
  suppress_overlaps(found, 0.5F, 10);
  EXPECT_THAT(found, testing::ElementsAre(Candidate{front, 7}));
}

TEST(SuppressOverlaps, OutcomeDoesNotDependOnTheOrder) {
  std::vector<Candidate> found;
  for (int i = 0; i < 20; ++i) {
    const auto x = static_cast<float>(i * 7 % 20);
    found.push_back({{{x, 0, x + 10, 10}, 0.5F}, static_cast<std::size_t>(i)});
  }
  std::vector<Candidate> turned(found.rbegin(), found.rend());
  suppress_overlaps(found, 0.3F, 3);
  suppress_overlaps(turned, 0.3F, 3);
  EXPECT_EQ(found, turned);
  EXPECT_LE(found.size(), 3U);
  EXPECT_FALSE(found.empty());
}

}  // namespace
}  // namespace posed
