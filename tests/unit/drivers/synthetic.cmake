posed_test(synthetic_test
  SOURCES "${CMAKE_CURRENT_LIST_DIR}/synthetic_camera_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/synthetic_path_test.cpp"
          "${CMAKE_CURRENT_LIST_DIR}/synthetic_places_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/synthetic_sensor_test.cpp"
          "${CMAKE_CURRENT_LIST_DIR}/synthetic_source_test.cpp" "${CMAKE_CURRENT_LIST_DIR}/synthetic_world_test.cpp"
  LIBRARIES posed_drivers)
