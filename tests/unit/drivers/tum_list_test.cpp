#include "drivers/tum_list.h"

#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::int64_t> stamps(const TumList& list) {
  std::vector<std::int64_t> result;
  for (const TumListEntry& entry : list.entries) {
    result.push_back(entry.stamp_ns);
  }
  return result;
}

TEST(Stamp, IsExact) {
  // 1305031102.175304001 has no double: the nearest one is 48 ns away.
  EXPECT_EQ(parse_stamp("1305031102.175304001"), 1305031102175304001);
  EXPECT_EQ(parse_stamp("1305031102.175304"), 1305031102175304000);
  EXPECT_EQ(parse_stamp("1305031102"), 1305031102000000000);
  EXPECT_EQ(parse_stamp("7."), 7000000000);
  EXPECT_EQ(parse_stamp("0.000000001"), 1);
  EXPECT_EQ(parse_stamp("0"), 0);
  EXPECT_EQ(parse_stamp("1.0000000004999"), 1000000000);
  EXPECT_EQ(parse_stamp("1.0000000005"), 1000000001);
  EXPECT_EQ(parse_stamp("1.9999999999"), 2000000000);
  EXPECT_EQ(parse_stamp("00012.5"), 12500000000);
}

TEST(Stamp, RefusesWhatIsNoNumberOfSeconds) {
  for (const char* text : {"", ".", ".5", "-1", "+1", "1e9", "1.2.3", "1,5", "0x10", "nan", "inf", "1305031102.17a", " 1"}) {
    const Result<std::int64_t> stamp = parse_stamp(text);
    ASSERT_FALSE(stamp) << "'" << text << "'";
    EXPECT_THAT(stamp.error().message, HasSubstr("not a number of seconds"));
  }
  EXPECT_THAT(parse_stamp("9223372036").error().message, HasSubstr("larger than"));
  EXPECT_FALSE(parse_stamp("99999999999999999999999999999"));
  EXPECT_EQ(parse_stamp("9223372035.9999999999"), 9223372036000000000);
}

TEST(Stamp, TextAndNanosecondsAreInverse) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> any(0, 9'000'000'000'000'000'000);
  for (int i = 0; i < 10'000; ++i) {
    const std::int64_t stamp_ns = any(random);
    ASSERT_EQ(parse_stamp(format_stamp(stamp_ns)), stamp_ns);
  }
  EXPECT_EQ(format_stamp(1305031102000000007), "1305031102.000000007");
}

TEST(TumList, ReadsWhatTheLayoutAllows) {
  const Result<TumList> list = parse_tum_list(
      "\xef\xbb\xbf# color images\r\n"
      "# timestamp filename\r\n"
      "\r\n"
      "1.5 rgb/1.png\r\n"
      "\t2.5\t rgb/2.png \n"
      "   # a comment\n"
      "3.5,rgb/3.png",
      "rgb.txt");
  ASSERT_TRUE(list) << list.error().message;
  EXPECT_THAT(stamps(*list), ElementsAre(1500000000, 2500000000, 3500000000));
  EXPECT_EQ(list->entries[0].image, "rgb/1.png");
  EXPECT_EQ(list->entries[1].image, "rgb/2.png");
  EXPECT_EQ(list->entries[2].image, "rgb/3.png");
  EXPECT_EQ(list->entries[0].line, 4);
  EXPECT_EQ(list->entries[2].line, 7);
  EXPECT_TRUE(list->skipped_lines.empty());
  EXPECT_EQ(list->unsorted, "");
}

TEST(TumList, MalformedLinesAreSkippedWithFileAndLine) {
  const Result<TumList> list = parse_tum_list("1 a\n2\nx b\n3 a b\n4 c\n-5 d\n", "seq/rgb.txt");
  ASSERT_TRUE(list);
  EXPECT_THAT(stamps(*list), ElementsAre(1000000000, 4000000000));
  ASSERT_EQ(list->skipped_lines.size(), 4U);
  EXPECT_EQ(list->skipped_lines[0].message, "seq/rgb.txt:2: 1 fields where 'stamp image' is expected: '2'");
  EXPECT_THAT(list->skipped_lines[1].message, HasSubstr("seq/rgb.txt:3: stamp 'x' is not a number"));
  EXPECT_THAT(list->skipped_lines[2].message, HasSubstr("seq/rgb.txt:4: 3 fields"));
  EXPECT_THAT(list->skipped_lines[3].message, HasSubstr("seq/rgb.txt:6: stamp '-5'"));
}

TEST(TumList, MessagesQuoteNoControlCharactersAndNoLongLines) {
  const Result<TumList> list = parse_tum_list("1 a\n\x1b[31m\n" + std::string(5000, 'y') + "\n", "rgb.txt");
  ASSERT_TRUE(list);
  ASSERT_EQ(list->skipped_lines.size(), 2U);
  EXPECT_THAT(list->skipped_lines[0].message, HasSubstr("'?[31m'"));
  EXPECT_LT(list->skipped_lines[1].message.size(), 200U);
}

TEST(TumList, AnUnsortedListIsSortedAndTheFirstLineNamed) {
  const Result<TumList> list = parse_tum_list("# h\n2 b\n4 d\n1 a\n3 c\n", "rgb.txt");
  ASSERT_TRUE(list);
  EXPECT_THAT(stamps(*list), ElementsAre(1000000000, 2000000000, 3000000000, 4000000000));
  EXPECT_THAT(list->unsorted, HasSubstr("rgb.txt:4: stamp 1.000000000 is earlier"));
  EXPECT_TRUE(list->skipped_lines.empty()) << "no image is lost";
}

TEST(TumList, ARepeatedStampIsSkippedAndTheFirstKept) {
  const Result<TumList> list = parse_tum_list("1 a\n2 b\n1.000 c\n2.0 d\n3 e\n", "depth.txt");
  ASSERT_TRUE(list);
  EXPECT_THAT(stamps(*list), ElementsAre(1000000000, 2000000000, 3000000000));
  EXPECT_EQ(list->entries[0].image, "a");
  ASSERT_EQ(list->skipped_lines.size(), 2U);
  EXPECT_EQ(list->skipped_lines[0].message, "depth.txt:3: stamp 1.000000000 stands already in line 1; this line is left out");
}

TEST(TumList, AListWithoutImagesIsAnError) {
  for (const char* text : {"", "# only a comment\n", "\r\n\r\n"}) {
    const Result<TumList> list = parse_tum_list(text, "rgb.txt");
    ASSERT_FALSE(list);
    EXPECT_EQ(list.error().code, ErrorCode::BadData);
    EXPECT_EQ(list.error().message, "rgb.txt: the list names no image");
  }
  EXPECT_THAT(parse_tum_list("nonsense\n", "rgb.txt").error().message, HasSubstr("first bad line: rgb.txt:1:"));
}

TEST(TumList, AnotherKindOfFileIsRefused) {
  std::string text = "1 a\n";
  for (int i = 0; i < 1001; ++i) {
    text += "x\n";
  }
  const Result<TumList> list = parse_tum_list(text, "rgb.txt");
  ASSERT_FALSE(list);
  EXPECT_THAT(list.error().message, HasSubstr("1001 malformed or repeated lines, the first: rgb.txt:2:"));
}

TEST(TumAssociations, EitherImageMayComeFirst) {
  const Result<TumAssociationList> list = parse_tum_associations(
      "# comment\r\n"
      "1.0 rgb/1.png 1.01 depth/1.png\r\n"
      "2.01 depth/2.png 2.0 rgb/2.png\n"
      "3.0 a.png 3.01 b.png\n",
      "associations.txt");
  ASSERT_TRUE(list) << list.error().message;
  ASSERT_EQ(list->entries.size(), 3U);
  EXPECT_EQ(list->entries[0].color.image, "rgb/1.png");
  EXPECT_EQ(list->entries[0].depth.stamp_ns, 1010000000);
  EXPECT_EQ(list->entries[1].color.image, "rgb/2.png");
  EXPECT_EQ(list->entries[1].color.stamp_ns, 2000000000);
  EXPECT_EQ(list->entries[1].depth.image, "depth/2.png");
  EXPECT_EQ(list->entries[2].color.image, "a.png") << "colour first unless the folders say otherwise";
  EXPECT_EQ(list->entries[1].color.line, 3);
}

TEST(TumAssociations, BadLinesAreSkipped) {
  const Result<TumAssociationList> list = parse_tum_associations("1 a 1 b\n2 c 2\n1 d 3 e\n0.5 f 0.5 g\n4 h x i\n", "as.txt");
  ASSERT_TRUE(list);
  ASSERT_EQ(list->entries.size(), 2U);
  EXPECT_EQ(list->entries[0].color.image, "f");
  EXPECT_THAT(list->unsorted, HasSubstr("as.txt:4:"));
  ASSERT_EQ(list->skipped_lines.size(), 3U);
  EXPECT_THAT(list->skipped_lines[0].message, HasSubstr("as.txt:2: 3 fields where 'stamp image stamp image'"));
  EXPECT_THAT(list->skipped_lines[1].message, HasSubstr("as.txt:3: stamp 1.000000000 stands already in line 1"));
  EXPECT_THAT(list->skipped_lines[2].message, HasSubstr("as.txt:5: stamp 'x'"));
}

}  // namespace
}  // namespace posed
