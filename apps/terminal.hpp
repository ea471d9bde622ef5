#pragma once

#include <string>
#include <string_view>

#include "pointflight/core/progress.hpp"

namespace pointflight::apps {

/// A progress line on stderr for work that takes over a second: rewritten in place on a terminal, a
/// line every ten per cent elsewhere.
Progress terminal_progress();

/// Ends an open progress line.
void end_progress();

/// A line on stderr.
void log(std::string_view text);

/// "1.2 M", "34 k", "567".
std::string short_count(double count);

/// True after SIGINT or SIGTERM. `catch_interrupts` installs the handlers.
void catch_interrupts();
bool interrupted();

}  // namespace pointflight::apps
