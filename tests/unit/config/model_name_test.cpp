#include "config/model_name.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(ModelName, HasTheInputsSizeAfterAnAt) {
  const ModelName name{"/models/person.posednet", {{256, 192}}};
  EXPECT_EQ(parse_model_name("/models/person.posednet@256x192"), name);
  EXPECT_EQ(to_string(name), "/models/person.posednet@256x192");
}

TEST(ModelName, MayHaveSeveralSizes) {
  const ModelName name{"a+b", {{384, 288}, {320, 256}, {64, 64}}};
  EXPECT_EQ(parse_model_name("a+b@384x288+320x256+64x64"), name);
  EXPECT_EQ(to_string(name), "a+b@384x288+320x256+64x64");
}

TEST(ModelName, IsAFilesNameOtherwise) {
  for (const char* name :
       {"person.posednet", "a@b.onnx",       "a@256.onnx", "a@256x",     "a@x192",   "a@0x192", "a@256x0", "a@-64x64",
        "a@64x64.onnx",    "a@12345x64",     "@64x64",     "a@ 64x64",   "a@64x64 ", "a@64X64", "a@",      "a@64x64+",
        "a@+64x64",        "a@64x64++64x64", "a@64x64+b",  "a@64x64x64", "a+64x64",  ""}) {
    const ModelName parsed = parse_model_name(name);
    EXPECT_EQ(parsed, (ModelName{name, {}}));
    EXPECT_EQ(to_string(parsed), name);
  }
}

TEST(ModelName, OnlyTheLastSizesCount) {
  EXPECT_EQ(parse_model_name("a@64x64@128x64"), (ModelName{"a@64x64", {{128, 64}}}));
}

}  // namespace
}  // namespace posed
