#include "config/toml_document.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

const TomlEntry* find(const std::vector<TomlEntry>& entries, std::string_view key) {
  for (const TomlEntry& entry : entries) {
    if (entry.key == key) {
      return &entry;
    }
  }
  return nullptr;
}

TEST(TomlDocument, ListsTablesAndValuesWithPositions) {
  const auto entries = read_toml("top = true\n[a.b]\n  integer = 3 # comment\nreal = 2.5\ntext = 'x'\nlist = [1,\n 2.0]\n");
  ASSERT_TRUE(entries);
  ASSERT_EQ(entries->size(), 7U);
  EXPECT_TRUE(std::get<bool>(find(*entries, "top")->value.data));
  EXPECT_TRUE(std::holds_alternative<TomlTable>(find(*entries, "a")->value.data));
  EXPECT_TRUE(std::holds_alternative<TomlTable>(find(*entries, "a.b")->value.data));
  EXPECT_EQ(std::get<std::int64_t>(find(*entries, "a.b.integer")->value.data), 3);
  EXPECT_EQ(find(*entries, "a.b.integer")->position, (TextPosition{3, 3}));
  EXPECT_EQ(find(*entries, "a.b.integer")->value.position, (TextPosition{3, 13}));
  EXPECT_EQ(std::get<double>(find(*entries, "a.b.real")->value.data), 2.5);
  EXPECT_EQ(std::get<std::string>(find(*entries, "a.b.text")->value.data), "x");
  const auto& list = std::get<std::vector<TomlValue>>(find(*entries, "a.b.list")->value.data);
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0].position, (TextPosition{6, 9}));
  EXPECT_EQ(list[1].position, (TextPosition{7, 2}));
}

TEST(TomlDocument, QuotesKeysThatAreNotBare) {
  const auto entries = read_toml("\"a b\".\"\" = 1\n\"line\\nbreak\" = 2\n");
  ASSERT_TRUE(entries);
  EXPECT_NE(find(*entries, "\"a b\".\"\""), nullptr);
  EXPECT_NE(find(*entries, "\"line\\u000Abreak\""), nullptr);
}

TEST(TomlDocument, NamesTheTypeOfEveryValue) {
  const auto entries =
      read_toml("a = true\nb = 1\nc = 1.0\nd = ''\ne = []\nf = {}\ng = 1979-05-27\nh = 07:32:00\ni = 1979-05-27T07:32:00Z\n");
  ASSERT_TRUE(entries);
  const std::pair<const char*, const char*> expected[] = {{"a", "boolean"},   {"b", "integer"},   {"c", "float"},
                                                          {"d", "string"},    {"e", "array"},     {"f", "table"},
                                                          {"g", "date-time"}, {"h", "date-time"}, {"i", "date-time"}};
  for (const auto& [key, type] : expected) {
    EXPECT_EQ(type_name(find(*entries, key)->value), type) << key;
  }
}

TEST(TomlDocument, StopsListingAtTheDepthLimit) {
  std::string text = "[x";
  for (int i = 1; i < 2000; ++i) {
    text += ".x";
  }
  const auto entries = read_toml(text + "]\n");
  ASSERT_TRUE(entries);
  EXPECT_EQ(entries->size(), static_cast<std::size_t>(kMaxTableDepth));
}

TEST(TomlDocument, ReportsSyntaxErrorsWithPosition) {
  const auto duplicate = read_toml("[t]\na = 1\na = 2\n");
  ASSERT_FALSE(duplicate);
  EXPECT_EQ(duplicate.error().position, (TextPosition{3, 5}));
  EXPECT_EQ(duplicate.error().message, "cannot redefine existing integer 'a' (in a key-value pair)");
}

TEST(TomlDocument, FindsBytesThatAreNotUtf8) {
  const std::pair<std::string, TextPosition> cases[] = {
      {"a = 1\n\xFF\n", {2, 1}},                              // never in UTF-8
      {"a = '\xC3\xA9\xE2\x82\xAC\x80'\n", {1, 8}},           // a continuation byte alone, after two whole characters
      {"a = '\xE2\x82'\n", {1, 6}},                           // cut short
      {"a = '\xC0\x80'\n", {1, 6}},                           // overlong
      {"a = '\xED\xA0\x80'\n", {1, 6}},                       // half of a surrogate pair
      {"a = '\xF4\x90\x80\x80'\n", {1, 6}},                   // beyond U+10FFFF
      {std::string(100, '\n') + "# \xF0\x9F\x98", {101, 3}},  // cut short by the end
  };
  for (const auto& [text, position] : cases) {
    const auto entries = read_toml(text);
    ASSERT_FALSE(entries) << text;
    EXPECT_EQ(entries.error().position, position) << text;
    EXPECT_EQ(entries.error().message, "not UTF-8 text");
  }
  EXPECT_TRUE(read_toml("a = '\xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80\xF4\x8F\xBF\xBF'\n"));
}

// toml++'s tables of characters call these unreachable: only a sanitizer sees the difference.
TEST(TomlDocument, RefusesCharactersOutsideItsTables) {
  const std::string characters[] = {"\xEF\xBB\xAB", "\xC2\xA7", "\xCC\xAA"};  // U+FEEB, U+00A7, U+032A
  for (const std::string& character : characters) {
    EXPECT_FALSE(read_toml(character)) << character;
    EXPECT_FALSE(read_toml(character + " = 1\n")) << character;
    EXPECT_FALSE(read_toml("a = 1" + character + "\n")) << character;
    const auto value = read_toml("a = \"\"\"\\\n" + character + "\"\"\"\n");
    ASSERT_TRUE(value) << character;
    EXPECT_EQ(std::get<std::string>(value->at(0).value.data), character);
  }
}

TEST(TomlDocument, BriefTextFitsOnALine) {
  EXPECT_EQ(brief_text({true, {}}), "true");
  EXPECT_EQ(brief_text({std::int64_t{-3}, {}}), "-3");
  EXPECT_EQ(brief_text({2.0, {}}), "2.0");
  EXPECT_EQ(brief_text({std::string("a\"\\\n"), {}}), "\"a\\\"\\\\\\u000A\"");
  EXPECT_EQ(brief_text({std::string(100, 'x'), {}}), "\"" + std::string(60, 'x') + "\"...");
  // 59 letters and then a character of two bytes, which must not be cut in half.
  EXPECT_EQ(brief_text({std::string(59, 'x') + "\xC3\xA9" + "yy", {}}), "\"" + std::string(59, 'x') + "\"...");
  const std::vector<TomlValue> many(9, TomlValue{std::int64_t{1}, {}});
  EXPECT_EQ(brief_text({many, {}}), "[1, 1, 1, 1, 1, 1, 1, 1, ...]");
  EXPECT_EQ(brief_text({std::vector<TomlValue>{{many, {}}, {TomlTable{}, {}}}, {}}), "[[...], a table]");
  EXPECT_EQ(brief_text({TomlDateTime{}, {}}), "a date or time");
}

TEST(TomlDocument, RealTextReadsBackTheSame) {
  for (const double value : {0.0, -0.0, 1.0, 0.1, 1e300, 5e-324, -517.306408, std::numeric_limits<double>::infinity()}) {
    const auto entries = read_toml("x = " + real_text(value) + "\n");
    ASSERT_TRUE(entries) << real_text(value);
    const auto* read = std::get_if<double>(&entries->front().value.data);
    ASSERT_NE(read, nullptr) << real_text(value);
    EXPECT_EQ(*read, value);
    EXPECT_EQ(std::signbit(*read), std::signbit(value));
  }
  EXPECT_EQ(real_text(std::nan("")), "nan");
}

}  // namespace
}  // namespace posed
