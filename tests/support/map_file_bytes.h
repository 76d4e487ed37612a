#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/crc32c.h"

namespace posed {

/// A map file taken apart into its records (slam/map_file.h), and put together again with right checksums and record count, so that
/// the checks behind the checksums can be tested. `bytes` must be a whole file.
class MapFileBytes {
 public:
  struct Record {
    std::uint32_t kind = 0;
    std::string payload;
  };

  explicit MapFileBytes(const std::string& bytes) : version_(get_u32(bytes, 8)) {
    for (std::size_t at = 16; at + 12 <= bytes.size();) {
      const std::size_t size = get_u32(bytes, at + 4);
      records_.push_back({get_u32(bytes, at), bytes.substr(at + 8, size)});
      at += size + 12;
    }
    records_.pop_back();  // the end
  }

  /// Without the end, which `bytes` makes.
  std::vector<Record>& records() { return records_; }
  const std::vector<Record>& records() const { return records_; }

  void set_version(std::uint32_t version) { version_ = version; }
  void erase(std::size_t i) { records_.erase(records_.begin() + static_cast<std::ptrdiff_t>(i)); }
  void repeat(std::size_t i) {
    const Record record = records_[i];
    records_.insert(records_.begin() + static_cast<std::ptrdiff_t>(i), record);
  }

  std::string bytes() const {
    std::string file = "POSEDMAP" + u32(version_);
    file += u32(checksum(file));
    for (const Record& record : records_) {
      file += sealed(record.kind, record.payload);
    }
    return file + sealed(0, u32(0) + u32(static_cast<std::uint32_t>(records_.size())));
  }

 private:
  static std::uint32_t get_u32(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) {
      value = value << 8 | static_cast<std::uint8_t>(bytes.at(i));
    }
    return value;
  }

  static std::string u32(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) {
      bytes += static_cast<char>(value >> shift);
    }
    return bytes;
  }

  static std::uint32_t checksum(const std::string& bytes) {
    return crc32c({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  }

  static std::string sealed(std::uint32_t kind, const std::string& payload) {
    const std::string record = u32(kind) + u32(static_cast<std::uint32_t>(payload.size())) + payload;
    return record + u32(checksum(record));
  }

  std::uint32_t version_;
  std::vector<Record> records_;
};

}  // namespace posed
