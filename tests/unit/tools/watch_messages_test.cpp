#include "tools/posectl/watch_messages.h"

#include <gtest/gtest.h>

#include "daemon/message_conversion.h"

namespace posed {
namespace {

TEST(WatchMessages, TheStatusTellsOfPausesAndLines) {
  HealthReport sent;
  sent.paused = true;
  sent.frames_captured = 1;
  sent.frames_paused = 2;
  sent.gpio = {.ok = false, .trigger_pulses = 3, .trigger_missed = 4, .worst_trigger_lateness_ns = 5};
  const HealthReport received = from_status_message(to_status_message(sent, {}));
  EXPECT_TRUE(received.paused);
  EXPECT_EQ(received.frames_captured, 1U);
  EXPECT_EQ(received.frames_paused, 2U);
  EXPECT_EQ(received.gpio, sent.gpio);

  const HealthReport quiet = from_status_message(to_status_message(HealthReport{}, {}));
  EXPECT_FALSE(quiet.paused);
  EXPECT_TRUE(quiet.gpio.ok);
}

}  // namespace
}  // namespace posed
