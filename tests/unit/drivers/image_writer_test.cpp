#include "drivers/image_writer.h"

#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/file_io.h"
#include "tests/support/test_recording.h"

namespace posed {
namespace {

using testing::HasSubstr;

TEST(ImageWriter, AMissingFolderIsNamed) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> gray(4, 1);
  const Status status = write_png_gray8(folder.path() / "none" / "mask.png", {gray.data(), 2, 2, 2, 1});
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("none/mask.png"));
}

TEST(ImageWriter, AFileIsReplacedAsAWhole) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "file";
  const std::vector<std::uint8_t> first(1000, 1);
  const std::vector<std::uint8_t> second(10, 2);
  ASSERT_TRUE(write_file(path, first));
  ASSERT_TRUE(write_file(path, second));
  EXPECT_EQ(bytes_of(path), second);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "no temporary file is left";
}

/// A limit of the file size makes the system refuse to write on in the middle of a file, as a full disk does.
TEST(ImageWriter, AFullDiskLeavesNoFileAndKeepsTheOldOne) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "file";
  const std::vector<std::uint8_t> old(100, 1);
  ASSERT_TRUE(write_file(path, old));

  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limited = before;
  limited.rlim_cur = 4096;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limited), 0);
  const Status status = write_file(path, std::vector<std::uint8_t>(10000, 2));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous_handler);

  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_THAT(status.error().message, HasSubstr(path.string()));
  EXPECT_EQ(bytes_of(path), old);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "no temporary file is left";
}

TEST(ImageWriter, AFullDeviceIsAnError) {
  const TemporaryFolder folder;
  if (!std::filesystem::exists("/dev/full")) {
    GTEST_SKIP() << "this system has no /dev/full";
  }
  std::filesystem::create_symlink("/dev/full", folder.path() / "file.part");
  const Status status = write_file(folder.path() / "file", std::vector<std::uint8_t>(10, 2));
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("free some space"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "file"));
}

TEST(FileIo, AFileLargerThanTheLimitIsRefused) {
  const TemporaryFolder folder;
  write_text(folder.path() / "file", "12345");
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(read_file(folder.path() / "file", bytes, 5));
  EXPECT_EQ(bytes.size(), 5U);
  const Status status = read_file(folder.path() / "file", bytes, 4);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::BadData);
}

}  // namespace
}  // namespace posed
