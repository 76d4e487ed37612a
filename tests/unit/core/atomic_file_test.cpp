#include "core/atomic_file.h"

#include <fstream>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>

#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

class AtomicFileTest : public ::testing::Test {
 protected:
  bool part_exists() const { return std::filesystem::exists(path_ + ".part"); }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "map";
};

TEST_F(AtomicFileTest, TheNewFileAppearsWithTheCommitAlone) {
  folder_.write("map", "old");
  Result<AtomicFile> file = AtomicFile::create(path_);
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->write(bytes_of("new ")));
  ASSERT_TRUE(file->write(bytes_of("content")));
  EXPECT_EQ(contents_of(path_), "old");
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(contents_of(path_), "new content");
  EXPECT_FALSE(part_exists());
}

TEST_F(AtomicFileTest, PiecesSmallAndLargeKeepTheirOrder) {
  std::string expected;
  {
    Result<AtomicFile> file = AtomicFile::create(path_);
    ASSERT_TRUE(file);
    for (int i = 0; i < 60; ++i) {
      const std::string piece(static_cast<std::size_t>(i % 3 == 0 ? 70'000 : i * 997), static_cast<char>('A' + i % 26));
      ASSERT_TRUE(file->write(bytes_of(piece)));
      expected += piece;
    }
    ASSERT_TRUE(file->commit());
  }
  EXPECT_EQ(contents_of(path_), expected);
}

TEST_F(AtomicFileTest, WithoutACommitNothingIsLeftBehind) {
  {
    Result<AtomicFile> file = AtomicFile::create(path_);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write(bytes_of("half")));
    EXPECT_TRUE(part_exists());
  }
  EXPECT_FALSE(part_exists());
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(AtomicFileTest, OverwritesWhatAKilledProcessLeft) {
  folder_.write("map.part", "a long leftover of an earlier attempt");
  Result<AtomicFile> file = AtomicFile::create(path_);
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write(bytes_of("new")));
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(contents_of(path_), "new");
}

TEST_F(AtomicFileTest, AnotherWriterIsRefused) {
  const Result<AtomicFile> first = AtomicFile::create(path_);
  ASSERT_TRUE(first);
  const Result<AtomicFile> second = AtomicFile::create(path_);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::Unavailable);
  EXPECT_NE(second.error().message.find(path_), std::string::npos);
}

TEST_F(AtomicFileTest, AFolderThatDoesNotExistIsNotFound) {
  const Result<AtomicFile> file = AtomicFile::create(folder_ / "missing/map");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::NotFound);
  EXPECT_NE(file.error().message.find("No such file or directory"), std::string::npos) << file.error().message;
}

TEST_F(AtomicFileTest, DevicesAndFoldersAreRefused) {
  for (const std::string& path : {std::string("/dev/null"), folder_.path().string()}) {
    const Result<AtomicFile> file = AtomicFile::create(path);
    ASSERT_FALSE(file) << path;
    EXPECT_EQ(file.error().code, ErrorCode::Io);
  }
}

TEST_F(AtomicFileTest, AWriteThatTheSystemRefusesKeepsTheOldFile) {
  folder_.write("map", "old");
  {
    const FileSizeLimit limit(100'000);
    Result<AtomicFile> file = AtomicFile::create(path_);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write(bytes_of(std::string(90'000, 'x'))));
    const Status refused = file->write(bytes_of(std::string(90'000, 'y')));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Io);
    EXPECT_NE(refused.error().message.find("File too large"), std::string::npos) << refused.error().message;
  }
  EXPECT_EQ(contents_of(path_), "old");
  EXPECT_FALSE(part_exists());
}

TEST_F(AtomicFileTest, WhatIsStillBufferedIsNotLostOnAFullDisk) {
  folder_.write("map", "old");
  {
    const FileSizeLimit limit(10);
    Result<AtomicFile> file = AtomicFile::create(path_);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write(bytes_of("more than ten bytes")));
    EXPECT_FALSE(file->commit());
  }
  EXPECT_EQ(contents_of(path_), "old");
  EXPECT_FALSE(part_exists());
}

}  // namespace
}  // namespace posed
