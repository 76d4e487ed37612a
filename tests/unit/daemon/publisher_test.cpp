#include "daemon/publisher.h"

#include <cstdint>
#include <fcntl.h>
#include <memory>
#include <span>
#include <string>
#include <unistd.h>
#include <vector>

#include <bot_core/pose_t.hpp>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <posed/pose_t.hpp>
#include <posed/status_t.hpp>
#include <sys/resource.h>

#include "tests/unit/daemon/fake_transport.h"
#include "tests/unit/daemon/fakes.h"

namespace posed {
namespace {

class PublisherTest : public ::testing::Test {
 protected:
  Publisher make() {
    return Publisher(config_, Se3(), std::make_unique<FakeTransport>(log_), clock_, [this] { return health_; });
  }

  static PoseEstimate estimate(std::uint64_t sequence, TrackingState state = TrackingState::Tracking) {
    PoseEstimate made;
    made.sequence = sequence;
    made.state = state;
    return made;
  }

  static HealthReport report_of(const Publisher& publisher) {
    HealthReport health;
    publisher.report(health);
    return health;
  }

  std::vector<pose_t> poses() { return log_->decoded<pose_t>("T_POSE"); }
  std::vector<status_t> statuses() { return log_->decoded<status_t>("T_STATUS"); }

  PublisherConfig config_{.channel_prefix = "T_", .status_period_s = 1.0, .retry_period_s = 5.0};
  ManualClock clock_;
  HealthReport health_;
  std::shared_ptr<TransportLog> log_ = std::make_shared<TransportLog>();
};

TEST_F(PublisherTest, SendsEveryEstimateInOrderWithItsStamp) {
  Publisher publisher = make();
  publisher.do_due_work();
  for (std::uint64_t i = 0; i < 5; ++i) {
    publisher.publish(estimate(i, i == 3 ? TrackingState::Lost : TrackingState::Tracking), static_cast<TimeNs>(100 + i));
  }
  const std::vector<pose_t> sent = poses();
  ASSERT_EQ(sent.size(), 5U);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].sequence, static_cast<std::int64_t>(i));
    EXPECT_EQ(sent[i].publish_mono_ns, static_cast<std::int64_t>(100 + i));
    EXPECT_EQ(sent[i].has_pose != 0, i != 3);
  }
  EXPECT_EQ(report_of(publisher).poses_published, 5U);
  EXPECT_EQ(report_of(publisher).publish_errors, 0U);
  EXPECT_TRUE(report_of(publisher).transport_up);
}

TEST_F(PublisherTest, SendsTheBotCorePoseWhereConfiguredAndOnlyWithAPose) {
  Publisher without = make();
  without.do_due_work();
  without.publish(estimate(0), 0);
  EXPECT_TRUE(log_->decoded<bot_core::pose_t>("T_BOT_POSE").empty());

  config_.bot_core_pose = true;
  Publisher with = make();
  with.do_due_work();
  with.publish(estimate(1), 0);
  with.publish(estimate(2, TrackingState::Lost), 0);
  EXPECT_EQ(log_->decoded<bot_core::pose_t>("T_BOT_POSE").size(), 1U);
}

TEST_F(PublisherTest, SendsAStatusEveryPeriod) {
  health_.frames_captured = 12;
  Publisher publisher = make();
  EXPECT_EQ(publisher.do_due_work(), clock_.now_ns() + kNsPerSecond);
  ASSERT_EQ(statuses().size(), 1U);
  EXPECT_EQ(statuses()[0].frames_captured, 12);
  EXPECT_EQ(statuses()[0].transport, "fake://");
  EXPECT_FALSE(statuses()[0].version.empty());
  EXPECT_EQ(statuses()[0].utime, (clock_.now_ns() + ManualClock::kUtcOffsetNs) / kNsPerUs);

  clock_.advance(kNsPerSecond - 1);
  publisher.do_due_work();
  EXPECT_EQ(statuses().size(), 1U);
  clock_.advance(1);
  publisher.do_due_work();
  EXPECT_EQ(statuses().size(), 2U);
}

TEST_F(PublisherTest, RetriesATransportThatCannotStart) {
  log_->opens_to_refuse = 2;
  Publisher publisher = make();
  publisher.do_due_work();
  publisher.publish(estimate(0), 0);
  EXPECT_FALSE(report_of(publisher).transport_up);
  EXPECT_EQ(report_of(publisher).poses_published, 0U);
  EXPECT_EQ(report_of(publisher).publish_errors, 2U);  // the status and the pose

  clock_.advance(5 * kNsPerSecond - 1);
  publisher.do_due_work();
  EXPECT_EQ(log_->opens, 1);  // not before its time
  clock_.advance(1);
  publisher.do_due_work();
  EXPECT_EQ(log_->opens, 2);
  EXPECT_FALSE(report_of(publisher).transport_up);
  clock_.advance(5 * kNsPerSecond);
  publisher.do_due_work();
  EXPECT_EQ(log_->opens, 3);
  EXPECT_TRUE(report_of(publisher).transport_up);

  publisher.publish(estimate(1), 0);
  ASSERT_EQ(poses().size(), 1U);
  EXPECT_EQ(poses()[0].sequence, 1);
}

TEST_F(PublisherTest, WakesForTheRetryWhereThatComesBeforeTheStatus) {
  config_.status_period_s = 60.0;
  log_->opens_to_refuse = 1;
  Publisher publisher = make();
  EXPECT_EQ(publisher.do_due_work(), clock_.now_ns() + 5 * kNsPerSecond);
}

TEST_F(PublisherTest, CountsRefusedMessagesAndGoesOn) {
  Publisher publisher = make();
  publisher.do_due_work();
  log_->refuse_sends = true;
  publisher.publish(estimate(0), 0);
  publisher.publish(estimate(1), 0);
  EXPECT_EQ(report_of(publisher).publish_errors, 2U);
  EXPECT_FALSE(report_of(publisher).transport_up);
  log_->refuse_sends = false;
  publisher.publish(estimate(2), 0);
  EXPECT_TRUE(report_of(publisher).transport_up);
  EXPECT_EQ(report_of(publisher).poses_published, 1U);
  EXPECT_EQ(log_->opens, 1);  // a socket without a connection needs no new start
}

TEST(LcmTransport, SaysHowToMendAnUnusableUrl) {
  LcmTransport transport("nonsense://");
  const Status opened = transport.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::Unavailable);
  EXPECT_NE(opened.error().message.find("nonsense://"), std::string::npos);
  EXPECT_NE(opened.error().message.find("publisher.url"), std::string::npos);
}

TEST(LcmTransport, WithoutDescriptorsClosesNobodyElses) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const int free_one = ::dup(0);
  ASSERT_GE(free_one, 0) << "the test needs a standard input";
  ::close(free_one);
  rlimit none = before;
  none.rlim_cur = static_cast<rlim_t>(free_one);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  LcmTransport transport("udpm://239.255.76.67:7667?ttl=0");
  const Status opened = transport.open();
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("pipe"), std::string::npos) << opened.error().message;
  EXPECT_GE(::fcntl(0, F_GETFD), 0) << "the standard input was closed";
}

TEST(LcmTransport, DeliversWithinTheProcessOverMemq) {
  auto owned = std::make_unique<LcmTransport>("memq://");
  LcmTransport& transport = *owned;
  ManualClock clock;
  Publisher publisher(PublisherConfig{.channel_prefix = "T_"}, Se3(), std::move(owned), clock, [] { return HealthReport{}; });
  publisher.do_due_work();
  ASSERT_NE(transport.handle(), nullptr);

  struct Receiver {
    std::vector<std::int64_t> sequences;
    // Not a member: gcc 12 with its sanitizers miscompiles the member pointer that lcm-cpp keeps.
    static void on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* message, Receiver* self) {
      self->sequences.push_back(message->sequence);
    }
  } receiver;
  transport.handle()->subscribeFunction("T_POSE", &Receiver::on_pose, &receiver);
  PoseEstimate estimate;
  for (estimate.sequence = 0; estimate.sequence < 3; ++estimate.sequence) {
    publisher.publish(estimate, 0);
    ASSERT_GT(transport.handle()->handleTimeout(1000), 0);
  }
  EXPECT_EQ(receiver.sequences, (std::vector<std::int64_t>{0, 1, 2}));
}

TEST(LcmTransport, HandsOnWhatItIsSubscribedTo) {
  LcmTransport transport("memq://");
  std::vector<std::string> received;
  transport.subscribe("T_ASK",
                      [&](std::span<const std::uint8_t> message) { received.emplace_back(message.begin(), message.end()); });
  ASSERT_TRUE(transport.open());
  transport.receive();
  EXPECT_TRUE(received.empty());
  for (const std::string channel : {"T_ASK", "T_OTHER", "XT_ASK"}) {
    const std::string text = "to " + channel;
    ASSERT_TRUE(transport.send(channel, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  }
  transport.receive();
  EXPECT_EQ(received, std::vector<std::string>{"to T_ASK"});
}

}  // namespace
}  // namespace posed
