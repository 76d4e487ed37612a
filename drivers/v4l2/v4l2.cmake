# The cameras by V4L2, and the depth node beside cameras of other drivers. drivers/CMakeLists.txt includes it.
option(POSED_V4L2 "Cameras by V4L2" ON)
check_include_file_cxx(linux/videodev2.h POSED_HAVE_VIDEODEV2)
if(POSED_V4L2 AND NOT POSED_HAVE_VIDEODEV2)
  message(STATUS "No linux/videodev2.h: built without cameras by V4L2 (POSED_V4L2)")
  set(POSED_V4L2 OFF CACHE BOOL "Cameras by V4L2" FORCE)
endif()
if(POSED_V4L2)
  target_sources(posed_drivers PRIVATE
    v4l2/color_node.cpp v4l2/depth_node.cpp v4l2/v4l2_camera.cpp v4l2/v4l2_controls.cpp v4l2/v4l2_device.cpp v4l2/v4l2_format.cpp
    v4l2/v4l2_listing.cpp v4l2/v4l2_negotiation.cpp v4l2/v4l2_source.cpp v4l2/v4l2_stamps.cpp v4l2/v4l2_stream.cpp v4l2/v4l2_system.cpp)
  target_compile_definitions(posed_drivers PRIVATE POSED_HAS_V4L2=1)
endif()
