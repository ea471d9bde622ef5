# The renderer "gpu": kernels in GLSL, compiled to SPIR-V here and carried in the library; Vulkan's own library is opened
# at run time.
find_path(POINTFLIGHT_VULKAN_HEADERS vulkan/vulkan_core.h)
find_program(POINTFLIGHT_GLSLANG glslangValidator)
if(NOT POINTFLIGHT_GPU OR NOT POINTFLIGHT_VULKAN_HEADERS OR NOT POINTFLIGHT_GLSLANG)
  message(STATUS "Vulkan headers or glslangValidator not found: --renderer gpu is left out (libvulkan-dev glslang-tools)")
  pointflight_module(gpu WITHOUT "/gpu/(internal/.*|gpu_.*)[.]cpp$" PUBLIC pointflight_render pointflight_map_import)
  return()
endif()
set(POINTFLIGHT_HAS_GPU ON)

set(kernel_folder ${PROJECT_SOURCE_DIR}/pointflight/gpu/kernel)
file(GLOB kernel_texts CONFIGURE_DEPENDS ${kernel_folder}/*.glsl)
set(kernels)
file(MAKE_DIRECTORY ${generated}/gpu/kernels)
# pointflight_kernel(name source definitions...): into ${generated}/gpu/kernels/${name}.inc
function(pointflight_kernel name source)
  set(code ${generated}/gpu/kernels/${name}.inc)
  set(compile ${POINTFLIGHT_GLSLANG} -V --quiet --target-env vulkan1.1 ${ARGN} -I${kernel_folder} --vn ${name} -o ${code}
    ${kernel_folder}/${source})
  if(NOT EXISTS ${code})
    execute_process(COMMAND ${compile} OUTPUT_QUIET)  # for linters, which build nothing
  endif()
  add_custom_command(OUTPUT ${code} COMMAND ${compile} DEPENDS ${kernel_folder}/${source} ${kernel_texts}
    COMMENT "Compiling kernel ${name}" VERBATIM)
  set(kernels ${kernels} ${code} PARENT_SCOPE)
endfunction()
foreach(exact 0 1 2)
  pointflight_kernel(paper_${exact} paper.comp -DEXACT_BY=${exact})
  foreach(split 0 1)
    foreach(persistent 0 1)
      pointflight_kernel(rays_${split}_${persistent}_${exact} rays.comp
        -DSPLIT=${split} -DPERSISTENT=${persistent} -DEXACT_BY=${exact})
    endforeach()
    pointflight_kernel(wide_${split}_${exact} wide.comp -DSPLIT=${split} -DEXACT_BY=${exact})
  endforeach()
endforeach()
add_custom_target(pointflight_kernels DEPENDS ${kernels})

pointflight_module(gpu WITHOUT "/without_vulkan[.]cpp$" PUBLIC pointflight_render pointflight_map_import PRIVATE fmt::fmt ${CMAKE_DL_LIBS})
add_dependencies(pointflight_gpu pointflight_kernels)
target_include_directories(pointflight_gpu SYSTEM PRIVATE ${POINTFLIGHT_VULKAN_HEADERS})
