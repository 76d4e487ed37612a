#include "drivers/camera_lister.h"

#include <utility>

#ifdef POSED_HAS_OPENNI2
#include "drivers/openni2/openni2_source.h"
#endif
#ifdef POSED_HAS_V4L2
#include "drivers/v4l2/v4l2_listing.h"
#endif
#ifdef POSED_HAS_LIBCAMERA
#include "drivers/libcamera/libcamera_listing.h"
#endif

namespace posed {

namespace {

[[maybe_unused]] DriverListing listing_of(std::string kind, Result<std::vector<ListedCamera>> found) {
  DriverListing listing{std::move(kind), true, {}, {}};
  if (found) {
    listing.cameras = *std::move(found);
  } else {
    listing.status = tl::unexpected(std::move(found).error());
  }
  return listing;
}

[[maybe_unused]] DriverListing left_out(std::string kind) {
  return {std::move(kind), false, {}, {}};
}

}  // namespace

std::vector<DriverListing> list_cameras() {
  std::vector<DriverListing> listings;
#ifdef POSED_HAS_OPENNI2
  listings.push_back(listing_of("openni2", list_openni2_cameras()));
#else
  listings.push_back(left_out("openni2"));
#endif
#ifdef POSED_HAS_V4L2
  listings.push_back(listing_of("v4l2", list_v4l2_cameras()));
#else
  listings.push_back(left_out("v4l2"));
#endif
#ifdef POSED_HAS_LIBCAMERA
  listings.push_back(listing_of("libcamera", list_libcamera_cameras()));
#else
  listings.push_back(left_out("libcamera"));
#endif
  return listings;
}

}  // namespace posed
