#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/image_writer.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/tools/posectl_outcome.h"
#include "tools/posectl/color_image.h"
#include "tools/posectl/exit_code.h"

namespace posed {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Untrained: it sees people everywhere, so a low threshold gives boxes and a high one none.
const std::string kSmallOnnx = std::string(POSED_SOURCE_DIR) + "/tests/unit/detect/data/small.onnx";

Outcome detect(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "detect");
  return posectl(std::move(arguments));
}

class DetectCommand : public testing::Test {
 protected:
  DetectCommand() {
    std::vector<std::uint8_t> pixels(96 * 64 * 3);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = static_cast<std::uint8_t>(i * 31 % 251);
    }
    image = folder / "one.png";
    EXPECT_TRUE(write_png_bgr8(image, {pixels.data(), 96, 64, 96 * 3, 3}));
    EXPECT_TRUE(write_png_bgr8(folder / "two.png", {pixels.data(), 64, 64, 96 * 3, 3}));
  }

  static std::string read(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  TemporaryFolder folder;
  std::string image;
};

TEST_F(DetectCommand, WritesLinesOfNameScoreAndBox) {
  const std::string csv = folder / "boxes.txt";
  const Outcome outcome = detect({"--model", kSmallOnnx, "--score", "0.01", "--csv", csv, "--quiet", folder / ""});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("in 2 images, by small.onnx (posed f32)"));
  std::istringstream lines(read(csv));
  std::string name;
  double score = 0;
  double x0 = 0;
  double y0 = 0;
  double x1 = 0;
  double y1 = 0;
  int count = 0;
  while (lines >> name >> score >> x0 >> y0 >> x1 >> y1) {
    ++count;
    EXPECT_TRUE(name == "one" || name == "two") << name;
    EXPECT_GE(score, 0.01);
    EXPECT_LT(x0, x1);
    EXPECT_LT(y0, y1);
    EXPECT_GE(x0, -0.5);
    EXPECT_LE(x1, name == "one" ? 95.5 : 63.5) << "cut to the image";
  }
  EXPECT_GT(count, 0);
  EXPECT_TRUE(lines.eof());
}

TEST_F(DetectCommand, LooksAtAnotherSizeOfTheImage) {
  const Outcome outcome = detect({"--model", kSmallOnnx + "@48x32", "--score", "0.01", "--quiet", image});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("in 1 images, by small.onnx@48x32 (posed f32)"));
  std::ofstream(folder / "posed.toml") << "[detector]\nengine = \"opencv\"\nhead = \"boxes\"\nmodels = [\"" << kSmallOnnx
                                       << "@48x32\"]\n";
  const Outcome opencv = detect({"--config", folder / "posed.toml", image});
  EXPECT_NE(opencv.exit_code, kExitOk);
  EXPECT_THAT(opencv.err, HasSubstr("small.onnx@48x32: OpenCV takes networks at the size of their file"));
}

TEST_F(DetectCommand, PrintsATableAndDrawsCopies) {
  const std::string drawn = folder / "drawn";
  const Outcome outcome = detect({"--model", kSmallOnnx, "--score", "0.01", "--draw", drawn, "--quiet", image});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("x_min"), HasSubstr("one ")));
  ColorImage copy;
  ASSERT_TRUE(copy.read(drawn + "/one.png"));
  int green = 0;
  for (int y = 0; y < copy.bgr().height; ++y) {
    for (int x = 0; x < copy.bgr().width; ++x) {
      const std::uint8_t* p = &copy.bgr().at(x, y);
      green += p[0] == 0 && p[1] == 255 && p[2] == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(green, 20);
}

TEST_F(DetectCommand, ReportsABadImageAndLooksAtTheOthers) {
  std::ofstream(folder / "bad.jpg") << "no image";
  const Outcome outcome = detect({"--model", kSmallOnnx, "--quiet", folder / "bad.jpg", image});
  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_THAT(outcome.err, HasSubstr("bad.jpg"));
  EXPECT_THAT(outcome.out, HasSubstr("in 2 images"));
}

TEST_F(DetectCommand, NamesWhatIsMissing) {
  EXPECT_THAT(detect({"--model", folder / "none.onnx", image}).err, HasSubstr("none.onnx"));
  EXPECT_EQ(detect({"--model", folder / "none.onnx", image}).exit_code, kExitNoInput);
  EXPECT_EQ(detect({"--model", kSmallOnnx, folder / "none.png"}).exit_code, kExitNoInput);
  EXPECT_EQ(detect({"--model", kSmallOnnx, "--csv", folder / "no/where.txt", image}).exit_code, kExitIo);
  EXPECT_EQ(detect({"--model", kSmallOnnx, "--score", "2", image}).exit_code, kExitUsage);
  EXPECT_EQ(detect({}).exit_code, kExitUsage);
  std::filesystem::create_directory(folder / "empty");
  EXPECT_THAT(detect({"--model", kSmallOnnx, folder / "empty"}).err,
              AllOf(HasSubstr("empty"), HasSubstr("no image"), Not(HasSubstr("terminate"))));
}

}  // namespace
}  // namespace posed
