# At the end of an installation: what was written, with the content's hash, for `uninstall`. CMake's own list has names
# alone, and whoever has put another file there since would lose it.
string(REGEX REPLACE "/$" "" prefix "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}")
set(text "${prefix}\n")
foreach(path IN LISTS CMAKE_INSTALL_MANIFEST_FILES)
  file(SHA256 "$ENV{DESTDIR}${path}" hash)
  string(APPEND text "${hash}  $ENV{DESTDIR}${path}\n")
endforeach()
file(WRITE "${MANIFEST}" "${text}")
