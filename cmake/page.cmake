# The page of `--view`: own code, three.js and Foxglove's readers of ROS messages in one
# file, by esbuild. ./dev fetches them by npm; without them the program is built as ever, and --view says what is missing.
set(modules ${PROJECT_SOURCE_DIR}/build/page_modules/node_modules)
set(page ${PROJECT_BINARY_DIR}/page)
target_compile_definitions(pointflight_view PRIVATE POINTFLIGHT_BUILT_PAGE="${page}")
set(esbuild ${modules}/.bin/esbuild)
if(NOT EXISTS ${esbuild} OR NOT EXISTS ${modules}/three/package.json OR
   NOT EXISTS ${modules}/@foxglove/rosmsg2-serialization/package.json)
  message(STATUS "esbuild, three.js or readers of messages not found: the page of --view is left out (./dev build fetches them by npm)")
  return()
endif()
file(GLOB page_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/pointflight/view/page/*)
add_custom_command(
  OUTPUT ${page}/page.js ${page}/index.html
  COMMAND ${CMAKE_COMMAND} -E make_directory ${page}
  COMMAND ${CMAKE_COMMAND} -E env NODE_PATH=${modules} ${esbuild} ${PROJECT_SOURCE_DIR}/pointflight/view/page/main.js
          --bundle --minify --format=esm --target=es2022 --log-level=warning
          --legal-comments=inline --outfile=${page}/page.js
  COMMAND ${CMAKE_COMMAND} -E copy ${PROJECT_SOURCE_DIR}/pointflight/view/page/index.html ${page}/index.html
  DEPENDS ${page_sources}
  VERBATIM)
add_custom_target(pointflight_page ALL DEPENDS ${page}/page.js ${page}/index.html)
install(FILES ${page}/page.js ${page}/index.html DESTINATION ${CMAKE_INSTALL_DATADIR}/pointflight/page)
