# The presets that we develop with make warnings errors; no fused multiply-add anywhere: results must not depend on it.
function(pointflight_target_options target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wconversion -Wno-sign-conversion -ffp-contract=off
    $<$<BOOL:${POINTFLIGHT_WERROR}>:-Werror>)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  # Random123 and gcc 12's own headers as others' code
  target_include_directories(${target} SYSTEM PRIVATE ${POINTFLIGHT_RANDOM123})
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
    target_compile_options(${target} PRIVATE -march=armv8-a+crypto)  # Highway's NEON counts on it
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # false alarms of gcc 12 inside Eigen and libstdc++ at -O3
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized -Wno-array-bounds
                                             -Wno-stringop-overflow -Wno-restrict)
    if(POINTFLIGHT_BATCH)
      # takes the sources of a batch for headers, where a hidden part of a class must not be local
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
    endif()
  endif()
endfunction()

# pointflight_batched(result name sources...): sources to compile, POINTFLIGHT_BATCH of the given ones in each. Like
# CMake's unity builds, but the files that include them name no absolute paths, so that compilers' caches serve other
# clones. A source with definitions of its own, and a kernel, which Highway includes once per instruction set, stays alone.
function(pointflight_batched result name)
  if(NOT POINTFLIGHT_BATCH)
    set(${result} ${ARGN} PARENT_SCOPE)
    return()
  endif()
  set(all)
  set(batch "")
  set(in_batch 0)
  set(number 0)
  foreach(source IN LISTS ARGN)
    file(RELATIVE_PATH relative ${PROJECT_SOURCE_DIR} ${source})
    get_source_file_property(own ${source} COMPILE_DEFINITIONS)
    if(own OR source MATCHES "_kernel\\.cpp$")
      list(APPEND all ${source})
      continue()
    endif()
    string(APPEND batch "#include \"${relative}\"\n")
    math(EXPR in_batch "${in_batch} + 1")
    if(in_batch EQUAL POINTFLIGHT_BATCH)
      file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/batches/${name}_${number}.cpp CONTENT "${batch}" @ONLY)
      list(APPEND all ${PROJECT_BINARY_DIR}/batches/${name}_${number}.cpp)
      math(EXPR number "${number} + 1")
      set(in_batch 0)
      set(batch "")
    endif()
  endforeach()
  if(batch)
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/batches/${name}_${number}.cpp CONTENT "${batch}" @ONLY)
    list(APPEND all ${PROJECT_BINARY_DIR}/batches/${name}_${number}.cpp)
  endif()
  set(${result} ${all} PARENT_SCOPE)
endfunction()

# pointflight_module(name [FOLDER folder] [WITHOUT regex] PUBLIC libs... PRIVATE libs...): the library target pointflight::<name> from
# all sources in pointflight/<folder>, which is the name if none is given, but for folders that are targets of their own.
set(POINTFLIGHT_OWN_TARGETS map/import map/edit campaign/mpi share/dds)
function(pointflight_module name)
  cmake_parse_arguments(ARG "" "FOLDER;WITHOUT" "PUBLIC;PRIVATE" ${ARGN})
  if(NOT ARG_FOLDER)
    set(ARG_FOLDER ${name})
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/pointflight/${ARG_FOLDER}/*.cpp)
  foreach(folder IN LISTS POINTFLIGHT_OWN_TARGETS)
    if(NOT folder STREQUAL ARG_FOLDER)
      list(FILTER sources EXCLUDE REGEX "/pointflight/${folder}/")
    endif()
  endforeach()
  if(ARG_WITHOUT)
    list(FILTER sources EXCLUDE REGEX ${ARG_WITHOUT})
  endif()
  pointflight_batched(batches ${name} ${sources})
  add_library(pointflight_${name} STATIC ${batches})
  add_library(pointflight::${name} ALIAS pointflight_${name})
  set_target_properties(pointflight_${name} PROPERTIES EXPORT_NAME ${name}
                                                       POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(pointflight_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  target_compile_features(pointflight_${name} PUBLIC cxx_std_20)  # of whoever includes its headers
  pointflight_target_options(pointflight_${name})
  if(POINTFLIGHT_FUZZ AND name IN_LIST POINTFLIGHT_FUZZED)
    target_compile_options(pointflight_${name} PRIVATE -fsanitize=fuzzer-no-link)
    pointflight_use_precompiled(pointflight_${name} pointflight_precompiled_fuzz)
  else()
    pointflight_use_precompiled(pointflight_${name} pointflight_precompiled)
  endif()
  set_property(GLOBAL APPEND PROPERTY POINTFLIGHT_MODULES pointflight_${name})
endfunction()

# pointflight_messages(cpp|idl folder output options...): what tools/messages.py makes of the .msg files in a folder. It is
# made when the build is configured, and again whenever one of them changes.
function(pointflight_messages language folder output)
  set(tool ${PROJECT_SOURCE_DIR}/tools/messages.py)
  file(GLOB messages CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*/*.msg)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${tool} ${messages})
  execute_process(COMMAND ${Python3_EXECUTABLE} ${tool} ${language} ${PROJECT_SOURCE_DIR}/${folder} ${output} ${ARGN}
                  RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "tools/messages.py failed (above)")
  endif()
endfunction()

# pointflight_loaded(name SOURCES files... LIBRARIES libs...): pointflight_<name>, a library that the program loads when
# it is asked for (apps/modules.cpp), so that it needs none of these libraries itself.
function(pointflight_loaded name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_library(pointflight_${name} MODULE ${ARG_SOURCES})
  set_target_properties(pointflight_${name} PROPERTIES CXX_VISIBILITY_PRESET hidden
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/pointflight)
  target_compile_options(pointflight_${name} PRIVATE -Wall -Wextra $<$<BOOL:${POINTFLIGHT_WERROR}>:-Werror>)
  target_include_directories(pointflight_${name} PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/generated)
  target_link_libraries(pointflight_${name} PRIVATE ${ARG_LIBRARIES})
  install(TARGETS pointflight_${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/pointflight)
endfunction()
