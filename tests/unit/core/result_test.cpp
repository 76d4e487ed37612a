#include "core/result.h"

#include <memory>

#include <gtest/gtest.h>

namespace posed {
namespace {

Result<int> half(int n) {
  if (n % 2 != 0) {
    return make_error(ErrorCode::InvalidArgument, "odd");
  }
  return n / 2;
}

Status check(bool good) {
  if (!good) {
    return make_error(ErrorCode::Io, "bad");
  }
  return {};
}

TEST(Result, HoldsAValueOrAnError) {
  const Result<int> good = half(8);
  ASSERT_TRUE(good);
  EXPECT_EQ(*good, 4);

  const Result<int> bad = half(7);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(bad.error().message, "odd");
}

TEST(Result, OfAnErrorPassesThroughAChainUntouched) {
  int calls = 0;
  const Result<int> result = half(6).and_then(half).and_then([&](int n) {
    ++calls;
    return half(n);
  });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message, "odd");
  EXPECT_EQ(calls, 0);
}

TEST(Result, CarriesValuesThatOnlyMove) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(3);
  const std::unique_ptr<int> taken = *std::move(result);
  EXPECT_EQ(*taken, 3);
}

TEST(Status, IsGoodUnlessItHoldsAnError) {
  EXPECT_TRUE(check(true));
  const Status bad = check(false);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace posed
