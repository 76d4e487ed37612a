#include "config/edit_distance.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(EditDistance, CountsInsertionsDeletionsSubstitutionsAndSwaps) {
  EXPECT_EQ(edit_distance("features", "features"), 0U);
  EXPECT_EQ(edit_distance("featurs", "features"), 1U);
  EXPECT_EQ(edit_distance("featuress", "features"), 1U);
  EXPECT_EQ(edit_distance("feetures", "features"), 1U);
  EXPECT_EQ(edit_distance("faetures", "features"), 1U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
}

TEST(EditDistance, OfNothingIsTheLength) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("abc", ""), 3U);
}

TEST(EditDistance, IsSymmetric) {
  EXPECT_EQ(edit_distance("ca", "abc"), edit_distance("abc", "ca"));
  EXPECT_EQ(edit_distance("policy", "priority"), edit_distance("priority", "policy"));
}

}  // namespace
}  // namespace posed
