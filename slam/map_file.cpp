#include "slam/map_file.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "core/crc32c.h"
#include "core/file_descriptor.h"

namespace posed {

namespace {

constexpr std::string_view kMagic = "POSEDMAP";
constexpr std::size_t kPreambleBytes = 16;
constexpr std::size_t kRecordHeadBytes = 8;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::size_t kEndBytes = 8;

void put_u32(std::span<std::uint8_t> bytes, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  }
}

std::uint32_t get_u32(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value = value << 8 | bytes[i];
  }
  return value;
}

}  // namespace

Result<MapFileWriter> MapFileWriter::create(const std::string& path) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) {
    return tl::unexpected<Error>(file.error());
  }
  MapFileWriter writer(std::move(*file));
  std::array<std::uint8_t, kPreambleBytes> preamble{};
  std::copy(kMagic.begin(), kMagic.end(), preamble.begin());
  const std::span<std::uint8_t> bytes(preamble);
  put_u32(bytes.subspan(8), kMapFormatVersion);
  put_u32(bytes.subspan(12), crc32c(bytes.first(12)));
  if (const Status written = writer.file_.write(preamble); !written) {
    return tl::unexpected<Error>(written.error());
  }
  return writer;
}

Status MapFileWriter::write_payload(MapRecordKind kind) {
  assert(payload_.size() <= kMaxMapRecordBytes);
  std::array<std::uint8_t, kRecordHeadBytes> head{};
  const std::span<std::uint8_t> bytes(head);
  put_u32(bytes, static_cast<std::uint32_t>(kind));
  put_u32(bytes.subspan(4), static_cast<std::uint32_t>(payload_.size()));
  std::array<std::uint8_t, kChecksumBytes> checksum{};
  put_u32(checksum, crc32c(payload_, crc32c(head)));
  ++records_;
  for (const std::span<const std::uint8_t> part :
       {std::span<const std::uint8_t>(head), std::span<const std::uint8_t>(payload_), std::span<const std::uint8_t>(checksum)}) {
    if (const Status written = file_.write(part); !written) {
      return written;
    }
  }
  return {};
}

Status MapFileWriter::commit() {
  payload_.resize(kEndBytes);
  const std::span<std::uint8_t> bytes(payload_);
  put_u32(bytes, static_cast<std::uint32_t>(records_ >> 32));
  put_u32(bytes.subspan(4), static_cast<std::uint32_t>(records_));
  if (const Status written = write_payload(MapRecordKind::End); !written) {
    return written;
  }
  return file_.commit();
}

Result<MapFileReader> MapFileReader::open(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    return system_error("open", path, errno);
  }
  if (!S_ISREG(info.st_mode)) {  // opening a named pipe would wait for its writer
    return make_error(ErrorCode::BadData, fmt::format("{} is not a regular file", path));
  }
  std::FILE* const file = std::fopen(path.c_str(), "rbe");
  if (file == nullptr) {
    return system_error("open", path, errno);
  }
  MapFileReader reader(path, file);
  if (const Status read = reader.read_preamble(); !read) {
    return tl::unexpected<Error>(read.error());
  }
  return reader;
}

Status MapFileReader::read(std::span<std::uint8_t> bytes) {
  const std::size_t got = std::fread(bytes.data(), 1, bytes.size(), file_.get());
  offset_ += got;
  if (got == bytes.size()) {
    return {};
  }
  if (std::ferror(file_.get()) != 0) {
    return system_error("read", path_, errno);
  }
  return damaged("the file ends here");
}

Status MapFileReader::read_preamble() {
  std::array<std::uint8_t, kPreambleBytes> preamble{};
  const Status read_all = read(preamble);
  if (!read_all && read_all.error().code != ErrorCode::BadData) {
    return read_all;
  }
  if (!std::equal(kMagic.begin(), kMagic.end(), preamble.begin())) {
    return make_error(ErrorCode::BadData, fmt::format("{}: is no map of posed: it does not begin with '{}'. Name another file, or "
                                                      "one that does not exist yet to begin a new map",
                                                      path_, kMagic));
  }
  if (!read_all) {
    return read_all;
  }
  const std::span<const std::uint8_t> bytes(preamble);
  if (get_u32(bytes.subspan(12)) != crc32c(bytes.first(12))) {
    return damaged("the checksum is wrong");
  }
  if (const std::uint32_t version = get_u32(bytes.subspan(8)); version != kMapFormatVersion) {
    return make_error(
        ErrorCode::Unsupported,
        fmt::format("{}: is a map of format version {}, which this posed cannot read; it reads version {}. Use the posed "
                    "that wrote it, or name another file",
                    path_, version, kMapFormatVersion));
  }
  return {};
}

Result<MapRecordKind> MapFileReader::next() {
  records_ += record_offset_ == 0 ? 0 : 1;
  record_offset_ = offset_;
  std::array<std::uint8_t, kRecordHeadBytes> head{};
  Status status = read(head);
  if (!status) {
    return tl::unexpected<Error>(status.error());
  }
  const std::span<const std::uint8_t> bytes(head);
  const std::uint32_t size = get_u32(bytes.subspan(4));
  if (size > kMaxMapRecordBytes) {
    return damaged(fmt::format("a record claims {} bytes, at most {} are possible", size, kMaxMapRecordBytes));
  }
  payload_.resize(size);
  std::array<std::uint8_t, kChecksumBytes> checksum{};
  status = read(payload_);
  status = status ? read(checksum) : status;
  if (!status) {
    return tl::unexpected<Error>(status.error());
  }
  if (get_u32(checksum) != crc32c(payload_, crc32c(head))) {
    return damaged("the checksum is wrong");
  }
  const auto kind = static_cast<MapRecordKind>(get_u32(bytes));
  status = kind == MapRecordKind::End ? check_end() : Status{};
  if (!status) {
    return tl::unexpected<Error>(status.error());
  }
  return kind;
}

Status MapFileReader::check_end() {
  if (payload_.size() != kEndBytes) {
    return damaged("the last record has a wrong size");
  }
  const std::span<const std::uint8_t> bytes(payload_);
  const std::uint64_t records = std::uint64_t{get_u32(bytes)} << 32 | get_u32(bytes.subspan(4));
  if (records != records_) {
    return damaged(fmt::format("{} records were written, {} are here", records, records_));
  }
  if (std::fgetc(file_.get()) != EOF) {
    return damaged("something follows the last record");
  }
  return {};
}

tl::unexpected<Error> MapFileReader::damaged(std::string_view what) const {
  return make_error(
      ErrorCode::BadData,
      fmt::format("{}: is a damaged map: {}, in the record at byte {}. Restore a copy of it, or move it away to begin "
                  "a new map",
                  path_, what, record_offset_));
}

}  // namespace posed
