#include "core/append_file.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

TEST(AppendFile, GrowsByWhatIsGiven) {
  const TemporaryFolder folder;
  Result<AppendFile> file = AppendFile::create(folder.path() / "list.txt");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->append("one\n"));
  EXPECT_EQ(contents_of(folder.path() / "list.txt"), "one\n");
  ASSERT_TRUE(file->append("two\n"));
  ASSERT_TRUE(file->sync());
  EXPECT_EQ(contents_of(folder.path() / "list.txt"), "one\ntwo\n");
}

TEST(AppendFile, IsMadeOnce) {
  const TemporaryFolder folder;
  folder.write("list.txt", "mine");
  const Result<AppendFile> file = AppendFile::create(folder.path() / "list.txt");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(contents_of(folder.path() / "list.txt"), "mine");
  EXPECT_EQ(AppendFile::create(folder.path() / "none" / "list.txt").error().code, ErrorCode::NotFound);
}

TEST(AppendFile, WhatDoesNotFitLeavesNoPart) {
  const TemporaryFolder folder;
  Result<AppendFile> file = AppendFile::create(folder.path() / "list.txt");
  ASSERT_TRUE(file && file->append("before\n"));
  {
    const FileSizeLimit limit(50);
    const Status status = file->append(std::string(100, 'x'));
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::Io);
    EXPECT_THAT(status.error().message, testing::HasSubstr("list.txt"));
  }
  EXPECT_EQ(contents_of(folder.path() / "list.txt"), "before\n");
  ASSERT_TRUE(file->append("after\n"));
  EXPECT_EQ(contents_of(folder.path() / "list.txt"), "before\nafter\n");
}

}  // namespace
}  // namespace posed
