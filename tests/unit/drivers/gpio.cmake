posed_test(gpio_test
  SOURCES gpio/blink_pattern_test.cpp gpio/fake_lines.cpp gpio/gpio_thread_test.cpp gpio/gpio_worker_test.cpp
  LIBRARIES posed_drivers posed_core)
# A program of its own: it runs with a library before the C library, as the sanitizers do: one or the other.
if(POSED_GPIO AND NOT POSED_SANITIZE)
  pkg_check_modules(UMOCKDEV REQUIRED IMPORTED_TARGET umockdev-1.0)
  posed_test(libgpiod_test
    SOURCES gpio/libgpiod_access_test.cpp
    LIBRARIES posed_drivers posed_core PkgConfig::UMOCKDEV)
endif()
