# `cmake --install` gives the program, the library with headers, the data, and a CMake package.
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY POINTFLIGHT_MODULES)
install(TARGETS ${modules} EXPORT pointflight ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS pointflight RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
# file by file: CMake would make folders that hold none of these, and `uninstall` knows of files alone
foreach(root ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/generated)
  file(GLOB_RECURSE headers RELATIVE ${root} CONFIGURE_DEPENDS ${root}/pointflight/*.hpp)
  list(FILTER headers EXCLUDE REGEX "-inl\\.hpp$|/ros[12]/|/dds/|/mpi/")
  foreach(header IN LISTS headers)
    get_filename_component(folder ${header} DIRECTORY)
    install(FILES ${root}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder})
  endforeach()
endforeach()
install(DIRECTORY data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/pointflight)
install(EXPORT pointflight NAMESPACE pointflight:: FILE pointflight-targets.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/pointflight)
set(POINTFLIGHT_DATA ${CMAKE_INSTALL_DATADIR}/pointflight)
configure_package_config_file(cmake/pointflight-config.cmake.in
  ${PROJECT_BINARY_DIR}/pointflight-config.cmake
  PATH_VARS POINTFLIGHT_DATA
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/pointflight)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/pointflight-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/pointflight-config.cmake
              ${PROJECT_BINARY_DIR}/pointflight-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/pointflight)

# what `cmake --install` wrote goes again by: cmake --build BUILD --target uninstall
set(installed ${PROJECT_BINARY_DIR}/installed.txt)
install(CODE "set(MANIFEST \"${installed}\")")
install(SCRIPT cmake/install_list.cmake)
add_custom_target(uninstall
  COMMAND ${CMAKE_COMMAND} -D MANIFEST=${installed}
          -P ${PROJECT_SOURCE_DIR}/cmake/uninstall.cmake)
