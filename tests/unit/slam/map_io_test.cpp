#include "slam/map_io.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "tests/support/file_size_limit.h"
#include "tests/support/map_file_bytes.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using ::testing::HasSubstr;

bool same_pose(const Se3& a, const Se3& b) {
  return a.rotation().coeffs() == b.rotation().coeffs() && a.translation() == b.translation();
}

bool same_keypoint(const Keypoint& a, const Keypoint& b) {
  return a.x == b.x && a.y == b.y && a.angle_rad == b.angle_rad && a.level == b.level && a.response == b.response;
}

std::vector<std::pair<KeyframeId, int>> sorted_observations(const Landmark& landmark) {
  std::vector<std::pair<KeyframeId, int>> sorted;
  for (const Observation& o : landmark.observations) {
    sorted.emplace_back(o.keyframe, o.keypoint);
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

void expect_same(const Landmark& a, const Landmark& b) {
  EXPECT_EQ(a.p_map, b.p_map);
  EXPECT_EQ(a.information, b.information);
  EXPECT_EQ(a.mean_view_map, b.mean_view_map);
  EXPECT_EQ(a.max_distance_m, b.max_distance_m);
  EXPECT_EQ(a.min_distance_m, b.min_distance_m);
  EXPECT_EQ(a.descriptor, b.descriptor);
  EXPECT_EQ(a.predicted, b.predicted);
  EXPECT_EQ(a.found, b.found);
  EXPECT_EQ(sorted_observations(a), sorted_observations(b));
}

void expect_same(const Keyframe& a, const Keyframe& b) {
  EXPECT_EQ(a.map_id, b.map_id);
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.capture_ns, b.capture_ns);
  EXPECT_TRUE(same_pose(a.T_map_camera, b.T_map_camera));
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_TRUE(std::equal(a.features.keypoints.begin(), a.features.keypoints.end(), b.features.keypoints.begin(),
                         b.features.keypoints.end(), same_keypoint));
  EXPECT_EQ(a.features.descriptors, b.features.descriptors);
  EXPECT_EQ(a.ideal_pixels, b.ideal_pixels);
  EXPECT_EQ(a.depth_m, b.depth_m);
  EXPECT_EQ(a.landmarks, b.landmarks);
  EXPECT_EQ(a.covisible, b.covisible);
  EXPECT_EQ(a.parent, b.parent);
  ASSERT_EQ(a.loops.size(), b.loops.size());
  for (std::size_t i = 0; i < a.loops.size(); ++i) {
    EXPECT_EQ(a.loops[i].other, b.loops[i].other);
    EXPECT_TRUE(same_pose(a.loops[i].T_this_other, b.loops[i].T_this_other));
    EXPECT_EQ(a.loops[i].information, b.loops[i].information);
  }
}

class MapIoTest : public ::testing::Test {
 protected:
  void save(const Map& map) {
    const Status saved = save_map(path_, map, header_);
    ASSERT_TRUE(saved) << saved.error().message;
  }

  Result<LoadedMap> load() const { return load_map(path_, header_); }

  /// Loads what `bytes` hold; the error, whose message must name the file, or code InvalidArgument and "loaded".
  Error refusal_of(const std::string& bytes) const {
    folder_.write("map", bytes);
    const Result<LoadedMap> loaded = load();
    EXPECT_EQ(contents_of(path_), bytes) << "the file was changed";
    if (loaded) {
      return {ErrorCode::InvalidArgument, "loaded"};
    }
    EXPECT_THAT(loaded.error().message, HasSubstr(path_));
    return loaded.error();
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "map";
  MapHeader header_ = random_map_header();
};

TEST_F(MapIoTest, ComesBackAsItWas) {
  Map map = random_map(1, 12, 80);
  save(map);
  const Result<LoadedMap> loaded = load();
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->header.active_map, 1U);
  EXPECT_EQ(loaded->header.highest_map, 2U);
  EXPECT_EQ(loaded->header.saved_utc_ns, header_.saved_utc_ns);
  EXPECT_EQ(loaded->header.camera.k2, header_.camera.k2);
  EXPECT_EQ(loaded->map.next_landmark(), map.next_landmark());
  map.remove_landmark(map.next_landmark() - 1);  // the one that nobody observes
  ASSERT_GT(map.landmark_count(), 100U);
  EXPECT_EQ(loaded->map.landmark_ids(), map.landmark_ids());
  for (const LandmarkId id : map.landmark_ids()) {
    expect_same(*loaded->map.find_landmark(id), *map.find_landmark(id));
  }
  ASSERT_EQ(loaded->map.keyframes().size(), map.keyframes().size());
  std::size_t loops = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    expect_same(loaded->map.keyframes().at(id), keyframe);
    loops += keyframe.loops.size();
  }
  EXPECT_GT(loops, 0U);
}

TEST_F(MapIoTest, AnEmptyMapComesBackToo) {
  save(Map());
  const Result<LoadedMap> loaded = load();
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(loaded->map.keyframes().empty());
}

TEST_F(MapIoTest, TheBytesAreAFunctionOfTheMap) {
  save(random_map(2, 8, 60));
  const std::string bytes = contents_of(path_);
  save(random_map(2, 8, 60));
  EXPECT_EQ(contents_of(path_), bytes);
  Result<LoadedMap> loaded = load();
  ASSERT_TRUE(loaded);
  save(loaded->map);
  EXPECT_EQ(contents_of(path_), bytes) << "a map that was loaded is saved differently";
}

TEST_F(MapIoTest, EveryTruncationIsRefused) {
  save(random_map(3, 2, 3));
  const std::string bytes = contents_of(path_);
  ASSERT_GT(bytes.size(), 900U);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ASSERT_EQ(refusal_of(bytes.substr(0, length)).code, ErrorCode::BadData) << length << " of " << bytes.size();
  }
  EXPECT_EQ(refusal_of(bytes).message, "loaded");
}

TEST_F(MapIoTest, ChangedBytesAreRefused) {
  save(random_map(4, 5, 30));
  const std::string bytes = contents_of(path_);
  std::mt19937 random(5);
  for (int i = 0; i < 600; ++i) {
    std::string changed = bytes;
    const std::size_t at = i < 64 ? static_cast<std::size_t>(i) : random() % bytes.size();
    changed[at] = static_cast<char>(changed[at] ^ static_cast<char>(1 + random() % 255));
    ASSERT_EQ(refusal_of(changed).code, ErrorCode::BadData) << "byte " << at;
  }
}

TEST_F(MapIoTest, BytesThatFollowTheEndAreRefused) {
  save(random_map(6, 2, 4));
  EXPECT_THAT(refusal_of(contents_of(path_) + "x").message, HasSubstr("something follows"));
}

TEST_F(MapIoTest, ALostOrRepeatedRecordIsRefused) {
  save(random_map(7, 4, 6));
  const MapFileBytes file(contents_of(path_));
  for (std::size_t i = 0; i < file.records().size(); ++i) {
    MapFileBytes without = file;
    without.erase(i);
    EXPECT_EQ(refusal_of(without.bytes()).code, ErrorCode::BadData) << "without record " << i;
    MapFileBytes twice = file;
    twice.repeat(i);
    EXPECT_EQ(refusal_of(twice.bytes()).code, ErrorCode::BadData) << "with record " << i << " twice";
  }
}

// Whoever changes a record and its checksum with it meets the checks of the values themselves.
TEST_F(MapIoTest, ChangedRecordsWithRightChecksumsNeverCrash) {
  save(random_map(8, 4, 6));
  const MapFileBytes file(contents_of(path_));
  std::mt19937 random(9);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    MapFileBytes changed = file;
    std::string& payload = changed.records()[random() % changed.records().size()].payload;
    payload[random() % payload.size()] = static_cast<char>(random());
    folder_.write("map", changed.bytes());
    if (Result<LoadedMap> loaded = load()) {
      ASSERT_TRUE(save_map(folder_ / "again", loaded->map, loaded->header)) << "what was loaded cannot be saved";
    } else {
      ++refused;
      EXPECT_THAT(loaded.error().message, HasSubstr(path_));
    }
  }
  EXPECT_GT(refused, 30);
}

TEST_F(MapIoTest, ACountThatIsTooLargeIsRefusedBeforeRoomIsMade) {
  save(random_map(10, 1, 4));
  MapFileBytes file(contents_of(path_));
  std::string& payload = file.records().back().payload;
  ASSERT_GT(payload.size(), 400U) << "no keyframe";
  constexpr std::size_t kKeypoints = 8;
  payload.replace(kKeypoints, 8, std::string("\x03\xFF\xFF\xFF\x7F\xFF\xFF\xE0", 8));
  EXPECT_THAT(refusal_of(file.bytes()).message, HasSubstr("it is no keyframe"));
}

TEST_F(MapIoTest, AForeignFileIsRefused) {
  for (const std::string& text : {std::string(), std::string("[camera]\nwidth = 640\n"), std::string(5000, '\0')}) {
    const Error error = refusal_of(text);
    EXPECT_EQ(error.code, ErrorCode::BadData);
    EXPECT_THAT(error.message, HasSubstr("is no map of posed"));
  }
}

TEST_F(MapIoTest, ANewerVersionIsRefused) {
  save(random_map(11, 2, 4));
  MapFileBytes file(contents_of(path_));
  file.set_version(2);
  const Error error = refusal_of(file.bytes());
  EXPECT_EQ(error.code, ErrorCode::Unsupported);
  EXPECT_THAT(error.message, HasSubstr("format version 2"));
  EXPECT_THAT(error.message, HasSubstr("it reads version 1"));
}

TEST_F(MapIoTest, AnotherCameraOrPyramidIsRefused) {
  save(random_map(12, 2, 4));
  const std::vector<std::pair<std::string, std::function<void(MapHeader&)>>> changes{
      {"width is 640, the calibration says 320", [](MapHeader& h) { h.camera.width = 320; }},
      {"fx is 525, the calibration says 525.5", [](MapHeader& h) { h.camera.fx = 525.5; }},
      {"distortion k1 is 0.1, the calibration says 0", [](MapHeader& h) { h.camera.k1 = 0; }},
      {"baseline_fx is 40, the calibration says 41", [](MapHeader& h) { h.camera.baseline_fx = 41; }},
      {"tracker.pyramid_levels = 8, configured is 7", [](MapHeader& h) { h.pyramid_levels = 7; }},
      {"tracker.pyramid_scale = 1.2, configured is 1.25", [](MapHeader& h) { h.pyramid_scale = 1.25; }}};
  for (const auto& [message, change] : changes) {
    MapHeader other = header_;
    change(other);
    const Result<LoadedMap> loaded = load_map(path_, other);
    ASSERT_FALSE(loaded) << message;
    EXPECT_EQ(loaded.error().code, ErrorCode::InvalidConfig);
    EXPECT_THAT(loaded.error().message, HasSubstr(message));
    EXPECT_THAT(loaded.error().message, HasSubstr(path_));
  }
}

TEST_F(MapIoTest, WhatIsNoRegularFileIsRefused) {
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  EXPECT_EQ(load().error().code, ErrorCode::BadData);
  EXPECT_EQ(load_map(folder_.path().string(), header_).error().code, ErrorCode::BadData);
  EXPECT_EQ(load_map(folder_ / "missing", header_).error().code, ErrorCode::NotFound);
}

TEST_F(MapIoTest, AMapThatBreaksItsRulesIsNotSaved) {
  save(random_map(13, 4, 6));
  const std::string bytes = contents_of(path_);
  const std::vector<std::pair<std::string, std::function<void(Map&)>>> faults{
      {"keyframe 2: its pose",
       [](Map& m) {
         m.find_keyframe(2)->T_map_camera = Se3(Eigen::Quaterniond::Identity(), {0, 0, std::nan("")});
       }},
      {"keyframe 3: is of map 9", [](Map& m) { m.find_keyframe(3)->map_id = 9; }},
      {"its parent 2 is not in its map", [](Map& m) { m.find_keyframe(3)->parent = 2; }},
      {"is its own ancestor", [](Map& m) { m.find_keyframe(1)->parent = 3; }},
      {"one of them does not exist",
       [](Map& m) {
         m.find_keyframe(4)->loops.push_back({77, Se3(), Matrix6d::Identity()});
       }},
      {"landmark 1: its numbers", [](Map& m) { m.find_landmark(1)->p_map.x() = std::numeric_limits<double>::infinity(); }},
      {"keypoint 2", [](Map& m) { m.find_keyframe(1)->features.keypoints[2].level = 8; }},
      {"keypoint 0", [](Map& m) { m.find_keyframe(1)->depth_m[0] = -1; }}};
  for (const auto& [message, fault] : faults) {
    Map map = random_map(13, 4, 6);
    fault(map);
    const Status saved = save_map(path_, map, header_);
    ASSERT_FALSE(saved) << message;
    EXPECT_EQ(saved.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(saved.error().message, HasSubstr(message));
    EXPECT_EQ(contents_of(path_), bytes);
    EXPECT_FALSE(std::filesystem::exists(path_ + ".part"));
  }
}

TEST_F(MapIoTest, AFullDiskKeepsTheOldFile) {
  save(random_map(14, 3, 20));
  const std::string bytes = contents_of(path_);
  const Map larger = random_map(15, 40, 200);
  for (const rlim_t limit_bytes : {rlim_t{0}, rlim_t{100}, rlim_t{100'000}, rlim_t{300'000}}) {
    {
      const FileSizeLimit limit(limit_bytes);
      const Status saved = save_map(path_, larger, header_);
      ASSERT_FALSE(saved) << limit_bytes;
      EXPECT_EQ(saved.error().code, ErrorCode::Io);
      EXPECT_THAT(saved.error().message, HasSubstr(path_));
      EXPECT_THAT(saved.error().message, HasSubstr("File too large"));
    }
    EXPECT_EQ(contents_of(path_), bytes);
    EXPECT_FALSE(std::filesystem::exists(path_ + ".part"));
  }
  save(larger);
  EXPECT_TRUE(load());
}

// A process that dies at any moment of saving leaves the old map or the new one.
TEST_F(MapIoTest, AKillLeavesTheOldMapOrTheNew) {
  const Map small = random_map(16, 3, 20);
  const Map large = random_map(17, 40, 200);
  save(large);
  const std::string large_bytes = contents_of(path_);
  save(small);
  const std::string small_bytes = contents_of(path_);
  std::mt19937 random(18);
  for (int i = 0; i < 25; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      while (true) {
        if (!save_map(path_, large, header_) || !save_map(path_, small, header_)) {
          ::_exit(1);
        }
      }
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child could not save";
    const std::string bytes = contents_of(path_);
    ASSERT_TRUE(bytes == small_bytes || bytes == large_bytes);
  }
  save(large);  // what the killed processes left is in nobody's way
  EXPECT_EQ(contents_of(path_), large_bytes);
}

}  // namespace
}  // namespace posed
