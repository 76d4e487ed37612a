#include "drivers/libcamera/libcamera_listing.h"

#include <libcamera/camera.h>
#include <libcamera/property_ids.h>

#include "drivers/libcamera/libcamera_manager.h"

namespace posed {

namespace {

ListedCamera listed(libcamera::Camera& camera) {
  ListedCamera result{"libcamera", camera.id(), camera.properties().get(libcamera::properties::Model).value_or(""), {}};
  const std::unique_ptr<libcamera::CameraConfiguration> configuration =
      camera.generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (!configuration || configuration->empty()) {
    return result;
  }
  const libcamera::StreamFormats& formats = configuration->at(0).formats();
  for (const libcamera::PixelFormat& format : formats.pixelformats()) {
    if (find_readable(format) == nullptr) {
      continue;
    }
    for (const libcamera::Size& size : formats.sizes(format)) {
      result.formats.push_back({"color", format.toString(), static_cast<int>(size.width), static_cast<int>(size.height), 0});
    }
  }
  return result;
}

}  // namespace

Result<std::vector<ListedCamera>> list_libcamera_cameras() {
  const Result<libcamera::CameraManager*> manager = camera_manager();
  if (!manager) {
    return tl::unexpected<Error>(manager.error());
  }
  std::vector<ListedCamera> cameras;
  for (const std::shared_ptr<libcamera::Camera>& camera : (*manager)->cameras()) {
    cameras.push_back(listed(*camera));
  }
  return cameras;
}

}  // namespace posed
