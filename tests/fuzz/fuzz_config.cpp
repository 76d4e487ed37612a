// Any bytes, read as a configuration and as a camera calibration: they are accepted or refused with a message, and what is accepted
// can be written and read again.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "config/config_loader.h"
#include "config/config_reference.h"

namespace {

void expect(bool holds, const char* what, const std::string& detail) {
  if (!holds) {
    std::fprintf(stderr, "%s\n%s\n", what, detail.c_str());
    std::abort();
  }
}

template <typename Value>
void check(const posed::Result<Value>& read, posed::Result<Value> (*parse)(const std::string&, const std::filesystem::path&)) {
  if (!read) {
    expect(read.error().message.starts_with("fuzz.toml:"), "a message does not begin with the file's name", read.error().message);
    return;
  }
  const std::string text = posed::to_toml(*read);
  const posed::Result<Value> again = parse(text, "fuzz.toml");
  expect(again.has_value(), "what was accepted is refused when it is read again", text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  check(posed::parse_config(text, "fuzz.toml"), &posed::parse_config);
  check(posed::parse_camera(text, "fuzz.toml"), &posed::parse_camera);
  return 0;
}
