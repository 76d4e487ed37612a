#include "daemon/map_saver.h"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <posed/map_reply_t.hpp>
#include <posed/map_request_t.hpp>
#include <posed/pose_t.hpp>

#include "daemon/pipeline.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/daemon/fake_transport.h"
#include "tests/unit/daemon/fakes.h"

namespace posed {
namespace {

using ::testing::HasSubstr;

constexpr TimeNs kPeriod = 300 * kNsPerSecond;
constexpr TimeNs kLong = 60 * kNsPerSecond;  // a limit for what must happen, however slow the machine

tl::unexpected<Error> disk_full() {
  return make_error(ErrorCode::Io, "cannot write map: No space left on device");
}

class MapSaverTest : public ::testing::Test {
 protected:
  MapSaver make() { return MapSaver(mapper_, files_, period_ns_, clock_); }

  void add_keyframe(MapSaver& saver) {
    KeyframeRecord record;
    record.id = 1;
    mapper_.insert(record);
    saver.note_keyframe();
  }

  static HealthReport report_of(const MapSaver& saver) {
    HealthReport health;
    saver.report(health);
    return health;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "map";
  FakeMapper mapper_;
  ManualClock clock_;
  MapFiles files_{path_, true, path_};
  TimeNs period_ns_ = kPeriod;
};

TEST_F(MapSaverTest, BeginsWithTheSavedMap) {
  folder_.write("map", "5");
  EXPECT_TRUE(make().load().value());
  EXPECT_EQ(mapper_.keyframe_count(), 5U);
}

TEST_F(MapSaverTest, AMissingMapIsAnErrorOnlyWhereOneMustExist) {
  mapper_.on_load = [](const std::string& path) -> Status { return make_error(ErrorCode::NotFound, path + " does not exist"); };
  EXPECT_FALSE(make().load().value());
  files_.may_be_missing = false;
  EXPECT_EQ(make().load().error().code, ErrorCode::NotFound);
}

TEST_F(MapSaverTest, AMapThatCannotBeUsedIsAnErrorOfTheConfiguration) {
  for (const ErrorCode code : {ErrorCode::BadData, ErrorCode::Unsupported, ErrorCode::InvalidConfig}) {
    mapper_.on_load = [code](const std::string&) -> Status { return make_error(code, "a damaged map"); };
    const Result<bool> loaded = make().load();
    ASSERT_FALSE(loaded);
    EXPECT_EQ(loaded.error().code, ErrorCode::InvalidConfig);
    EXPECT_EQ(loaded.error().message, "a damaged map");
  }
  mapper_.on_load = [](const std::string&) -> Status { return make_error(ErrorCode::Io, "no permission"); };
  EXPECT_EQ(make().load().error().code, ErrorCode::Io);
}

TEST_F(MapSaverTest, AFolderThatCannotBeWrittenToIsFoundAtTheStart) {
  files_.save = folder_ / "missing/map";
  const Result<bool> loaded = make().load();
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::InvalidConfig);
  EXPECT_THAT(loaded.error().message, HasSubstr(files_.save));
}

TEST_F(MapSaverTest, SavesEveryPeriodWhereThereIsSomethingNew) {
  MapSaver saver = make();
  clock_.advance(2 * kPeriod);
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 0U) << "nothing is new";
  add_keyframe(saver);
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 1U);
  EXPECT_EQ(contents_of(path_), "1");
  add_keyframe(saver);
  clock_.advance(kPeriod - 1);
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 1U);
  clock_.advance(1);
  saver.save_if_due();
  EXPECT_EQ(contents_of(path_), "2");
  clock_.advance(2 * kPeriod);
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 2U);
}

TEST_F(MapSaverTest, APeriodOfZeroSavesOnRequestAndAtTheEndAlone) {
  period_ns_ = 0;
  MapSaver saver = make();
  add_keyframe(saver);
  clock_.advance(1000 * kPeriod);
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 0U);
  saver.request();
  saver.save_if_due();
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 1U);
  saver.save_at_end();
  EXPECT_EQ(report_of(saver).map_saves, 2U);
}

TEST_F(MapSaverTest, SavesNothingAtTheEndOfARunWithoutKeyframes) {
  MapSaver saver = make();
  saver.save_at_end();
  saver.request();
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves + report_of(saver).map_save_errors, 0U);
  EXPECT_FALSE(saver.newest_outcome().ok);
  EXPECT_EQ(saver.newest_outcome().served, 1U);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(MapSaverTest, AnErrorIsCountedAndTheNextPeriodTriesAgain) {
  MapSaver saver = make();
  add_keyframe(saver);
  mapper_.on_save = [](const std::string&) -> Status { return disk_full(); };
  clock_.advance(kPeriod);
  saver.save_if_due();
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_save_errors, 1U);
  EXPECT_FALSE(saver.newest_outcome().ok);
  EXPECT_EQ(saver.newest_outcome().message, disk_full().value().message);
  mapper_.on_save = [](const std::string&) { return Status{}; };
  clock_.advance(kPeriod);
  saver.save_if_due();
  EXPECT_EQ(report_of(saver).map_saves, 1U);
  EXPECT_TRUE(saver.newest_outcome().ok);
}

TEST_F(MapSaverTest, WithoutAFileToSaveToNothingIsSaved) {
  for (const MapFiles& files : {MapFiles{}, MapFiles{path_, false, ""}}) {
    files_ = files;
    MapSaver saver = make();
    add_keyframe(saver);
    saver.request();
    clock_.advance(kPeriod);
    saver.save_if_due();
    saver.save_at_end();
    EXPECT_EQ(report_of(saver).map_saves + report_of(saver).map_save_errors, 0U);
    ASSERT_FALSE(saver.can_save());
    EXPECT_THAT(saver.can_save().error().message, HasSubstr(files.load.empty() ? "map.file" : "map.mode"));
  }
}

/// The daemon's pipeline with a map's file.
class SavingPipelineTest : public ::testing::TestWithParam<Pacing> {
 protected:
  SavingPipelineTest() {
    config_.publisher.channel_prefix = "T_";
    config_.map.file = path_;
    config_.source.pacing = GetParam();
  }

  Result<std::unique_ptr<App>> make(FakeSource::Script script) {
    PipelineParts parts;
    parts.source = std::make_unique<FakeSource>(std::move(script));
    auto tracker = std::make_unique<FakeTracker>();
    tracker->keyframe_interval = 1;  // whichever frames are dropped, there is a keyframe
    parts.tracker = std::move(tracker);
    parts.mapper = std::exchange(mapper_, nullptr);
    parts.transport = std::make_unique<FakeTransport>(log_);
    return make_pipeline(config_, {}, SystemClock::instance(), std::move(parts));
  }

  void ask(std::int64_t id, std::int8_t action = map_request_t::ACTION_SAVE) {
    map_request_t request;
    request.id = id;
    request.action = action;
    log_->arrive("T_MAP_REQUEST", request);
  }

  /// The first `count` replies.
  std::vector<map_reply_t> wait_for_replies(std::size_t count) {
    const TimeNs deadline_ns = SystemClock::instance().now_ns() + kLong;
    while (SystemClock::instance().now_ns() < deadline_ns) {
      std::vector<map_reply_t> replies = log_->decoded<map_reply_t>("T_MAP_REPLY");
      if (replies.size() >= count) {
        return replies;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ADD_FAILURE() << "no reply";
    return {};
  }

  /// Delivers ten frames, then nothing until it is stopped.
  static CaptureKind ten_frames(std::uint64_t call) { return call < 10 ? CaptureKind::Frame : CaptureKind::Stopped; }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "map";
  Config config_;
  std::unique_ptr<FakeMapper> mapper_ = std::make_unique<FakeMapper>();
  std::shared_ptr<TransportLog> log_ = std::make_shared<TransportLog>();
};

/// In lockstep one thread tracks and saves.
class SavingRealtimePipelineTest : public SavingPipelineTest {};

TEST_P(SavingPipelineTest, SavesAfterTheLastKeyframe) {
  const auto app = make(FakeSource::recording(23));
  ASSERT_TRUE(app) << app.error().message;
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(kLong));
  EXPECT_EQ(contents_of(path_), std::to_string((*app)->health().map_keyframes));
  EXPECT_EQ((*app)->health().map_saves, 1U);
  (*app)->stop();
  EXPECT_EQ((*app)->health().map_saves, 1U) << "saved again without need";
}

TEST_P(SavingPipelineTest, AStopSavesToo) {
  const auto app = make(ten_frames);
  ASSERT_TRUE(app);
  ASSERT_TRUE((*app)->start());
  while ((*app)->health().map_keyframes == 0) {
    std::this_thread::yield();
  }
  (*app)->stop();
  EXPECT_EQ(contents_of(path_), std::to_string((*app)->health().map_keyframes));
}

TEST_P(SavingPipelineTest, AnswersRequestsAlsoAfterTheEndOfTheSource) {
  const auto app = make(FakeSource::recording(23));
  ASSERT_TRUE(app);
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(kLong));
  std::filesystem::remove(path_);
  ask(41);
  const std::vector<map_reply_t> replies = wait_for_replies(1);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].id, 41);
  EXPECT_TRUE(replies[0].ok) << replies[0].message;
  EXPECT_EQ(replies[0].message, path_);
  EXPECT_EQ(replies[0].keyframes, static_cast<std::int64_t>((*app)->health().map_keyframes));
  EXPECT_EQ(replies[0].landmarks, 7 * replies[0].keyframes);
  EXPECT_EQ(replies[0].bytes, static_cast<std::int64_t>(contents_of(path_).size()));
  EXPECT_GT(replies[0].utime, 0);
  (*app)->stop();
}

TEST_P(SavingPipelineTest, TheReplySaysWhatWentWrong) {
  mapper_->on_save = [](const std::string&) -> Status { return disk_full(); };
  const auto app = make(FakeSource::recording(5));
  ASSERT_TRUE(app);
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(kLong));
  ask(1);
  ask(2, 77);
  const std::vector<map_reply_t> replies = wait_for_replies(2);
  ASSERT_EQ(replies.size(), 2U);
  for (const map_reply_t& reply : replies) {
    EXPECT_FALSE(reply.ok);
    EXPECT_THAT(reply.message, HasSubstr(reply.id == 1 ? "No space left" : "action 77 is unknown"));
  }
  EXPECT_GE((*app)->health().map_save_errors, 2U) << "at the end and on request";
  (*app)->stop();
}

TEST_P(SavingPipelineTest, ARequestFromTheSupervisorWakesTheMapper) {
  const auto app = make(FakeSource::recording(5));
  ASSERT_TRUE(app);
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(kLong));
  ASSERT_TRUE((*app)->request_map_save());
  while ((*app)->health().map_saves < 2) {
    std::this_thread::yield();
  }
  (*app)->stop();
}

TEST_P(SavingRealtimePipelineTest, SavingLeavesTheTrackerAlone) {
  std::atomic<bool> saving{false};
  std::atomic<bool> go_on{false};
  mapper_->on_save = [&](const std::string&) {
    saving = true;
    while (!go_on) {
      std::this_thread::yield();
    }
    return Status{};
  };
  const auto app = make([](std::uint64_t) { return CaptureKind::Frame; });
  ASSERT_TRUE(app);
  ASSERT_TRUE((*app)->start());
  while ((*app)->health().map_keyframes == 0) {
    std::this_thread::yield();
  }
  ASSERT_TRUE((*app)->request_map_save());
  while (!saving) {
    std::this_thread::yield();
  }
  const std::uint64_t tracked = (*app)->health().frames_tracked;
  while ((*app)->health().frames_tracked < tracked + 50) {  // hangs, and times out, where the tracker waits
    std::this_thread::yield();
  }
  go_on = true;
  (*app)->stop();
}

TEST_P(SavingPipelineTest, TheTrackerSeesALoadedMapFromTheFirstFrame) {
  folder_.write("map", "12");
  const auto app = make(FakeSource::recording(1));
  ASSERT_TRUE(app);
  EXPECT_EQ((*app)->health().map_keyframes, 12U);
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(kLong));
  (*app)->stop();
  EXPECT_EQ(log_->decoded<pose_t>("T_POSE").at(0).map_version, 12);
}

TEST_P(SavingPipelineTest, AMapThatCannotBeUsedStopsThePipelineBeforeItStarts) {
  folder_.write("map", "precious");
  mapper_->on_load = [](const std::string&) -> Status { return make_error(ErrorCode::BadData, "damaged"); };
  const auto app = make(FakeSource::recording(1));
  ASSERT_FALSE(app);
  EXPECT_EQ(app.error().code, ErrorCode::InvalidConfig);
  EXPECT_EQ(contents_of(path_), "precious");
}

TEST_P(SavingPipelineTest, LocalizationNeverSaves) {
  folder_.write("map", "12");
  config_.map.mode = MapMode::Localization;
  const auto app = make(FakeSource::recording(23));
  ASSERT_TRUE(app);
  ASSERT_TRUE((*app)->start());
  ASSERT_TRUE((*app)->wait_finished(kLong));
  EXPECT_FALSE((*app)->request_map_save());
  ask(3);
  const std::vector<map_reply_t> replies = wait_for_replies(1);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_FALSE(replies[0].ok);
  EXPECT_THAT(replies[0].message, HasSubstr("localization"));
  (*app)->stop();
  EXPECT_EQ(contents_of(path_), "12");
}

INSTANTIATE_TEST_SUITE_P(Pacings, SavingPipelineTest, ::testing::Values(Pacing::Realtime, Pacing::Lockstep),
                         [](const auto& instance) { return instance.param == Pacing::Realtime ? "Realtime" : "Lockstep"; });

INSTANTIATE_TEST_SUITE_P(Pacings, SavingRealtimePipelineTest, ::testing::Values(Pacing::Realtime));

}  // namespace
}  // namespace posed
