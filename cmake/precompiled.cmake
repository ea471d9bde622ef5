# What nearly every source includes, compiled once for all libraries (position-independent) and once
# for all tests: 15 to 30 % of a build's time. -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON builds without,
# which lint does, for it builds none; with -DPOINTFLIGHT_BATCH=0 as well it shows that each source
# includes what it uses.
set(POINTFLIGHT_COMMON_HEADERS
  <algorithm> <array> <chrono> <cmath> <cstdint> <functional> <map> <memory> <optional> <span>
  <string> <string_view> <utility> <variant> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h>)

# For ccache: https://ccache.dev/manual/4.7.5.html#_precompiled_headers
function(pointflight_cacheable_precompiled target)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -fpch-preprocess)
  else()
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
  endif()
endfunction()

# pointflight_precompile(name headers...): a target to take precompiled headers from
function(pointflight_precompile name)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cpp CONTENT "// holds precompiled headers\n")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE Eigen3::Eigen fmt::fmt)
  pointflight_target_options(${name})
  pointflight_cacheable_precompiled(${name})
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()

function(pointflight_use_precompiled target from)
  pointflight_cacheable_precompiled(${target})
  target_compile_definitions(${target} PRIVATE  # as where they were compiled
    $<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>)
  target_precompile_headers(${target} REUSE_FROM ${from})
endfunction()

pointflight_precompile(pointflight_precompiled ${POINTFLIGHT_COMMON_HEADERS})
set_target_properties(pointflight_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON)
if(POINTFLIGHT_FUZZ)
  # clang takes them only from where the same is instrumented
  pointflight_precompile(pointflight_precompiled_fuzz ${POINTFLIGHT_COMMON_HEADERS})
  set_target_properties(pointflight_precompiled_fuzz PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(pointflight_precompiled_fuzz PRIVATE -fsanitize=fuzzer-no-link)
endif()
