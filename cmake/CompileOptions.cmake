# posed_options: what every target of the project is compiled with.
add_library(posed_options INTERFACE)
target_include_directories(posed_options INTERFACE "${PROJECT_SOURCE_DIR}")
target_compile_options(posed_options INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Werror
  $<$<CXX_COMPILER_ID:Clang>:-Wthread-safety>  # the annotations of core/mutex.h
  # gcc 12 sees overlaps in "..." + std::string that are none, where it inlines them (its bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  # A fused multiply-add where one machine has it and another has not would make replays differ.
  -ffp-contract=off)
# Eigen's alignment and vector width must not depend on the flags of a single source file (the SIMD kernels have their own).
target_compile_definitions(posed_options INTERFACE EIGEN_MAX_ALIGN_BYTES=32)

if(POSED_SANITIZE)
  target_compile_options(posed_options INTERFACE -fsanitize=${POSED_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  # gcc's warning about uninitialised values is not reliable in instrumented code (its manual, -fsanitize=).
  target_compile_options(posed_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_link_options(posed_options INTERFACE -fsanitize=${POSED_SANITIZE})
endif()
if(POSED_COVERAGE)
  target_compile_options(posed_options INTERFACE --coverage -O0)
  target_link_options(posed_options INTERFACE --coverage)
endif()
if(POSED_FUZZ)
  target_compile_options(posed_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# posed_library(NAME SOURCES ...): one static library a folder, its dependencies PRIVATE unless its headers show them.
function(posed_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(posed_${name} STATIC ${ARG_SOURCES})
  target_link_libraries(posed_${name} PUBLIC posed_options ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
endfunction()
