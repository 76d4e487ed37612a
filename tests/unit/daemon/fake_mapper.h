#pragma once

#include <cstddef>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/slam_ports.h"

namespace posed {

/// A map that is nothing but its count of keyframes; its file holds that number.
class FakeMapper final : public KeyframeMapper {
 public:
  MapperCounters mapper_counters;
  std::function<void()> on_insert = [] {};
  std::function<bool(const Interrupt&)> on_improve = [](const Interrupt&) { return false; };
  std::function<Status(const std::string& path)> on_save = [](const std::string&) { return Status{}; };
  std::function<Status(const std::string& path)> on_load = [](const std::string&) { return Status{}; };

  void insert(const KeyframeRecord& record) override {
    on_insert();
    keyframes_.push_back(record.id);
  }
  bool improve(const Interrupt& interrupt) override { return on_improve(interrupt); }
  void write_snapshot(MapSnapshot& snapshot) const override { snapshot.version = keyframes_.size(); }
  std::optional<Se3> keyframe_pose(KeyframeId id) const override {
    return id <= keyframes_.size() ? std::optional<Se3>(Se3()) : std::nullopt;
  }
  std::size_t keyframe_count() const override { return keyframes_.size(); }
  std::size_t landmark_count() const override { return 7 * keyframes_.size(); }
  MapperCounters counters() const override { return mapper_counters; }
  Status save(const std::string& path) override {
    return on_save(path).map([&] { std::ofstream(path) << keyframes_.size(); });
  }
  Status load(const std::string& path) override {
    return on_load(path).map([&] {
      std::size_t count = 0;
      std::ifstream(path) >> count;
      keyframes_.assign(count, 1);
    });
  }

 private:
  std::vector<KeyframeId> keyframes_;
};

}  // namespace posed
