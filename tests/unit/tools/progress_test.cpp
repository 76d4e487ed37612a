#include "tools/posectl/progress.h"

#include <algorithm>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using testing::HasSubstr;
using Style = ProgressReporter::Style;

TEST(FormatProgress, ShowsBarShareRateAndTimeLeft) {
  EXPECT_EQ(format_progress({240, 480, 8 * kNsPerSecond}), "[###############...............] 240/480  50 %  30.0 Hz  8 s left");
  EXPECT_EQ(format_progress({480, 480, 16 * kNsPerSecond}), "[##############################] 480/480  100 %  30.0 Hz");
  EXPECT_EQ(format_progress({0, 480, 0}), "[..............................] 0/480  0 %  0.0 Hz");
}

TEST(FormatProgress, StaysWithinTheBarWhenMoreIsDoneThanWasKnown) {
  EXPECT_THAT(format_progress({500, 480, kNsPerSecond}), HasSubstr("480/480  100 %"));
}

TEST(FormatProgress, CountsWhereTheTotalIsUnknown) {
  EXPECT_EQ(format_progress({90, 0, 3 * kNsPerSecond}), "90 frames  30.0 Hz");
}

TEST(ProgressReporter, PrintsALineEachTenthWhereThereIsNoTerminal) {
  std::ostringstream err;
  ProgressReporter progress(err, Style::Lines, "replay", 100, 0);
  for (int i = 0; i <= 100; ++i) {
    progress.update(static_cast<std::uint64_t>(i), i * kNsPerMs);
  }
  progress.finish(100, 101 * kNsPerMs);
  const std::string text = err.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
  EXPECT_TRUE(text.starts_with("replay [###"));
  EXPECT_THAT(text, HasSubstr("100/100"));
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(ProgressReporter, RedrawsOneLineOnATerminalAtMostTenTimesASecond) {
  std::ostringstream err;
  ProgressReporter progress(err, Style::Bar, "replay", 1000, 0);
  for (int i = 0; i < 1000; ++i) {
    progress.update(static_cast<std::uint64_t>(i), i * kNsPerMs);
  }
  progress.finish(1000, kNsPerSecond);
  const std::string text = err.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 11);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_TRUE(text.ends_with("1000/1000  100 %  1000.0 Hz\x1b[K\n"));
}

TEST(ProgressReporter, IsSilentWhereQuietIsAskedFor) {
  std::ostringstream err;
  ProgressReporter progress(err, Style::Quiet, "replay", 10, 0);
  progress.update(5, 1);
  progress.finish(10, 2);
  EXPECT_EQ(err.str(), "");
}

TEST(ProgressStyle, QuietComesBeforeTheTerminal) {
  EXPECT_EQ(progress_style(true, true), Style::Quiet);
  EXPECT_EQ(progress_style(true, false), Style::Bar);
  EXPECT_EQ(progress_style(false, false), Style::Lines);
}

}  // namespace
}  // namespace posed
