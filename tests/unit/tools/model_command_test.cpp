#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/image_writer.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/tools/posectl_outcome.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/model_bench.h"

namespace posed {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kSmallOnnx = POSED_SOURCE_DIR "/tests/unit/detect/data/small.onnx";

Outcome model(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "model");
  return posectl(std::move(arguments));
}

/// A photograph of nothing: a gradient.
std::string write_image(const TemporaryFolder& folder) {
  constexpr int kWidth = 120;
  constexpr int kHeight = 90;
  std::vector<std::uint8_t> bgr(3 * kWidth * kHeight);
  for (std::size_t i = 0; i < bgr.size(); ++i) {
    bgr[i] = static_cast<std::uint8_t>(i * 7 / 3);
  }
  const std::string path = folder / "image.png";
  const Status written = write_png_bgr8(path, {bgr.data(), kWidth, kHeight, 3 * kWidth, 3});
  EXPECT_TRUE(written) << written.error().message;
  return path;
}

TEST(ModelCommand, InfoTellsWhatAFileHolds) {
  const Outcome outcome = model({"info", kSmallOnnx});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("small test network"), HasSubstr("input: 3x64x96"), HasSubstr("classes: person"),
                                 HasSubstr("output 1: 18x8x12, stride 8, anchors 20x44 34x60 60x62"),
                                 HasSubstr("50 when simplified"), HasSubstr("calibrated for 8 bits: no")));
}

TEST(ModelCommand, ConvertsAndCalibrates) {
  const TemporaryFolder folder;
  const std::string to = folder / "small.posednet";
  const Outcome outcome = model({"convert", kSmallOnnx, to, "--weights", "int8", "--calibrate", write_image(folder)});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("calibrated for 8 bits"));
  EXPECT_THAT(outcome.err, HasSubstr("calibrate"));
  const Outcome info = model({"info", to});
  EXPECT_THAT(info.out, AllOf(HasSubstr("small test network"), HasSubstr("calibrated for 8 bits: yes")));
  // Its own file converts again, as it is.
  EXPECT_EQ(model({"convert", to, folder / "again.posednet"}).exit_code, kExitOk);
}

TEST(ModelCommand, NamesWhatItCannotRead) {
  const TemporaryFolder folder;
  const Outcome missing = model({"info", folder / "missing.onnx"});
  EXPECT_EQ(missing.exit_code, kExitNoInput);
  EXPECT_THAT(missing.err, HasSubstr("missing.onnx"));
  EXPECT_EQ(model({"info", folder.write("foreign.onnx", "nothing")}).exit_code, kExitBadData);
  EXPECT_EQ(model({"convert", kSmallOnnx, folder / "no/such/folder.posednet"}).exit_code, kExitIo);
  const Outcome image = model({"convert", kSmallOnnx, folder / "n", "--calibrate", folder.write("image.png", "no image").string()});
  EXPECT_EQ(image.exit_code, kExitBadData);
  EXPECT_THAT(image.err, HasSubstr("image.png"));
  EXPECT_EQ(model({}).exit_code, kExitUsage);
  EXPECT_EQ(model({"convert", kSmallOnnx, folder / "n", "--weights", "int4"}).exit_code, kExitUsage);
}

TEST(ModelCommand, BenchTimesEveryEngine) {
  const TemporaryFolder folder;
  const std::string own = folder / "small.posednet";
  ASSERT_EQ(model({"convert", kSmallOnnx, own, "--calibrate", write_image(folder), "--quiet"}).exit_code, kExitOk);
  const Outcome outcome = model({"bench", own, kSmallOnnx, "--against-opencv", "--runs", "3", "--steps"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("small.posednet, posed f32"), HasSubstr("small.posednet, posed int8"),
                                 HasSubstr("small.onnx, posed f32"), HasSubstr("small.onnx, OpenCV DNN"), HasSubstr("SpaceToDepth"),
                                 Not(HasSubstr("small.onnx, posed int8"))));
}

TEST(ModelCommand, TakesAnotherInputThanTheFiles) {
  const TemporaryFolder folder;
  const Outcome info = model({"info", kSmallOnnx + "@192x128"});
  EXPECT_EQ(info.exit_code, kExitOk) << info.err;
  EXPECT_THAT(info.out, AllOf(HasSubstr("input: 3x128x192"), HasSubstr("output 1: 18x16x24, stride 8")));
  ASSERT_EQ(model({"convert", kSmallOnnx + "@48x32", folder / "small.posednet"}).exit_code, kExitOk);
  EXPECT_THAT(model({"info", folder / "small.posednet"}).out, HasSubstr("input: 3x32x48"));
  const Outcome bench = model({"bench", kSmallOnnx, kSmallOnnx + "@48x32", "--against-opencv", "--runs", "1"});
  EXPECT_EQ(bench.exit_code, kExitOk) << bench.err;
  EXPECT_THAT(bench.out, AllOf(HasSubstr("small.onnx, OpenCV DNN"), HasSubstr("small.onnx@48x32, posed f32"),
                               Not(HasSubstr("small.onnx@48x32, OpenCV"))));
  const Outcome odd = model({"info", kSmallOnnx + "@50x32"});
  EXPECT_EQ(odd.exit_code, kExitUsage);
  EXPECT_THAT(odd.err, HasSubstr("small.onnx: an input of 50x32: its sides must be multiples of 8"));
}

TEST(ModelCommand, BenchOfEightBitsNeedsCalibration) {
  const Outcome outcome = model({"bench", kSmallOnnx, "--precision", "int8", "--runs", "1"});
  EXPECT_EQ(outcome.exit_code, kExitUnavailable);
  EXPECT_THAT(outcome.err, HasSubstr("--calibrate"));
}

TEST(ModelBench, QuantilesAreDurationsThatOccurred) {
  EXPECT_EQ(quantile_ns({5, 1, 3, 2, 4}, 0.5), 3);
  EXPECT_EQ(quantile_ns({5, 1, 3, 2, 4}, 0), 1);
  EXPECT_EQ(quantile_ns({5, 1, 3, 2, 4}, 0.99), 5);
  EXPECT_EQ(quantile_ns({7}, 0.5), 7);
}

}  // namespace
}  // namespace posed
