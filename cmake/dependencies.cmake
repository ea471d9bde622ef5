# Third-party libraries, all from the distribution's packages (./dev installs them).

# CMake packages set their include folders SYSTEM, so that our warnings stay ours.
find_package(Eigen3 3.3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(nanoflann REQUIRED)
find_package(Python3 REQUIRED COMPONENTS Interpreter)  # tools/messages.py
find_package(PkgConfig REQUIRED)
pkg_check_modules(CAIRO REQUIRED IMPORTED_TARGET GLOBAL cairo)
find_package(boost_headers 1.74 REQUIRED)  # Beast and Asio
if(POINTFLIGHT_TBB)
  find_package(TBB REQUIRED)
endif()
if(POINTFLIGHT_ASSIMP)
  find_package(assimp QUIET)
  # Debian's package makes the target assimp::assimp; Ubuntu 22.04's only variables
  if(assimp_FOUND AND NOT TARGET assimp::assimp)
    add_library(assimp::assimp INTERFACE IMPORTED)
    target_link_libraries(assimp::assimp INTERFACE ${ASSIMP_LIBRARIES})
    target_include_directories(assimp::assimp SYSTEM INTERFACE ${ASSIMP_INCLUDE_DIRS})
  endif()
endif()
if(TARGET assimp::assimp)
  set(POINTFLIGHT_HAS_ASSIMP ON)
else()
  set(POINTFLIGHT_HAS_ASSIMP OFF)
  message(STATUS "assimp not found: meshes cannot be imported (install libassimp-dev)")
endif()

# sleef, xxhash and lzf come without a CMake package of a stable name: linked as plain libraries.
foreach(library sleef xxhash lzf lzma hwy md zstd lz4 z zip sqlite3 tinyxml2)
  find_library(POINTFLIGHT_${library} ${library} REQUIRED)
endforeach()

# functions of many numbers whose bits are those of one (SLEEF may be built without some of them)
include(CheckLibraryExists)
foreach(name IN ITEMS logd8_u10avx512fnofma erfcd4_u15avx sincosd2_u10sse4 expd2_u10sse2)
  check_library_exists(${POINTFLIGHT_sleef} Sleef_cinz_${name} "" POINTFLIGHT_SLEEF_${name})
  if(NOT POINTFLIGHT_SLEEF_${name})
    set(POINTFLIGHT_SLEEF_LACKS_VECTORS ON)
  endif()
endforeach()

# Random123 is headers only.
find_path(POINTFLIGHT_RANDOM123 Random123/philox.h REQUIRED)

# what Eigen aligns matrices to by the flags of this build
include(CheckCXXSourceCompiles)
set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen)
foreach(bytes IN ITEMS 16 32 64)
  check_cxx_source_compiles("#include <Eigen/Core>
    static_assert(EIGEN_MAX_ALIGN_BYTES == ${bytes});
    int main() {}" POINTFLIGHT_EIGEN_ALIGNS_${bytes})
  if(POINTFLIGHT_EIGEN_ALIGNS_${bytes})
    set(POINTFLIGHT_EIGEN_ALIGNMENT ${bytes})
  endif()
endforeach()
unset(CMAKE_REQUIRED_LIBRARIES)
if(NOT POINTFLIGHT_EIGEN_ALIGNMENT)
  message(FATAL_ERROR "Eigen's alignment of matrices could not be found out")
endif()
