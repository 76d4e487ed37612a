// Poses through the publisher's own thread and real UDP multicast, with ttl 0, to a subscriber in another process.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>

#include "core/thread.h"
#include "daemon/message_transport.h"
#include "daemon/publish_stage.h"
#include "tests/system/network_namespace.h"

namespace posed {
namespace {

constexpr std::uint64_t kPoses = 10'000;
constexpr TimeNs kPeriodNs = kNsPerMs;
constexpr TimeNs kLongestCatchUpNs = 20 * kNsPerMs;
constexpr const char* kChannel = "POSED_POSE";

/// LCM's default group on a port of this process's own, so that nothing else on the machine is heard.
std::string test_url() {
  return "udpm://239.255.76.67:" + std::to_string(20'000 + getpid() % 20'000) + "?ttl=0";
}

class Subscriber {
 public:
  explicit Subscriber(const std::string& url)
      : pipe_(popen((std::string(POSED_SUBSCRIBER) + " '" + url + "' " + kChannel + " " + std::to_string(kPoses)).c_str(), "r")) {}
  ~Subscriber() {
    if (pipe_ != nullptr) {
      pclose(pipe_);
    }
  }

  /// The next line it prints, "" at its end.
  std::string line() {
    std::array<char, 256> buffer{};
    if (pipe_ == nullptr || std::fgets(buffer.data(), buffer.size(), pipe_) == nullptr) {
      return {};
    }
    std::string text(buffer.data());
    text.erase(std::remove(text.begin(), text.end(), '\n'), text.end());
    return text;
  }

 private:
  FILE* pipe_;
};

/// One a period; where the machine stood still for long, the schedule moves on instead of catching up in a burst, which no
/// subscriber asked for.
void publish_paced(EstimateLink& link, const Clock& clock) {
  TimeNs due_ns = clock.now_ns();
  PoseEstimate estimate;
  estimate.state = TrackingState::Tracking;
  for (estimate.sequence = 0; estimate.sequence < kPoses; ++estimate.sequence) {
    clock.sleep_until(due_ns);
    estimate.capture_ns = clock.now_ns();
    ASSERT_FALSE(link.ring.push(estimate)) << "the publisher's queue ran over";
    link.notify_arrived();
    due_ns = std::max(due_ns + kPeriodNs, clock.now_ns() - kLongestCatchUpNs);
  }
  link.close();
}

TEST(LcmDelivery, TenThousandPosesAtOneKilohertzAllArriveInAnotherProcess) {
  if (const Status entered = enter_multicast_namespace(); !entered) {
    std::printf("%s; using the machine's own network\n", entered.error().message.c_str());
    if (const Status opened = LcmTransport(test_url()).open(); !opened) {
      GTEST_SKIP() << opened.error().message;
    }
  }
  const std::string url = test_url();
  Subscriber subscriber(url);
  ASSERT_EQ(subscriber.line(), "ready");

  const SystemClock& clock = SystemClock::instance();
  EstimateLink link(64);
  DetectionsLink detections(1);
  detections.close();
  PublishStage stage({link, detections},
                     std::make_unique<Publisher>(PublisherConfig{.url = url}, Se3(), std::make_unique<LcmTransport>(url), clock,
                                                 [] { return HealthReport{}; }),
                     {}, clock);
  std::atomic<bool> drained{false};
  WakeEvent drained_event;
  ThreadOptions thread_options;
  thread_options.name = "publisher";
  NamedThread publisher(thread_options, [&](const std::stop_token& stop) {
    stage.run(stop, [&] {
      drained = true;
      drained_event.notify();
    });
  });
  const TimeNs begin_ns = clock.now_ns();
  publish_paced(link, clock);
  const double rate_hz = static_cast<double>(kPoses) / to_seconds(clock.now_ns() - begin_ns);
  while (!drained) {
    const std::uint32_t seen = drained_event.generation();
    if (!drained) {
      drained_event.wait(seen, kNsPerSecond);
    }
  }

  EXPECT_EQ(subscriber.line(), "received 10000 missing 0 disordered 0");
  publisher.request_stop();
  link.wake_all();
  publisher.join();
  HealthReport health;
  stage.report(health);
  EXPECT_EQ(health.poses_published, kPoses);
  EXPECT_EQ(health.publish_errors, 0U);
  std::printf("%.0f Hz; capture to publish: p50 %.3f ms, p99 %.3f ms, max %.3f ms\n", rate_hz, health.latency.p50_ms,
              health.latency.p99_ms, health.latency.max_ms);
}

}  // namespace
}  // namespace posed
