cmake_minimum_required(VERSION 3.21)
# Writes a header with the commit that SOURCE is at; run in each build.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --exclude=*
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#define POINTFLIGHT_COMMIT \"commit ${commit}\"\n")
