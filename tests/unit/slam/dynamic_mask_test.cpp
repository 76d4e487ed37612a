#include "slam/dynamic_mask.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr float kWall_m = 3.0F;
constexpr float kBody_m = 1.5F;
constexpr std::int64_t kPeriod_ns = 33 * kNsPerMs;

struct Rectangle {
  int x0, y0, x1, y1;  // [pixels] the last ones excluded
  BoundingBox box() const {
    return {static_cast<float>(x0) - 0.5F, static_cast<float>(y0) - 0.5F, static_cast<float>(x1) - 0.5F,
            static_cast<float>(y1) - 0.5F};
  }
  bool holds(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  Rectangle moved(int dx) const { return {x0 + dx, y0, x1 + dx, y1}; }
};

constexpr Rectangle kBody{200, 120, 320, 480};

/// A wall, and in front of it what a test puts there; the camera does not move.
class Scene {
 public:
  explicit Scene(DynamicMode mode = DynamicMode::Full) : mask_(config(mode), PinholeCamera(CameraIntrinsics{})) {
    frame_.depth_m = {depth_.data(), kWidth, kHeight, kWidth, 1};
  }

  Scene& wall() {
    std::fill(depth_.begin(), depth_.end(), kWall_m);
    return *this;
  }
  Scene& put(const Rectangle& r, float depth_m) {
    for (int y = std::max(0, r.y0); y < std::min(kHeight, r.y1); ++y) {
      for (int x = std::max(0, r.x0); x < std::min(kWidth, r.x1); ++x) {
        depth_[static_cast<std::size_t>(y * kWidth + x)] = depth_m;
      }
    }
    return *this;
  }

  /// A desk before the camera, which reaches over all of the view's width and hides what is behind it.
  static float desk_depth_m(int y) {
    constexpr float kUp = 0.8F;
    constexpr float kTowards = 0.6F;  // the desk's normal in the camera frame: (0, kUp, kTowards)
    constexpr float kDistance_m = 0.9F;
    const CameraIntrinsics camera;
    return kDistance_m / (kUp * static_cast<float>((y - camera.cy) / camera.fy) + kTowards);
  }
  Scene& desk() {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        float& depth_m = depth_[static_cast<std::size_t>(y * kWidth + x)];
        depth_m = depth_m > 0 ? std::min(depth_m, desk_depth_m(y)) : desk_depth_m(y);
      }
    }
    return *this;
  }

  /// Takes what stands there now as the next frame.
  void show(const Detections* detections = nullptr) {
    frame_.sequence = next_;
    frame_.stamp_utc_ns = static_cast<std::int64_t>(next_ + 1) * kPeriod_ns;
    ++next_;
    mask_.begin(frame_, Se3(), detections);
    mask_.settle(Se3());
  }

  /// The same where the camera's pose is not found.
  void show_lost() {
    frame_.sequence = next_;
    frame_.stamp_utc_ns = static_cast<std::int64_t>(next_ + 1) * kPeriod_ns;
    ++next_;
    mask_.begin(frame_, Se3(), nullptr);
    mask_.settle_lost();
  }

  /// What a detector says of the frame shown `frames_back` ago.
  Detections detected(const Rectangle& person, float score, std::uint64_t frames_back = 0) const {
    Detections found;
    found.sequence = next_ - frames_back;
    found.stamp_utc_ns = static_cast<std::int64_t>(found.sequence + 1) * kPeriod_ns;
    found.image_width = kWidth;
    found.image_height = kHeight;
    const Detection detection{person.box(), score};
    found.assign({&detection, 1});
    return found;
  }

  /// Share of the cells inside (or, with `outside`, beyond a margin of) the rectangle that are masked.
  double masked_share(const Rectangle& r, bool outside = false) const {
    constexpr int kMargin = 24;  // [pixels]
    const Rectangle around{r.x0 - kMargin, r.y0 - kMargin, r.x1 + kMargin, r.y1 + kMargin};
    int cells = 0;
    int masked = 0;
    for (int row = 0; row < kHeight / DepthGrid::kCell; ++row) {
      for (int column = 0; column < kWidth / DepthGrid::kCell; ++column) {
        const int x = column * DepthGrid::kCell + DepthGrid::kCell / 2;
        const int y = row * DepthGrid::kCell + DepthGrid::kCell / 2;
        if (outside ? !around.holds(x, y) : r.holds(x, y)) {
          ++cells;
          masked += mask_.cells()[static_cast<std::size_t>(row * (kWidth / DepthGrid::kCell) + column)] != 0 ? 1 : 0;
        }
      }
    }
    return static_cast<double>(masked) / cells;
  }

  const DynamicMask& mask() const { return mask_; }

 private:
  static DynamicConfig config(DynamicMode mode) {
    DynamicConfig config;
    config.mode = mode;
    return config;
  }

  std::vector<float> depth_ = std::vector<float>(static_cast<std::size_t>(kWidth * kHeight), kWall_m);
  RgbdFrame frame_;
  std::uint64_t next_ = 0;
  DynamicMask mask_;
};

TEST(DynamicMaskTest, NothingIsMaskedWhereNothingMoves) {
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    scene.wall().put(kBody, kBody_m).show();
    ASSERT_EQ(scene.mask().summary().masked_share, 0) << i;
  }
}

TEST(DynamicMaskTest, APersonIsCutOutOfTheirBoxByDepth) {
  Scene scene;
  scene.wall().put(kBody, kBody_m);
  const Rectangle generous{140, 80, 380, 480};
  const Detections found = scene.detected(generous, 0.9F);
  scene.show(&found);
  EXPECT_GT(scene.masked_share(kBody), 0.98);
  EXPECT_EQ(scene.masked_share(kBody, true), 0) << "the wall in the box is kept";
  EXPECT_EQ(scene.mask().summary().people, 1);
}

TEST(DynamicMaskTest, WholeBoxesAreMaskedThePapersWay) {
  Scene scene(DynamicMode::Boxes);
  scene.wall().put(kBody, kBody_m);
  const Rectangle generous{140, 80, 380, 480};
  const Detections found = scene.detected(generous, 0.9F);
  scene.show(&found);
  EXPECT_GT(scene.masked_share(generous), 0.98);
}

TEST(DynamicMaskTest, APersonReachesBeyondATightBox) {
  Scene scene;
  scene.wall().put(kBody, kBody_m);
  const Detections found = scene.detected({208, 150, 312, 480}, 0.9F);
  scene.show(&found);
  EXPECT_GT(scene.masked_share(kBody), 0.95);
}

TEST(DynamicMaskTest, APersonWithoutDepthInPlacesIsMaskedThereToo) {
  Scene scene;
  scene.wall().put(kBody, kBody_m).put({240, 130, 256, 146}, 0.0F);
  const Detections found = scene.detected(kBody, 0.9F);
  scene.show(&found);
  EXPECT_GT(scene.masked_share(kBody), 0.98);
}

TEST(DynamicMaskTest, ADarkScreenBesideAPersonIsKept) {
  constexpr Rectangle kScreen{kBody.x1 - 8, 120, 560, 300};  // the sensor sees no depth there
  Scene scene;
  scene.wall().put(kBody, kBody_m).put(kScreen, 0.0F);
  const Detections found = scene.detected(kBody, 0.9F);
  for (int i = 0; i < 10; ++i) {
    scene.show(&found);
  }
  EXPECT_GT(scene.masked_share({kBody.x0, kBody.y0, kScreen.x0, kBody.y1}), 0.95);
  EXPECT_LT(scene.masked_share({kScreen.x0 + 16, kScreen.y0, kScreen.x1, kScreen.y1}), 0.01);
}

TEST(DynamicMaskTest, APersonAtADeskIsCutOutOfTheDesk) {
  constexpr Rectangle kPerson{250, 60, 390, 480};
  constexpr float kPerson_m = 1.3F;
  int visible_to = kPerson.y0;  // below, the desk hides the person, whom it touches there
  while (Scene::desk_depth_m(visible_to) > kPerson_m) {
    ++visible_to;
  }
  const Rectangle visible{kPerson.x0, kPerson.y0, kPerson.x1, visible_to};
  ASSERT_GT(visible_to, 200);
  ASSERT_LT(visible_to, 400);
  Scene scene;
  scene.wall().put(kPerson, kPerson_m).desk();
  for (int i = 0; i < 10; ++i) {
    const Detections found = scene.detected({240, 55, 400, visible_to + 20}, 0.9F);
    scene.show(&found);
    EXPECT_GT(scene.masked_share(visible), 0.9) << i;  // all but the row of cells in which they touch
    EXPECT_LT(scene.masked_share(visible, true), 0.01) << i;
  }
}

TEST(DynamicMaskTest, APersonWhomAPlaneCutsInTwoIsWhole) {
  constexpr Rectangle kPerson{250, 60, 390, 480};
  Scene scene;
  scene.wall().desk();
  const float crossing_m = Scene::desk_depth_m(300);
  for (int y = kPerson.y0; y < kPerson.y1; ++y) {  // leans through the desk's plane, as one does who sits at the end of it
    scene.put({kPerson.x0, y, kPerson.x1, y + 1}, crossing_m + 0.0002F * static_cast<float>(y - 300));
  }
  const Detections found = scene.detected(kPerson, 0.9F);
  scene.show(&found);
  EXPECT_GT(scene.masked_share(kPerson), 0.95);
}

TEST(DynamicMaskTest, ABoxWithoutAnyDepthIsNoMover) {
  Scene scene;
  scene.wall().put({0, 0, kWidth, kHeight}, 0.0F);
  const Detections found = scene.detected(kBody, 0.9F);
  scene.show(&found);
  EXPECT_EQ(scene.mask().summary().masked_share, 0);
}

TEST(DynamicMaskTest, ALateDetectionIsCarriedToThePresent) {
  constexpr int kLag = 5;
  constexpr int kStep = 8;  // [pixels] a frame
  Scene scene;
  for (int i = 0; i < kLag; ++i) {
    scene.wall().put(kBody.moved(kStep * i), kBody_m).show();
  }
  const Rectangle present = kBody.moved(kStep * kLag);
  scene.wall().put(present, kBody_m);
  const Detections found = scene.detected(kBody, 0.9F, kLag);
  scene.show(&found);
  EXPECT_GT(scene.masked_share(present), 0.9);
  EXPECT_EQ(scene.masked_share(present, true), 0);
}

TEST(DynamicMaskTest, AMaskFollowsItsPersonWithoutFurtherDetections) {
  Scene scene;
  scene.wall().put(kBody, kBody_m);
  const Detections found = scene.detected(kBody, 0.9F);
  scene.show(&found);
  for (int i = 1; i <= 30; ++i) {
    const Rectangle present = kBody.moved(8 * i);
    scene.wall().put(present, kBody_m).show(&found);
    ASSERT_GT(scene.masked_share(present), 0.9) << i;
    ASSERT_EQ(scene.masked_share(present, true), 0) << i;
  }
}

TEST(DynamicMaskTest, WhatMovesIsFoundWithoutAnyDetection) {
  Scene scene;
  for (int i = 0; i < 30; ++i) {
    scene.wall().put(kBody, kBody_m).show();
  }
  int i = 0;
  for (; i < 25; ++i) {
    scene.wall().put(kBody.moved(8 * i), kBody_m).show();
  }
  const Rectangle present = kBody.moved(8 * (i - 1));
  EXPECT_GT(scene.masked_share(present), 0.9);
  EXPECT_EQ(scene.masked_share(present, true), 0) << "what comes to light behind it has not moved";
  EXPECT_EQ(scene.mask().summary().others, 1);
}

TEST(DynamicMaskTest, FurnitureThatWasMovedIsLearntAgain) {
  Scene scene;
  for (int i = 0; i < 50; ++i) {
    scene.wall().put(kBody.moved(8 * std::min(i, 20)), kBody_m).show();
  }
  const Rectangle there = kBody.moved(160);
  ASSERT_GT(scene.masked_share(there), 0.5);
  for (int i = 0; i < 150; ++i) {
    scene.wall().put(there, kBody_m).show();
  }
  EXPECT_EQ(scene.mask().summary().masked_share, 0);
}

TEST(DynamicMaskTest, WhoSitsStillStaysMaskedAsLongAsTheDetectorSeesThem) {
  Scene scene;
  for (int i = 0; i < 200; ++i) {
    scene.wall().put(kBody, kBody_m);
    const Detections found = scene.detected(kBody, 0.6F);
    scene.show(&found);
  }
  EXPECT_GT(scene.masked_share(kBody), 0.95);
}

TEST(DynamicMaskTest, FurnitureThatTouchesWhoSitsStillIsGivenBack) {
  constexpr Rectangle kShelf{kBody.x1, 200, 560, kHeight};
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    scene.wall().put(kShelf, kBody_m + 0.02F);
    for (int x = kBody.x0; x < kBody.x1; ++x) {  // round, as people are
      const float side = static_cast<float>(2 * x - kBody.x0 - kBody.x1) / static_cast<float>(kBody.x1 - kBody.x0);
      scene.put({x, kBody.y0, x + 1, kBody.y1}, kBody_m - 0.1F * (1 - side * side));
    }
    const bool sloppy = i < 5;  // so that part of the shelf was never seen but masked
    const Detections found = scene.detected(sloppy ? Rectangle{kBody.x0, kBody.y0, kBody.x1 + 100, kBody.y1} : kBody, 0.9F);
    scene.show(&found);
  }
  EXPECT_GT(scene.masked_share(kBody), 0.95);
  // Where the detector may have cut an elbow off, two cells of it stay.
  EXPECT_LT(scene.masked_share({kShelf.x0 + 24, kShelf.y0, kShelf.x1, kShelf.y1}), 0.01);
}

TEST(DynamicMaskTest, WhatWasSeenBeforeALossSaysNothingAfterIt) {
  Scene scene;
  for (int i = 0; i < 40; ++i) {
    scene.wall().show();
  }
  scene.show_lost();
  for (int i = 0; i < 40; ++i) {
    scene.wall().put({0, 0, kWidth, kHeight}, kBody_m).show();
    ASSERT_EQ(scene.mask().summary().masked_share, 0) << "another place, frame " << i;
  }
}

TEST(DynamicMaskTest, TheDeskThatAWalkerPassesIsKept) {
  constexpr Rectangle kDesk{0, 400, kWidth, kHeight};
  Scene scene;
  for (int i = 0; i < 40; ++i) {
    scene.wall().put(kDesk, kBody_m).show();
  }
  for (int i = 0; i < 40; ++i) {
    const Rectangle body = kBody.moved(6 * i - 100);
    scene.wall().put(kDesk, kBody_m).put(body, kBody_m);
    const Detections found = scene.detected({body.x0 - 80, body.y0, body.x1 + 80, body.y1}, 0.8F);
    scene.show(&found);
    if (i > 5) {
      EXPECT_LT(scene.masked_share(body, true), 0.01) << i;
      EXPECT_GT(scene.masked_share({body.x0, body.y0, body.x1, kDesk.y0}), 0.9) << i;
    }
  }
}

TEST(DynamicMaskTest, OneUnsureDetectionDoesNotStandAgainstAppearance) {
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    scene.wall().put(kBody, kBody_m).show();
  }
  scene.wall().put(kBody, kBody_m);
  const Detections found = scene.detected(kBody, 0.45F);
  scene.show(&found);
  EXPECT_EQ(scene.mask().summary().masked_share, 0) << "it stood there for two seconds";
}

TEST(DynamicMaskTest, ABoxOfLowScoreConfirmsWhoIsKnownAndMakesNobodyNew) {
  constexpr Rectangle kOther{440, 120, 560, 480};
  constexpr int kFrames = 200;  // longer than anybody is remembered
  Scene scene;
  for (int i = 0; i < kFrames; ++i) {
    scene.wall().put(kBody, kBody_m).put(kOther, kBody_m);
    Detections found = scene.detected(kBody, i == 0 ? 0.9F : 0.45F);
    if (i % 2 == 1) {
      found = scene.detected(kOther, 0.45F);
    }
    scene.show(&found);
  }
  EXPECT_GT(scene.masked_share(kBody), 0.95);
  EXPECT_EQ(scene.masked_share(kOther), 0);
}

TEST(DynamicMaskTest, TheBackgroundBesideAnEdgeIsKept) {
  Scene scene;
  const Rectangle body{204, 120, 324, 480};  // its edges cut cells in halves
  scene.wall().put(body, kBody_m);
  const Detections found = scene.detected(body, 0.9F);
  scene.show(&found);
  EXPECT_TRUE(scene.mask().is_mover(205, 300, kBody_m));
  EXPECT_FALSE(scene.mask().is_mover(202, 300, kWall_m));
  EXPECT_FALSE(scene.mask().is_mover(190, 300, kWall_m));
}

TEST(DynamicMaskTest, OldDetectionsAreNotUsed) {
  Scene scene;
  scene.wall().put(kBody, kBody_m);
  const Detections found = scene.detected(kBody, 0.9F);
  for (int i = 0; i < 20; ++i) {
    scene.show();
  }
  scene.show(&found);
  EXPECT_EQ(scene.mask().summary().masked_share, 0);
  EXPECT_EQ(scene.mask().summary().detection_age_ns, -1);
}

}  // namespace
}  // namespace posed
