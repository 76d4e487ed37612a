#include "config/model_name.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(ModelName, HasTheInputsSizeAfterAnAt) {
  EXPECT_EQ(parse_model_name("/models/person.posednet@256x192"), (ModelName{"/models/person.posednet", 256, 192}));
  EXPECT_EQ(to_string(ModelName{"person.posednet", 256, 192}), "person.posednet@256x192");
}

TEST(ModelName, IsAFilesNameOtherwise) {
  for (const char* name : {"person.posednet", "a@b.onnx", "a@256.onnx", "a@256x", "a@x192", "a@0x192", "a@256x0", "a@-64x64", "a@64x64.onnx",
                           "a@12345x64", "@64x64", "a@ 64x64", "a@64x64 ", "a@64X64", ""}) {
    const ModelName parsed = parse_model_name(name);
    EXPECT_EQ(parsed, (ModelName{name, 0, 0}));
    EXPECT_FALSE(parsed.has_size());
    EXPECT_EQ(to_string(parsed), name);
  }
}

TEST(ModelName, OnlyTheLastSizeCounts) {
  EXPECT_EQ(parse_model_name("a@64x64@128x64"), (ModelName{"a@64x64", 128, 64}));
}

}  // namespace
}  // namespace posed
