// What is left to say and clean up with once memory has run out.
#pragma once

#include <string>

namespace pointflight::apps {

/// Sets some memory aside, for destructors that allocate while a `std::bad_alloc` unwinds the
/// stack. A destructor that finds no memory all the same ends the process: with `line` on standard
/// error and exit code 2, never with an abort. Once in a process, before other threads start.
void keep_memory_reserve(const std::string& line);

/// Gives back what was set aside: what follows needs it.
void release_memory_reserve();

}  // namespace pointflight::apps
