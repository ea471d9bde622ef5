#pragma once

#include <string>
#include <vector>

#include "apps/cli.hpp"

namespace pointflight::apps {

/// The words of a command line as CLI11 shall see them: `help fly` is `fly --help`.
std::vector<std::string> command_words(int argc, const char* const* argv);

/// What is wrong with a command line, in one line for the user: commands and flags that do not
/// exist in the order they were given, with the one that was meant.
std::string explain(const CLI::ParseError& error,
                    const CLI::App& app,
                    const std::vector<std::string>& words);

/// The command tree as a page for man(1), in roff.
std::string man_page(const CLI::App& app, const std::string& version);

/// The command tree as a completion script for bash, which zsh takes too after bashcompinit.
std::string bash_completion(const CLI::App& app);

}  // namespace pointflight::apps
