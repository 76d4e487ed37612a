// Any bytes, read as a list of images and as a list of associations: they are accepted or refused with a message that names the file,
// what is accepted is in order, and stamps survive being written and read.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "drivers/tum_list.h"

namespace {

using namespace posed;

void expect(bool holds, const char* what, const std::string& detail) {
  if (!holds) {
    std::fprintf(stderr, "%s\n%s\n", what, detail.c_str());
    std::abort();
  }
}

const TumListEntry& color_of(const TumListEntry& entry) {
  return entry;
}
const TumListEntry& color_of(const TumAssociation& entry) {
  return entry.color;
}

template <typename List>
void check(const Result<List>& list) {
  if (!list) {
    expect(list.error().message.find("list.txt") != std::string::npos, "a message does not name the file", list.error().message);
    return;
  }
  expect(!list->entries.empty(), "an accepted list is empty", "");
  expect(list->skipped_lines.size() <= kMaxSkippedLines, "too many lines were skipped", "");
  std::int64_t before_ns = -1;
  for (const auto& entry : list->entries) {
    const TumListEntry& color = color_of(entry);
    expect(color.stamp_ns > before_ns, "stamps do not increase", format_stamp(color.stamp_ns));
    expect(parse_stamp(format_stamp(color.stamp_ns)) == color.stamp_ns, "a stamp changes", format_stamp(color.stamp_ns));
    before_ns = color.stamp_ns;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  check(parse_tum_list(text, "list.txt"));
  check(parse_tum_associations(text, "list.txt"));
  return 0;
}
