# Cameras by V4L2 and what cameras of several drivers share.
posed_test(test_camera_parts
  SOURCES "${CMAKE_CURRENT_LIST_DIR}/depth_registration_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/frame_pairer_test.cpp"
          "${CMAKE_CURRENT_LIST_DIR}/yuv_conversion_test.cpp"
  LIBRARIES posed_drivers)
if(POSED_V4L2)
  add_library(fake_v4l2 STATIC "${PROJECT_SOURCE_DIR}/tests/support/fake_v4l2.cpp" "${PROJECT_SOURCE_DIR}/tests/support/fake_v4l2_controls.cpp")
  target_link_libraries(fake_v4l2 PUBLIC posed_options posed_drivers)
  posed_test(test_v4l2
    SOURCES "${CMAKE_CURRENT_LIST_DIR}/v4l2_controls_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/v4l2_faults_test.cpp"
            "${CMAKE_CURRENT_LIST_DIR}/v4l2_formats_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/v4l2_listing_test.cpp"
            "${CMAKE_CURRENT_LIST_DIR}/v4l2_soak_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/v4l2_stamps_test.cpp"
    LIBRARIES fake_v4l2 posed_drivers PkgConfig::TURBOJPEG fmt::fmt)
endif()
