#pragma once

#include <string>
#include <string_view>

#include "pointflight/core/progress.hpp"

namespace pointflight::apps {

/// A progress line on stderr for work that takes over a second: rewritten in place on a terminal, a
/// line every ten per cent elsewhere.
Progress terminal_progress();

/// Thrown out of work that a signal ended; main() turns it into the exit code.
struct Interrupted {};

/// The same, and throws Interrupted after SIGINT, SIGTERM or SIGHUP, so that destructors remove
/// what is half-written.
Progress interruptible_progress();

/// Ends an open progress line.
void end_progress();

/// Text on stderr, as it is; never fails.
void say(std::string_view text);

/// Text that quotes a file, for a terminal: control characters, escape sequences among them, become
/// '?'.
std::string printable(std::string_view text);

/// A line on stderr, made `printable`.
void log(std::string_view text);

/// This process's command line, quoted if a shell would need it.
std::string command_line();

/// "1.2 M", "34 k", "567".
std::string short_count(double count);

/// True after SIGINT, SIGTERM or SIGHUP (a closed terminal; `nohup` is honoured).
/// `catch_interrupts` installs the handlers.
void catch_interrupts();
bool interrupted();

/// From now on the process has to end without the destructors of static objects: a library's thread
/// that could not be ended may still use them.
void leave_static_objects();
[[nodiscard]] bool must_leave_static_objects();

}  // namespace pointflight::apps
