# The publisher against real multicast; the subscriber is a program of its own, as users' are.
add_executable(pose_subscriber pose_subscriber.cpp)
target_link_libraries(pose_subscriber PRIVATE posed_options posed_messages lcm::lcm)

posed_test(lcm_delivery_test
  SOURCES lcm_delivery_test.cpp network_namespace.cpp
  LIBRARIES posed_daemon posed_core
  LABELS system)
target_compile_definitions(lcm_delivery_test PRIVATE POSED_SUBSCRIBER="$<TARGET_FILE:pose_subscriber>")
add_dependencies(lcm_delivery_test pose_subscriber)

posed_test(kill_test SOURCES kill_test.cpp LIBRARIES posed_slam posed_config posed_core LABELS system)
target_compile_definitions(kill_test PRIVATE POSED_DAEMON="$<TARGET_FILE:posed>")
add_dependencies(kill_test posed)
