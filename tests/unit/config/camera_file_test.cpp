#include <cstdlib>
#include <ostream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "config/config_reference.h"
#include "core/pinhole_camera.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using testing::HasSubstr;

const std::string kCamera =
    "[camera]\nwidth = 640\nheight = 480\nfx = 500.0\nfy = 501\ncx = 320.0\ncy = 240.0\n"
    "distortion = [0.1, -0.2, 0.003, 0.004, 0.5]\ndepth_units_per_metre = 1000\nbaseline_fx = 40.0\n";

/// kCamera with `from` replaced.
std::string with(const std::string& from, const std::string& to) {
  std::string text = kCamera;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& text) {
  const Result<CameraIntrinsics> camera = parse_camera(text, "lens.toml");
  EXPECT_FALSE(camera);
  if (camera) {
    return "";
  }
  EXPECT_EQ(camera.error().code, ErrorCode::InvalidConfig);
  return camera.error().message;
}

class CameraFolders : public testing::Test {
 protected:
  void SetUp() override { unsetenv("POSED_CAMERA_PATH"); }
  void TearDown() override { unsetenv("POSED_CAMERA_PATH"); }
  TemporaryFolder folder_;
};

TEST(CameraFile, ReadsEveryKey) {
  const Result<CameraIntrinsics> camera = parse_camera(kCamera, "lens.toml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->width, 640);
  EXPECT_EQ(camera->height, 480);
  EXPECT_EQ(camera->fx, 500.0);
  EXPECT_EQ(camera->fy, 501.0);
  EXPECT_EQ(camera->cx, 320.0);
  EXPECT_EQ(camera->cy, 240.0);
  EXPECT_EQ(camera->k1, 0.1);
  EXPECT_EQ(camera->k2, -0.2);
  EXPECT_EQ(camera->p1, 0.003);
  EXPECT_EQ(camera->p2, 0.004);
  EXPECT_EQ(camera->k3, 0.5);
  EXPECT_EQ(camera->depth_units_per_metre, 1000.0);
  EXPECT_EQ(camera->baseline_fx, 40.0);
}

TEST(CameraFile, WrittenTextReadsBackTheSame) {
  const Result<CameraIntrinsics> camera = parse_camera(kCamera, "lens.toml");
  ASSERT_TRUE(camera);
  const Result<CameraIntrinsics> again = parse_camera(to_toml(*camera), "lens.toml");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(to_toml(*again), to_toml(*camera));
  EXPECT_EQ(again->k3, 0.5);
}

TEST(CameraFile, TheDepthsDelayMayBeGiven) {
  EXPECT_EQ(parse_camera(kCamera, "lens.toml")->depth_delay_s, 0.0);
  const Result<CameraIntrinsics> camera =
      parse_camera(with("baseline_fx = 40.0", "baseline_fx = 40.0\ndepth_delay_s = -0.016"), "lens.toml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->depth_delay_s, -0.016);
  EXPECT_EQ(error_of(with("baseline_fx = 40.0", "depth_delay_s = 1.0\nbaseline_fx = 40.0")),
            "lens.toml:10:17: camera.depth_delay_s: 1.0: out of range, allowed -0.2 to 0.2");
}

TEST(CameraFile, WithoutDistortionThereIsNone) {
  const Result<CameraIntrinsics> camera = parse_camera(with("distortion = [0.1, -0.2, 0.003, 0.004, 0.5]\n", ""), "lens.toml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->k1, 0.0);
  EXPECT_EQ(camera->k2, 0.0);
  EXPECT_EQ(camera->p1, 0.0);
  EXPECT_EQ(camera->p2, 0.0);
  EXPECT_EQ(camera->k3, 0.0);
}

TEST(CameraFile, AllButDistortionAndDelayAreRequired) {
  EXPECT_EQ(error_of(""),
            "lens.toml: camera.width: missing, expected integer, allowed 32 to 8192\n"
            "lens.toml: camera.height: missing, expected integer, allowed 32 to 8192\n"
            "lens.toml: camera.fx: missing, expected number, allowed 10.0 to 100000.0\n"
            "lens.toml: camera.fy: missing, expected number, allowed 10.0 to 100000.0\n"
            "lens.toml: camera.cx: missing, expected number, allowed 0.0 to 8192.0\n"
            "lens.toml: camera.cy: missing, expected number, allowed 0.0 to 8192.0\n"
            "lens.toml: camera.depth_units_per_metre: missing, expected number, allowed 1.0 to 1000000.0\n"
            "lens.toml: camera.baseline_fx: missing, expected number, allowed 0.1 to 10000.0");
}

TEST(CameraFile, RefusesWhatIsNotAllowed) {
  EXPECT_EQ(error_of(with("fx = 500.0", "fx = 0.0")), "lens.toml:4:6: camera.fx: 0.0: out of range, allowed 10.0 to 100000.0");
  EXPECT_EQ(error_of(with("fx = 500.0", "fx = 500.0\nfz = 1.0")),
            "lens.toml:5:1: camera.fz: 1.0: unknown key; did you mean camera.fx?");
  EXPECT_EQ(
      error_of(with("0.003, ", "")),
      "lens.toml:8:14: camera.distortion: [0.1, -0.2, 0.004, 0.5]: wrong length (4), expected array of 5 numbers, allowed each "
      "-10.0 to 10.0");
  EXPECT_EQ(error_of(with("0.003", "inf")),
            "lens.toml:8:26: camera.distortion: inf: element 3 of 5: not a finite number, allowed -10.0 to 10.0");
  EXPECT_EQ(
      error_of(with("0.003", "'x'")),
      "lens.toml:8:26: camera.distortion: \"x\": element 3 of 5: wrong type (string), expected number, allowed -10.0 to 10.0");
}

TEST(CameraFile, PrincipalPointIsInsideTheImage) {
  EXPECT_EQ(error_of(with("cx = 320.0", "cx = 639.5")), "lens.toml:6:6: camera.cx: 639.5: outside of the image, allowed 0 to 639");
  EXPECT_EQ(error_of(with("cy = 240.0", "cy = 480.0")), "lens.toml:7:6: camera.cy: 480.0: outside of the image, allowed 0 to 479");
}

TEST(CameraFile, LensModelMustBeInvertible) {
  EXPECT_THAT(error_of(with("0.1, -0.2, 0.003, 0.004, 0.5", "-2.0, 0.0, 0.0, 0.0, 0.0")),
              HasSubstr("lens.toml:8:14: camera.distortion: [-2.0, 0.0, 0.0, 0.0, 0.0]: the lens model folds back on itself"));
}

TEST_F(CameraFolders, AreSearchedInOrder) {
  setenv("POSED_CAMERA_PATH", "/first::/second:", 1);
  const std::vector<std::filesystem::path> folders = calibration_folders();
  ASSERT_EQ(folders.size(), 4U);
  EXPECT_EQ(folders[0], "/first");
  EXPECT_EQ(folders[1], "/second");
  EXPECT_EQ(folders[2], std::filesystem::path(POSED_SOURCE_DIR) / "config" / "cameras");
  EXPECT_THAT(folders[3].string(), testing::EndsWith("/posed/cameras"));
}

TEST_F(CameraFolders, EnvironmentComesBeforeTheShippedOnes) {
  folder_.write("synthetic.toml", kCamera);
  setenv("POSED_CAMERA_PATH", folder_.path().c_str(), 1);
  const Result<CameraIntrinsics> camera = load_camera("synthetic.toml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->fx, 500.0);
}

TEST_F(CameraFolders, MissingFileSaysWhereItWasLookedFor) {
  const Result<CameraIntrinsics> camera = load_camera("no_such_lens.toml");
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::Io);
  EXPECT_THAT(camera.error().message,
              testing::StartsWith(
                  "no_such_lens.toml: cannot be read: there is no such file; looked for no_such_lens.toml, " POSED_SOURCE_DIR
                  "/config/cameras/no_such_lens.toml, "));
  const std::filesystem::path absolute = folder_.path() / "absent.toml";
  EXPECT_EQ(load_camera(absolute).error().message, absolute.string() + ": cannot be read: there is no such file");
}

TEST_F(CameraFolders, MessagesNameTheFileThatWasFound) {
  const std::filesystem::path file = folder_.write("lens.toml", "[camera]\nwidth = 1\n");
  const Result<CameraIntrinsics> camera = load_camera(file);
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().message, HasSubstr(file.string() + ":2:9: camera.width: 1: out of range, allowed 32 to 8192"));
}

struct Shipped {
  const char* name;
  int width, height;
  double fx, fy, cx, cy, k1, k2, p1, p2, k3, baseline_fx;
};

void PrintTo(const Shipped& camera, std::ostream* out) {
  *out << camera.name;
}

class ShippedCamera : public testing::TestWithParam<Shipped> {};

TEST_P(ShippedCamera, HoldsThePublishedCalibration) {
  const Shipped& expected = GetParam();
  const Result<CameraIntrinsics> k = load_camera(std::filesystem::path(POSED_SOURCE_DIR) / "config" / "cameras" / expected.name);
  ASSERT_TRUE(k) << k.error().message;
  EXPECT_EQ(k->width, expected.width);
  EXPECT_EQ(k->height, expected.height);
  EXPECT_EQ(k->fx, expected.fx);
  EXPECT_EQ(k->fy, expected.fy);
  EXPECT_EQ(k->cx, expected.cx);
  EXPECT_EQ(k->cy, expected.cy);
  EXPECT_EQ(k->k1, expected.k1);
  EXPECT_EQ(k->k2, expected.k2);
  EXPECT_EQ(k->p1, expected.p1);
  EXPECT_EQ(k->p2, expected.p2);
  EXPECT_EQ(k->k3, expected.k3);
  EXPECT_EQ(k->depth_units_per_metre, 5000.0);
  EXPECT_EQ(k->baseline_fx, expected.baseline_fx);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedCamera,
                         testing::Values(Shipped{"tum_fr1.toml", 640, 480, 517.306408, 516.469215, 318.643040, 255.313989, 0.262383,
                                                 -0.953104, -0.005358, 0.002628, 1.163314, 40.0},
                                         Shipped{"tum_fr2.toml", 640, 480, 520.908620, 521.007327, 325.141442, 249.701764, 0.231222,
                                                 -0.784899, -0.003257, -0.000105, 0.917205, 40.0},
                                         Shipped{"tum_fr3.toml", 640, 480, 535.4, 539.2, 320.1, 247.6, 0, 0, 0, 0, 0, 40.0},
                                         Shipped{"primesense_default.toml", 640, 480, 525.0, 525.0, 319.5, 239.5, 0, 0, 0, 0, 0,
                                                 40.0},
                                         Shipped{"synthetic.toml", 320, 240, 262.5, 262.5, 159.5, 119.5, 0, 0, 0, 0, 0, 20.0},
                                         Shipped{"synthetic_vga.toml", 640, 480, 525.0, 525.0, 319.5, 239.5, 0, 0, 0, 0, 0, 40.0}),
                         [](const testing::TestParamInfo<Shipped>& shipped) {
                           const std::string name = shipped.param.name;
                           return name.substr(0, name.find('.'));
                         });

}  // namespace
}  // namespace posed
