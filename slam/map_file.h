#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/atomic_file.h"
#include "core/result.h"

/// The container of a saved map, record by record. Numbers are big-endian, as in LCM.
///
///     file     = preamble record... end
///     preamble = "POSEDMAP", format version (4 bytes), CRC-32C of both (4)
///     record   = kind (4), size of the payload (4), payload, CRC-32C of all three (4)
///     end      = a record of kind End, whose payload is the number of records before it (8); nothing follows it
///
/// So a file that was cut off anywhere, or in which a bit has changed, is always noticed, and whoever reads a file of a newer
/// version knows that it is one.
namespace posed {

constexpr std::uint32_t kMapFormatVersion = 1;

/// No record is larger; what claims to be is refused before room is made for it.
constexpr std::size_t kMaxMapRecordBytes = std::size_t{1} << 23;

enum class MapRecordKind : std::uint32_t { End = 0, Header = 1, Landmark = 2, Keyframe = 3, Loop = 4 };

/// Thread-bound. Errors as in AtomicFile, which also keeps the old file until `commit`.
class MapFileWriter {
 public:
  static Result<MapFileWriter> create(const std::string& path);

  /// Encodes an LCM message as a record.
  template <typename Message>
  Status write(MapRecordKind kind, const Message& message) {
    payload_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(payload_.data(), 0, static_cast<int>(payload_.size()));
    return write_payload(kind);
  }

  /// Writes the end and puts the file into place.
  Status commit();

 private:
  explicit MapFileWriter(AtomicFile file) : file_(std::move(file)) {}
  Status write_payload(MapRecordKind kind);

  AtomicFile file_;
  std::vector<std::uint8_t> payload_;
  std::uint64_t records_ = 0;
};

/// Thread-bound. Never changes the file.
class MapFileReader {
 public:
  /// Errors: NotFound; Io; BadData, where it is no map file or a damaged one; Unsupported, where its version is newer.
  static Result<MapFileReader> open(const std::string& path);

  /// The next record, End included, whose checksum is right; its payload is in `payload()` until the next call. Not to be called
  /// after End. Errors: BadData; Io.
  Result<MapRecordKind> next();

  std::span<const std::uint8_t> payload() const { return payload_; }

  /// The payload as an LCM message; false where it is none of this type.
  template <typename Message>
  bool decode(Message& message) const {
    const int size = static_cast<int>(payload_.size());
    return message.decode(payload_.data(), 0, size) == size;
  }

  /// BadData: file, place of the last record, `what`, and how to mend.
  tl::unexpected<Error> damaged(std::string_view what) const;

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  MapFileReader(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}
  Status read(std::span<std::uint8_t> bytes);
  Status read_preamble();
  Status check_end();

  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::vector<std::uint8_t> payload_;
  std::uint64_t offset_ = 0;         // of what is read next
  std::uint64_t record_offset_ = 0;  // of the last record
  std::uint64_t records_ = 0;        // before it
};

}  // namespace posed
