#include "tools/posectl/whole_file.h"

#include <filesystem>
#include <iterator>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using testing::HasSubstr;

TEST(WholeFile, ReturnsWhatWasWritten) {
  const TemporaryFolder folder;
  const std::string contents(200'000, 'x');
  ASSERT_TRUE(write_whole_file(folder / "a.txt", contents));
  EXPECT_EQ(read_whole_file(folder / "a.txt"), contents);
}

TEST(WholeFile, ReplacesAndLeavesNothingElseBehind) {
  const TemporaryFolder folder;
  folder.write("a.txt", "old and longer");
  ASSERT_TRUE(write_whole_file(folder / "a.txt", "new"));
  EXPECT_EQ(contents_of(folder / "a.txt"), "new");
  const std::filesystem::directory_iterator entries(folder.path());
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1);
}

TEST(WholeFile, AFailedWriteKeepsTheOldFileAndRemovesItsOwn) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "target" / "not_empty");
  // Renaming a file over a folder fails, after the temporary file was written.
  const Status status = write_whole_file(folder / "target", "text");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_TRUE(std::filesystem::is_directory(folder.path() / "target" / "not_empty"));
  const std::filesystem::directory_iterator entries(folder.path());
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1);
}

TEST(WholeFile, WritesToDevicesDirectly) {
  EXPECT_TRUE(write_whole_file("/dev/null", "text"));
}

TEST(WholeFile, ReportsAFullDisk) {
  const Status status = write_whole_file("/dev/full", "text");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_THAT(status.error().message, HasSubstr("/dev/full"));
}

TEST(WholeFile, AMissingFileIsNotFound) {
  const Result<std::string> text = read_whole_file("/nonexistent/file");
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().code, ErrorCode::NotFound);
  EXPECT_THAT(text.error().message, HasSubstr("/nonexistent/file"));
}

TEST(WholeFile, AFolderCannotBeRead) {
  const Result<std::string> text = read_whole_file("/");
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().code, ErrorCode::BadData);
}

TEST(CheckWritable, AcceptsNewAndExistingFilesAndDevices) {
  const TemporaryFolder folder;
  EXPECT_TRUE(check_writable(folder / "new.txt"));
  EXPECT_TRUE(check_writable(folder.write("old.txt", "")));
  EXPECT_TRUE(check_writable("/dev/null"));
  EXPECT_TRUE(check_writable("a_name_without_folder"));
}

TEST(CheckWritable, NamesTheMissingFolder) {
  const TemporaryFolder folder;
  const Status status = check_writable(folder / "missing/out.txt");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_THAT(status.error().message, HasSubstr("there is no folder " + (folder / "missing")));
}

TEST(CheckWritable, RefusesAFolder) {
  const TemporaryFolder folder;
  const Status status = check_writable(folder.path());
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("it is a folder"));
}

TEST(CheckWritable, RefusesAFolderWithoutPermission) {
  if (::geteuid() == 0) {
    GTEST_SKIP() << "root may write everywhere";
  }
  const Status status = check_writable("/proc/out.txt");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace posed
