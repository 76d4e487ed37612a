# Colour cameras by libcamera, with depth from a V4L2 node. drivers/CMakeLists.txt includes it after v4l2/v4l2.cmake.
option(POSED_LIBCAMERA "Cameras by libcamera" ON)
if(POSED_LIBCAMERA)
  pkg_check_modules(LIBCAMERA IMPORTED_TARGET GLOBAL libcamera)
  if(NOT LIBCAMERA_FOUND)
    message(STATUS "No libcamera (libcamera-dev): built without cameras by libcamera (POSED_LIBCAMERA)")
    set(POSED_LIBCAMERA OFF CACHE BOOL "Cameras by libcamera" FORCE)
  elseif(NOT POSED_V4L2)
    message(STATUS "POSED_V4L2 is off: built without cameras by libcamera (POSED_LIBCAMERA), whose depth comes from a V4L2 node")
    set(POSED_LIBCAMERA OFF CACHE BOOL "Cameras by libcamera" FORCE)
  endif()
endif()
if(POSED_LIBCAMERA)
  target_sources(posed_drivers PRIVATE
    libcamera/color_image.cpp libcamera/libcamera_camera.cpp libcamera/libcamera_controls.cpp libcamera/libcamera_device.cpp
    libcamera/libcamera_listing.cpp libcamera/libcamera_manager.cpp libcamera/libcamera_source.cpp libcamera/sensor_stamps.cpp)
  target_link_libraries(posed_drivers PRIVATE PkgConfig::LIBCAMERA)
  target_compile_definitions(posed_drivers PUBLIC POSED_HAS_LIBCAMERA)
endif()
