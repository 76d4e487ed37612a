#include "core/thread.h"

#include <atomic>
#include <cstring>
#include <pthread.h>
#include <sched.h>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/wake_event.h"

namespace posed {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Result of `body` run on a thread of its own, so that what it changes about its thread ends with it.
template <typename Body>
auto on_own_thread(Body body) {
  decltype(body()) result{};
  std::thread([&] { result = body(); }).join();
  return result;
}

int policy_of_this_thread() {
  int policy = -1;
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &policy, &parameters);
  return policy;
}

int any_allowed_cpu() {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof(set), &set);
  int cpu = 0;
  while (CPU_ISSET(static_cast<std::size_t>(cpu), &set) == 0) {
    ++cpu;
  }
  return cpu;
}

TEST(NamedThread, ShowsItsNameToTheKernelAndToItself) {
  std::string kernel;
  std::string own;
  NamedThread thread({.name = "tracker"}, [&](std::stop_token) {
    char name[16] = "";
    pthread_getname_np(pthread_self(), name, sizeof(name));
    kernel = name;
    own = current_thread_name();
  });
  thread.join();
  EXPECT_EQ(kernel, "tracker");
  EXPECT_EQ(own, "tracker");
  EXPECT_STREQ(current_thread_name(), "");  // this one was not made by NamedThread
}

TEST(NamedThread, CutsALongNameToWhatTheKernelKeeps) {
  std::string own;
  NamedThread({.name = "a-name-of-more-than-15-characters"}, [&](std::stop_token) { own = current_thread_name(); }).join();
  EXPECT_EQ(own, "a-name-of-more-");
}

TEST(NamedThread, AsksItsBodyToStopAndJoinsWhenDestroyed) {
  std::atomic<bool> ended{false};
  {
    const NamedThread thread({.name = "waits"}, [&](std::stop_token stop) {
      WakeEvent event;
      const std::uint32_t seen = event.generation();
      const std::stop_callback wake(stop, [&] { event.notify(); });
      while (!stop.stop_requested()) {
        event.wait(seen, kNsPerSecond);
      }
      ended = true;
    });
  }
  EXPECT_TRUE(ended);
}

TEST(NamedThread, CanBeMovedAndJoinedTwice) {
  NamedThread thread;
  EXPECT_FALSE(thread.joinable());
  thread.join();
  std::atomic<int> runs{0};
  thread = NamedThread({.name = "moved"}, [&](std::stop_token) { ++runs; });
  EXPECT_TRUE(thread.joinable());
  thread.request_stop();
  thread.join();
  thread.join();
  EXPECT_FALSE(thread.joinable());
  EXPECT_EQ(runs, 1);
}

TEST(NamedThread, RunsItsBodyEvenWhereTheSystemRefusesItsOptions) {
  std::atomic<bool> ran{false};
  testing::internal::CaptureStderr();
  NamedThread({.name = "eager", .policy = SchedulingPolicy::Fifo, .priority = 1000}, [&](std::stop_token) { ran = true; }).join();
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(ran);
  EXPECT_THAT(log, HasSubstr("warning: thread eager: refused by the system: SCHED_FIFO priority 1000"));
}

TEST(ThreadOptions, WithoutWishesAreAlwaysGranted) {
  EXPECT_TRUE(on_own_thread([] { return apply_thread_options({.name = "plain"}); }));
}

TEST(ThreadOptions, NameWhatWasRefused) {
  // Priority 1000 and processor 100,000 exist nowhere, so no privilege changes the outcome.
  const Status status = on_own_thread([] {
    return apply_thread_options({.name = "eager", .policy = SchedulingPolicy::Fifo, .priority = 1000, .cpus = {0, 100'000}});
  });
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Unavailable);
  EXPECT_THAT(status.error().message, HasSubstr("thread eager"));
  EXPECT_THAT(status.error().message, HasSubstr("SCHED_FIFO priority 1000 (Invalid argument)"));
  EXPECT_THAT(status.error().message, HasSubstr("processors 0,100000 (Invalid argument)"));
}

TEST(ThreadOptions, RefuseAProcessorThatDoesNotExistRatherThanLeaveItOut) {
  for (const int cpu : {-1, CPU_SETSIZE}) {
    const Status status = on_own_thread([&] { return apply_thread_options({.name = "t", .cpus = {any_allowed_cpu(), cpu}}); });
    ASSERT_FALSE(status);
    EXPECT_THAT(status.error().message, HasSubstr(std::to_string(cpu)));
    EXPECT_THAT(status.error().message, Not(HasSubstr("SCHED")));
  }
}

TEST(ThreadOptions, BindToProcessors) {
  const int cpu = any_allowed_cpu();
  const bool bound = on_own_thread([&] {
    if (!apply_thread_options({.name = "bound", .cpus = {cpu}})) {
      return false;
    }
    cpu_set_t set;
    CPU_ZERO(&set);
    pthread_getaffinity_np(pthread_self(), sizeof(set), &set);
    return CPU_COUNT(&set) == 1 && CPU_ISSET(static_cast<std::size_t>(cpu), &set) != 0;
  });
  EXPECT_TRUE(bound);
}

TEST(ThreadOptions, FifoIsGrantedOrRefusedWithAReason) {
  int policy = SCHED_OTHER;
  const Status status = on_own_thread([&] {
    Status applied = apply_thread_options({.name = "fifo", .policy = SchedulingPolicy::Fifo, .priority = 1});
    policy = policy_of_this_thread();
    return applied;
  });
  if (status) {
    EXPECT_EQ(policy, SCHED_FIFO);
  } else {
    EXPECT_EQ(policy, SCHED_OTHER);
    EXPECT_THAT(status.error().message, HasSubstr("SCHED_FIFO priority 1 ("));
  }
}

TEST(ThreadOptions, DeadlineIsGrantedOrRefusedWithAReason) {
  constexpr int kDeadlinePolicy = 6;  // SCHED_DEADLINE
  int policy = SCHED_OTHER;
  const Status status = on_own_thread([&] {
    Status applied = apply_thread_options(
        {.name = "slices", .policy = SchedulingPolicy::Deadline, .runtime_ns = 5 * kNsPerMs, .period_ns = 100 * kNsPerMs});
    policy = sched_getscheduler(0) & 0xFF;  // without SCHED_RESET_ON_FORK
    return applied;
  });
  if (status) {
    EXPECT_EQ(policy, kDeadlinePolicy);
  } else {
    EXPECT_EQ(policy, SCHED_OTHER);
    EXPECT_THAT(status.error().message, HasSubstr("SCHED_DEADLINE 5.0 of 100.0 ms ("));
  }
}

TEST(ThreadOptions, NormalIsNotInheritedFromARealTimeThread) {
  int inner_policy = -1;
  const bool real_time = on_own_thread([&] {
    if (!apply_thread_options({.name = "outer", .policy = SchedulingPolicy::Fifo, .priority = 1})) {
      return false;
    }
    NamedThread({.name = "inner"}, [&](std::stop_token) { inner_policy = policy_of_this_thread(); }).join();
    return true;
  });
  if (!real_time) {
    GTEST_SKIP() << "needs the privilege to use SCHED_FIFO (CAP_SYS_NICE or RLIMIT_RTPRIO)";
  }
  EXPECT_EQ(inner_policy, SCHED_OTHER);
}

}  // namespace
}  // namespace posed
