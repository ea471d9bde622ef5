#pragma once

namespace pointflight::testing {

extern const char* const kSource;        ///< The project's folder.
extern const char* const kProgram;       ///< The program that is tested.
extern const char* const kScarceMemory;  ///< A library whose malloc fails at times.
extern const char* const kSharedData;    ///< Maps and scans that may be there.

}  // namespace pointflight::testing
