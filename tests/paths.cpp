#include "tests/paths.hpp"

#include "test_paths.hpp"

namespace pointflight::testing {

const char* const kSource = POINTFLIGHT_SOURCE;
const char* const kProgram = POINTFLIGHT_PROGRAM;
const char* const kScarceMemory = POINTFLIGHT_SCARCE_MEMORY;
const char* const kSharedData = POINTFLIGHT_SOURCE "/../shared/data";

}  // namespace pointflight::testing
