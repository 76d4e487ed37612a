#include "config/config_loader.h"

#include <cstdlib>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class ConfigLoader : public testing::Test {
 protected:
  void SetUp() override { unsetenv("POSED_CAMERA_PATH"); }
  TemporaryFolder folder_;
};

std::string error_of(const std::string& text) {
  const Result<Config> config = parse_config(text, "posed.toml");
  EXPECT_FALSE(config) << text;
  if (config) {
    return "";
  }
  EXPECT_EQ(config.error().code, ErrorCode::InvalidConfig);
  return config.error().message;
}

TEST_F(ConfigLoader, FindsAModelWhateverSizeItIsToLookAt) {
  const std::string file = folder_.write("person.posednet", "").string();
  folder_.write("posed.toml", "[detector]\nmodels = [\"person.posednet@64x64\", \"" + file + "\"]");
  const Result<Config> config = load_config(folder_ / "posed.toml");
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->detector.models, (std::vector<std::string>{file + "@64x64", file}));
  EXPECT_THAT(error_of("[detector]\nmodels = [\"nothing.posednet@64x64\"]"),
              StartsWith("posed.toml:2:10: detector.models: [\"nothing.posednet@64x64\"]: nothing.posednet@64x64: "));
}

TEST_F(ConfigLoader, AnEmptyTextIsTheDefaults) {
  const Result<Config> parsed = parse_config("", "posed.toml");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->source.kind, SourceKind::Synthetic);
  EXPECT_EQ(parsed->tracker.features, TrackerConfig().features);
  EXPECT_EQ(parsed->camera.calibration, POSED_SOURCE_DIR "/config/cameras/synthetic.toml");
  EXPECT_EQ(parsed->intrinsics.width, 320);
  const Result<Config> defaults = default_config();
  ASSERT_TRUE(defaults) << defaults.error().message;
  EXPECT_EQ(defaults->camera.calibration, parsed->camera.calibration);
  EXPECT_EQ(defaults->intrinsics.baseline_fx, 20.0);
}

TEST_F(ConfigLoader, ReadsEveryKindOfValue) {
  const Result<Config> c = parse_config(R"(
[source]
kind = "replay"
pacing = "lockstep"
replay = { sequence = "/data/xyz", loop = true, max_stamp_difference_s = 0 }
synthetic.mode = "sitting"
synthetic.seed = 9223372036854775807
[camera]
calibration = "tum_fr1.toml"
T_base_camera = [0.1, 0.2, 3, 0.5, -0.5, 0.5, -0.5]
[pipeline.tracker]
policy = "fifo"
priority = 80
cpus = [2, 3]
[publisher]
url = "memq://"
channel_prefix = ""
[logging]
level = "debug"
)",
                                        "posed.toml");
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_EQ(c->source.kind, SourceKind::Replay);
  EXPECT_EQ(c->source.pacing, Pacing::Lockstep);
  EXPECT_EQ(c->source.replay.sequence, "/data/xyz");
  EXPECT_TRUE(c->source.replay.loop);
  EXPECT_EQ(c->source.replay.max_stamp_difference_s, 0.0);
  EXPECT_EQ(c->source.synthetic.mode, SyntheticMode::Sitting);
  EXPECT_EQ(c->source.synthetic.seed, 9223372036854775807);
  EXPECT_EQ(c->camera.T_base_camera.translation(), Eigen::Vector3d(0.1, 0.2, 3.0));
  EXPECT_EQ(c->camera.T_base_camera.rotation().coeffs(), Eigen::Vector4d(0.5, -0.5, 0.5, -0.5));
  EXPECT_EQ(c->pipeline.tracker.policy, ThreadPolicyName::Fifo);
  EXPECT_EQ(c->pipeline.tracker.priority, 80);
  EXPECT_THAT(c->pipeline.tracker.cpus, testing::ElementsAre(2, 3));
  EXPECT_EQ(c->publisher.url, "memq://");
  EXPECT_EQ(c->publisher.channel_prefix, "");
  EXPECT_EQ(c->logging.level, "debug");
  EXPECT_EQ(c->intrinsics.k3, 1.163314);
}

TEST_F(ConfigLoader, NormalisesQuaternions) {
  const Result<Config> c = parse_config("camera.T_map_start = [0, 0, 0, 0, 0, 0.6005, 0.8]\n", "posed.toml");
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_NEAR(c->camera.T_map_start.rotation().norm(), 1.0, 1e-15);
}

TEST_F(ConfigLoader, IntegerOutOfRange) {
  EXPECT_EQ(error_of("[tracker]\nfeatures = 20\n"), "posed.toml:2:12: tracker.features: 20: out of range, allowed 100 to 5000");
  EXPECT_EQ(error_of("[tracker]\n  features=5001"), "posed.toml:2:12: tracker.features: 5001: out of range, allowed 100 to 5000");
  EXPECT_EQ(error_of("tracker.features = -9223372036854775808"),
            "posed.toml:1:20: tracker.features: -9223372036854775808: out of range, allowed 100 to 5000");
  // A value that only fits after wrapping around 32 bits.
  EXPECT_EQ(error_of("tracker.features = 4294968296"),
            "posed.toml:1:20: tracker.features: 4294968296: out of range, allowed 100 to 5000");
  EXPECT_EQ(error_of("source.synthetic.seed = -1"),
            "posed.toml:1:25: source.synthetic.seed: -1: out of range, allowed 0 to 9223372036854775807");
}

TEST_F(ConfigLoader, LimitsAreInclusive) {
  EXPECT_TRUE(parse_config("tracker.features = 100\n", "posed.toml"));
  EXPECT_TRUE(parse_config("tracker.features = 5000\n", "posed.toml"));
  EXPECT_TRUE(parse_config("tracker.keyframe_inlier_ratio = 0.1\n", "posed.toml"));
  EXPECT_TRUE(parse_config("tracker.keyframe_inlier_ratio = 1\n", "posed.toml"));
}

TEST_F(ConfigLoader, NumberOutOfRangeOrNotFinite) {
  EXPECT_EQ(error_of("[tracker]\npyramid_scale = 2.5"),
            "posed.toml:2:17: tracker.pyramid_scale: 2.5: out of range, allowed 1.05 to 2.0");
  EXPECT_EQ(error_of("[tracker]\npyramid_scale = 9007199254740993"),
            "posed.toml:2:17: tracker.pyramid_scale: 9007199254740993: out of range, allowed 1.05 to 2.0");
  EXPECT_EQ(error_of("[tracker]\npyramid_scale = nan"),
            "posed.toml:2:17: tracker.pyramid_scale: nan: not a finite number, allowed 1.05 to 2.0");
  EXPECT_EQ(error_of("[tracker]\npyramid_scale = -inf"),
            "posed.toml:2:17: tracker.pyramid_scale: -inf: not a finite number, allowed 1.05 to 2.0");
}

TEST_F(ConfigLoader, WrongTypes) {
  EXPECT_EQ(error_of("tracker.features = 1000.0"),
            "posed.toml:1:20: tracker.features: 1000.0: wrong type (float), expected integer, allowed 100 to 5000");
  EXPECT_EQ(error_of("tracker.features = \"1000\""),
            "posed.toml:1:20: tracker.features: \"1000\": wrong type (string), expected integer, allowed 100 to 5000");
  EXPECT_EQ(error_of("tracker.pyramid_scale = true"),
            "posed.toml:1:25: tracker.pyramid_scale: true: wrong type (boolean), expected number, allowed 1.05 to 2.0");
  EXPECT_EQ(error_of("source.replay.loop = 1"),
            "posed.toml:1:22: source.replay.loop: 1: wrong type (integer), expected boolean, allowed true or false");
  EXPECT_EQ(
      error_of("source.kind = 1"),
      "posed.toml:1:15: source.kind: 1: wrong type (integer), expected string, allowed \"synthetic\", \"replay\", \"openni2\", "
      "\"v4l2\" or \"libcamera\"");
  EXPECT_EQ(
      error_of("publisher.channel_prefix = 1979-05-27"),
      "posed.toml:1:28: publisher.channel_prefix: a date or time: wrong type (date-time), expected string, allowed at most 31 "
      "letters, digits and underscores");
  EXPECT_EQ(error_of("pipeline.capture.cpus = 1"),
            "posed.toml:1:25: pipeline.capture.cpus: 1: wrong type (integer), expected array of integers, allowed at most 1024, "
            "each 0 to "
            "1023");
  EXPECT_EQ(
      error_of("camera.T_base_camera = 0"),
      "posed.toml:1:24: camera.T_base_camera: 0: wrong type (integer), expected array of 7 numbers, allowed x, y, z, then a unit "
      "quaternion qx, qy, qz, qw");
}

TEST_F(ConfigLoader, TablesWhereValuesBelongAndTheOtherWayRound) {
  EXPECT_EQ(error_of("[tracker.features]\nfirst = 1"),
            "posed.toml:1:1: tracker.features: a table: wrong type (table), expected integer, allowed 100 to 5000");
  EXPECT_EQ(error_of("tracker = 3"), "posed.toml:1:11: tracker: 3: wrong type (integer), expected table");
  EXPECT_EQ(error_of("[[pipeline.capture]]\npriority = 1"),
            "posed.toml:1:1: pipeline.capture: [a table]: wrong type (array), expected table");
}

TEST_F(ConfigLoader, ElementsOfArrays) {
  EXPECT_EQ(error_of("pipeline.capture.cpus = [0, -1]"),
            "posed.toml:1:29: pipeline.capture.cpus: -1: element 2 of 2: out of range, allowed 0 to 1023");
  EXPECT_EQ(error_of("pipeline.capture.cpus = [0.0]"),
            "posed.toml:1:26: pipeline.capture.cpus: 0.0: element 1 of 1: wrong type (float), expected integer, allowed 0 to 1023");
  std::string many = "pipeline.capture.cpus = [0";
  for (int i = 0; i < 1024; ++i) {
    many += ",0";
  }
  EXPECT_EQ(
      error_of(many + "]"),
      "posed.toml:1:25: pipeline.capture.cpus: [0, 0, 0, 0, 0, 0, 0, 0, ...]: too long (1025), allowed at most 1024, each 0 to "
      "1023");
}

TEST_F(ConfigLoader, Poses) {
  EXPECT_EQ(error_of("camera.T_base_camera = [0, 0, 0]"),
            "posed.toml:1:24: camera.T_base_camera: [0, 0, 0]: wrong length (3), expected array of 7 numbers, allowed x, y, z, "
            "then a unit "
            "quaternion qx, qy, qz, qw");
  EXPECT_EQ(error_of("camera.T_base_camera = [0, 0, 0, 0, 0, 0, 0]"),
            "posed.toml:1:24: camera.T_base_camera: [0, 0, 0, 0, 0, 0, 0]: quaternion's norm is 0.000000, allowed 1 within 0.001");
  EXPECT_EQ(
      error_of("camera.T_base_camera = [0, 0, 0, 0, 0, 0.6, 0.802]"),
      "posed.toml:1:24: camera.T_base_camera: [0, 0, 0, 0, 0, 0.6, 0.802]: quaternion's norm is 1.001601, allowed 1 within 0.001");
  EXPECT_EQ(error_of("camera.T_base_camera = [0, nan, 0, 0, 0, 0, 1]"),
            "posed.toml:1:28: camera.T_base_camera: nan: element 2 of 7: not a finite number, allowed -10000000.0 to 10000000.0");
  EXPECT_EQ(error_of("camera.T_base_camera = [0, 0, 0, 0, 0, 0, 2]"),
            "posed.toml:1:43: camera.T_base_camera: 2: element 7 of 7: out of range, allowed -1.001 to 1.001");
}

TEST_F(ConfigLoader, Choices) {
  EXPECT_EQ(error_of("source.kind = \"kinect\""),
            "posed.toml:1:15: source.kind: \"kinect\": unknown choice, allowed \"synthetic\", \"replay\", \"openni2\", "
            "\"v4l2\" or \"libcamera\"");
  EXPECT_EQ(
      error_of("logging.level = \"INFO\""),
      "posed.toml:1:17: logging.level: \"INFO\": unknown choice, allowed \"debug\", \"info\", \"warning\", \"error\" or \"off\"");
}

TEST_F(ConfigLoader, Texts) {
  EXPECT_EQ(error_of("publisher.url = \"239.255.76.67:7667\""),
            "posed.toml:1:17: publisher.url: \"239.255.76.67:7667\": not allowed, must be an LCM address such as "
            "\"udpm://239.255.76.67:7667?ttl=0\"");
  EXPECT_EQ(error_of("publisher.url = \"udpm://239.255.76.67:7667 \""),
            "posed.toml:1:17: publisher.url: \"udpm://239.255.76.67:7667 \": not allowed, must be an LCM address such as "
            "\"udpm://239.255.76.67:7667?ttl=0\"");
  EXPECT_EQ(error_of("publisher.channel_prefix = \"a b\""),
            "posed.toml:1:28: publisher.channel_prefix: \"a b\": not allowed, must be at most 31 letters, digits and underscores");
  EXPECT_EQ(error_of("source.replay.sequence = \"a\\u0000b\""),
            "posed.toml:1:26: source.replay.sequence: \"a\\u0000b\": not allowed, must be the path of a folder");
  EXPECT_EQ(error_of("camera.calibration = \"\""),
            "posed.toml:1:22: camera.calibration: \"\": not allowed, must be the name of a file");
}

TEST_F(ConfigLoader, UnknownKeysGetTheNearestKnownOne) {
  EXPECT_EQ(error_of("[tracker]\nfeaturs = 20"),
            "posed.toml:2:1: tracker.featurs: 20: unknown key; did you mean tracker.features?");
  EXPECT_EQ(error_of("[tracker]\nfast_treshold_minimun = 20"),
            "posed.toml:2:1: tracker.fast_treshold_minimun: 20: unknown key; did you mean tracker.fast_threshold_minimum?");
  EXPECT_EQ(error_of("[tracker]\nmax_keyframes = 20"),
            "posed.toml:2:1: tracker.max_keyframes: 20: unknown key; did you mean mapper.max_keyframes?");
  EXPECT_EQ(error_of("features = 20"), "posed.toml:1:1: features: 20: unknown key; did you mean tracker.features?");
  EXPECT_EQ(error_of("[mapper]\nspeed = \"high\""),
            "posed.toml:2:1: mapper.speed: \"high\": unknown key; allowed here: max_keyframes, max_landmarks, local_landmarks, "
            "local_keyframes, recovery_keyframes, bundle_keyframes, bundle_iterations, bundle_budget_s, drift_factor, "
            "loop_closing, "
            "loop_max_drift");
  EXPECT_EQ(error_of("quux = 1"), "posed.toml:1:1: quux: 1: unknown key; allowed are only keys in tables, such as [tracker]");
  EXPECT_EQ(
      error_of("[pipeline]\nqueues = 3"),
      "posed.toml:2:1: pipeline.queues: 3: unknown key; allowed here: frame_slots, frame_queue, keyframe_queue, publish_queue, "
      "lock_memory");
}

TEST_F(ConfigLoader, UnknownTablesAreReportedOnce) {
  EXPECT_EQ(error_of("[traker]\nfeatures = 20\npyramid_levels = 3"),
            "posed.toml:1:2: traker: unknown table; did you mean tracker?");
  EXPECT_EQ(error_of("[pipeline.captur]\npriority = 1"),
            "posed.toml:1:11: pipeline.captur: unknown table; did you mean pipeline.capture?");
  EXPECT_EQ(error_of("[quantum]\nspin.up = 1"),
            "posed.toml:1:2: quantum: unknown table; allowed here: source, source.replay, source.synthetic, source.live, "
            "source.openni2, source.v4l2, source.libcamera, source.depth, camera, tracker, "
            "mapper, map, detector, dynamic, publisher, gpio, pipeline, pipeline.capture, pipeline.tracker, pipeline.mapper, "
            "pipeline.detector, "
            "pipeline.publisher, logging");
}

TEST_F(ConfigLoader, DuplicatesAndSyntaxErrors) {
  EXPECT_EQ(error_of("[tracker]\nfeatures = 200\nfeatures = 300\n"),
            "posed.toml:3:12: not valid TOML: cannot redefine existing integer 'features' (in a key-value pair)");
  EXPECT_EQ(error_of("[tracker]\n[mapper]\n[tracker]\n"),
            "posed.toml:3:1: not valid TOML: cannot redefine existing table 'tracker' (in a table header)");
  EXPECT_EQ(error_of("[tracker]\nfeatures = \n"),
            "posed.toml:2:12: not valid TOML: expected value, saw '\\n' (in a key-value pair)");
  EXPECT_EQ(error_of("[%tracker]\n"),
            "posed.toml:1:2: not valid TOML: expected bare key starting character or string delimiter, saw '%' (in a key)");
  EXPECT_THAT(error_of("[tracker\n"), StartsWith("posed.toml:1:9: not valid TOML: "));
  EXPECT_THAT(error_of("tracker.features = 1_000_000_000_000_000_000_000"), StartsWith("posed.toml:1:"));
}

TEST_F(ConfigLoader, AllMistakesAreReportedInTheOrderOfTheText) {
  EXPECT_EQ(error_of("[tracker]\nfeatures = 20\npyramid_scale = \"big\"\n[mapper]\nmax_keyframe = 3\n[camera]\nT_map_start = []\n"),
            "posed.toml:2:12: tracker.features: 20: out of range, allowed 100 to 5000\n"
            "posed.toml:3:17: tracker.pyramid_scale: \"big\": wrong type (string), expected number, allowed 1.05 to 2.0\n"
            "posed.toml:5:1: mapper.max_keyframe: 3: unknown key; did you mean mapper.max_keyframes?\n"
            "posed.toml:7:15: camera.T_map_start: []: wrong length (0), expected array of 7 numbers, allowed x, y, z, then a unit "
            "quaternion qx, qy, qz, qw");
}

TEST_F(ConfigLoader, RulesBetweenKeys) {
  EXPECT_EQ(error_of("[source]\nkind = \"replay\""),
            "posed.toml:2:8: source.kind: \"replay\": needs source.replay.sequence, the folder of a recording");
  EXPECT_EQ(
      error_of("[source.synthetic]\nworld = \"office\""),
      "posed.toml:2:9: source.synthetic.world: \"office\": only the world \"room\" has people: source.synthetic.people (2) must "
      "be 0 here");
  EXPECT_TRUE(parse_config("[source.synthetic]\nworld = \"office\"\npeople = 0", "posed.toml"));
  EXPECT_EQ(error_of("[tracker]\nfast_threshold_minimum = 21"),
            "posed.toml:2:26: tracker.fast_threshold_minimum: 21: tracker.fast_threshold_minimum (21) must be at most "
            "tracker.fast_threshold (20)");
  EXPECT_EQ(error_of("[map]\nmode = \"localization\""),
            "posed.toml:2:8: map.mode: \"localization\": needs map.file, the map to localize in");
  // The key that the text has is blamed.
  EXPECT_EQ(
      error_of("[tracker]\nfast_threshold = 6"),
      "posed.toml:2:18: tracker.fast_threshold: 6: tracker.fast_threshold_minimum (7) must be at most tracker.fast_threshold (6)");
  EXPECT_EQ(error_of("[tracker]\nfeatures = 100\nmin_inliers = 100"),
            "posed.toml:3:15: tracker.min_inliers: 100: tracker.min_inliers (100) must be less than tracker.features (100)");
  EXPECT_EQ(error_of("[mapper]\nmax_keyframes = 15\nlocal_keyframes = 15"),
            "posed.toml:2:17: mapper.max_keyframes: 15: mapper.recovery_keyframes (20) must be at most mapper.max_keyframes (15)");
  EXPECT_EQ(
      error_of("[mapper]\nmax_keyframes = 200\nlocal_keyframes = 201"),
      "posed.toml:3:19: mapper.local_keyframes: 201: mapper.local_keyframes (201) must be at most mapper.max_keyframes (200)");
  EXPECT_EQ(error_of("[pipeline]\nframe_queue = 15"),
            "posed.toml:2:15: pipeline.frame_queue: 15: pipeline.frame_slots (16) must be at least pipeline.frame_queue (15) + 5");
  EXPECT_EQ(error_of("[detector]\nenabled = false\n[pipeline]\nframe_queue = 15"),
            "posed.toml:4:15: pipeline.frame_queue: 15: pipeline.frame_slots (16) must be at least pipeline.frame_queue (15) + 2");
  EXPECT_EQ(error_of("[detector]\nmodels = []"),
            "posed.toml:2:10: detector.models: []: names no file; set detector.enabled = false to look for nobody");
  for (const std::string thread : {"capture", "tracker", "mapper", "detector", "publisher"}) {
    EXPECT_EQ(error_of("[pipeline." + thread + "]\npolicy = \"fifo\""), "posed.toml:2:10: pipeline." + thread +
                                                                            ".policy: \"fifo\": policy \"fifo\" needs pipeline." +
                                                                            thread + ".priority from 1 to 99");
  }
}

TEST_F(ConfigLoader, CamerasNeedDepthAndDoNotWait) {
  EXPECT_EQ(error_of("source.kind = \"v4l2\"\nsource.depth.device = \"/dev/video2\""),
            "posed.toml:1:15: source.kind: \"v4l2\": needs source.v4l2.device, the node of the colour camera");
  EXPECT_EQ(
      error_of("source.kind = \"libcamera\""),
      "posed.toml:1:15: source.kind: \"libcamera\": a colour camera alone cannot be tracked in metres: set source.depth.device, "
      "the node of a depth camera");
  EXPECT_EQ(error_of("source.kind = \"openni2\"\nsource.pacing = \"lockstep\""),
            "posed.toml:2:17: source.pacing: \"lockstep\": a camera does not wait: \"lockstep\" is for recordings and the rendered "
            "world");
  EXPECT_TRUE(
      parse_config("source.kind = \"openni2\"\nsource.pacing = \"lockstep\"\nsource.openni2.device = \"a.oni\"", "posed.toml"));
  EXPECT_EQ(error_of("source.v4l2.controls = [\"gain=3\", \"exposure\"]"),
            "posed.toml:1:35: source.v4l2.controls: \"exposure\": element 2 of 2: not allowed, must be a text NAME=VALUE");
}

TEST_F(ConfigLoader, DeadlineSchedulingIsForTheDetector) {
  EXPECT_TRUE(parse_config("pipeline.detector.policy = \"deadline\"", "posed.toml"));
  EXPECT_EQ(error_of("pipeline.tracker.policy = \"deadline\""),
            "posed.toml:1:27: pipeline.tracker.policy: \"deadline\": \"deadline\" is for the detector alone: it would take the "
            "processor away from every other thread");
}

TEST_F(ConfigLoader, GpioLinesDiffer) {
  EXPECT_EQ(error_of("gpio.status_line = 3\ngpio.trigger_line = 3"),
            "posed.toml:1:20: gpio.status_line: 3: status_line, enable_line and trigger_line must be different lines");
}

TEST_F(ConfigLoader, ARuleOverARefusedKeySaysNothing) {
  EXPECT_EQ(error_of("[tracker]\nfast_threshold = 0\nfast_threshold_minimum = 100"),
            "posed.toml:2:18: tracker.fast_threshold: 0: out of range, allowed 1 to 200");
}

TEST_F(ConfigLoader, SmallestPyramidLevelMustHoldAPatch) {
  EXPECT_EQ(error_of("[tracker]\npyramid_levels = 12\npyramid_scale = 1.5"),
            "posed.toml:2:18: tracker.pyramid_levels: 12: 12 levels of scale 1.5 leave 3 pixels of a 320x240 image, needed are 37");
}

TEST_F(ConfigLoader, RelativePathsStartAtTheFilesFolder) {
  const Result<Config> c =
      parse_config("[source.replay]\nsequence = \"../data/xyz\"\nassociations = \"/lists/a.txt\"\n", "/etc/posed/posed.toml");
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_EQ(c->source.replay.sequence, "/etc/data/xyz");
  EXPECT_EQ(c->source.replay.associations, "/lists/a.txt");
  const Result<Config> unset = parse_config("", "/etc/posed/posed.toml");
  ASSERT_TRUE(unset);
  EXPECT_EQ(unset->source.replay.sequence, "");
}

TEST_F(ConfigLoader, LoadsFiles) {
  const Result<Config> c = load_config(folder_.write("posed.toml", "[tracker]\nfeatures = 500\n"));
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_EQ(c->tracker.features, 500);
}

TEST_F(ConfigLoader, CalibrationBesideTheFileComesFirst) {
  const std::filesystem::path lens = folder_.write("synthetic.toml",
                                                   "[camera]\nwidth = 400\nheight = 300\nfx = 300\nfy = 300\ncx = 200\ncy = "
                                                   "150\ndepth_units_per_metre = 1000\nbaseline_fx = 20\n");
  const Result<Config> c = load_config(folder_.write("posed.toml", ""));
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_EQ(c->intrinsics.width, 400);
  EXPECT_EQ(c->camera.calibration, lens.string());
}

TEST_F(ConfigLoader, MistakesOfTheCalibrationAreReportedToo) {
  const std::filesystem::path lens = folder_.write("lens.toml", "[camera]\nwidth = 1\n");
  const std::filesystem::path file = folder_.write("posed.toml", "camera.calibration = \"lens.toml\"\ntracker.features = 1\n");
  const Result<Config> c = load_config(file);
  ASSERT_FALSE(c);
  EXPECT_EQ(c.error().code, ErrorCode::InvalidConfig);
  EXPECT_THAT(c.error().message, StartsWith(file.string() + ":2:20: tracker.features: 1: out of range, allowed 100 to 5000\n" +
                                            lens.string() + ":2:9: camera.width: 1: out of range, allowed 32 to 8192\n"));
}

TEST_F(ConfigLoader, MissingCalibration) {
  EXPECT_THAT(
      error_of("[camera]\ncalibration = \"absent.toml\""),
      StartsWith(
          "posed.toml:2:15: camera.calibration: \"absent.toml\": there is no such file; looked for absent.toml, " POSED_SOURCE_DIR
          "/config/cameras/absent.toml, "));
  EXPECT_EQ(error_of("[camera]\ncalibration = \"/absent.toml\""),
            "posed.toml:2:15: camera.calibration: \"/absent.toml\": there is no such file");
}

TEST_F(ConfigLoader, FilesThatCannotBeRead) {
  const auto message = [](const std::filesystem::path& path) {
    const Result<Config> c = load_config(path);
    EXPECT_FALSE(c);
    EXPECT_EQ(c.error().code, ErrorCode::Io);
    return c.error().message;
  };
  const std::filesystem::path absent = folder_.path() / "absent.toml";
  EXPECT_EQ(message(absent), absent.string() + ": cannot be read: no such file");
  EXPECT_EQ(message(folder_.path()), folder_.path().string() + ": cannot be read: not a regular file");
  const std::filesystem::path large = folder_.write("large.toml", std::string(70000, '#'));
  EXPECT_EQ(message(large), large.string() + ": cannot be read: longer than 65536 bytes, so not a configuration");
}

}  // namespace
}  // namespace posed
