# The runner's own kernels, compiled once for each instruction set; posed_detect contains the objects.
# posed_detect_kernels(TABLE FLAGS ...): they are hot, so also development builds optimise them. Nothing here asks for floating-point
# exceptions, and clamping without branches is what vectorises.
function(posed_detect_kernels table)
  add_library(posed_detect_${table} OBJECT kernels/tensor_kernels.cpp)
  target_link_libraries(posed_detect_${table} PRIVATE posed_options)
  target_compile_definitions(posed_detect_${table} PRIVATE POSED_KERNELS=${table})
  target_compile_options(posed_detect_${table} PRIVATE -O3 -fno-trapping-math ${ARGN})
endfunction()

posed_detect_kernels(kTensorKernelsBaseline)
set(POSED_DETECT_KERNEL_OBJECTS $<TARGET_OBJECTS:posed_detect_kTensorKernelsBaseline>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  posed_detect_kernels(kTensorKernelsAvx2 -mavx2)
  posed_detect_kernels(kTensorKernelsAvx512 -mavx2 -mavx512f -mavx512bw -mavx512dq -mavx512vl)
  list(APPEND POSED_DETECT_KERNEL_OBJECTS $<TARGET_OBJECTS:posed_detect_kTensorKernelsAvx2> $<TARGET_OBJECTS:posed_detect_kTensorKernelsAvx512>)
endif()
