#pragma once

#include <gtest/gtest.h>

#include "slam/mapper.h"
#include "tests/support/feature_world.h"

namespace posed {

/// A map of one keyframe at the origin, to be matched from elsewhere.
struct OneKeyframeMap : testing::Test {
  FeatureWorld world{4};
  TrackerConfig config = [] {
    TrackerConfig t;
    t.close_depth_m = 10;
    return t;
  }();
  PinholeCamera camera{world.intrinsics};
  MapSnapshot map;

  void SetUp() override {
    Mapper mapper(config, MapperConfig{}, MapMode::Mapping, world.intrinsics);
    mapper.insert(FeatureWorld::record(world.view(Se3(), 0, 0, 0), 1, {}));
    mapper.write_snapshot(map);
  }
};

}  // namespace posed
