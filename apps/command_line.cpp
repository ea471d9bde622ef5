#include "apps/command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/cli.hpp"
#include "pointflight/core/settings.hpp"

namespace pointflight::apps {
namespace {

std::vector<const CLI::App*> subcommands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> names_of(const std::vector<const CLI::App*>& apps) {
  std::vector<std::string> names;
  names.reserve(apps.size());
  for (const CLI::App* app : apps) names.push_back(app->get_name());
  return names;
}

/// "--lidar", "-o", ... of a command.
std::vector<std::string> flags_of(const CLI::App& app) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
    for (const std::string& name : option->get_snames()) flags.push_back("-" + name);
  }
  return flags;
}

/// "pointflight map import"
std::string full_name(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  return parent == nullptr ? app.get_name() : full_name(*parent) + " " + app.get_name();
}

std::string guess(const std::string& word, const std::vector<std::string>& known) {
  const std::string near = closest_word(word, known);
  return near.empty() ? std::string() : fmt::format(", did you mean '{}'?", near);
}

/// The commands below `app` whose last word is this one: "map info".
void find_commands(const CLI::App& app,
                   const std::string& word,
                   const std::string& path,
                   std::vector<std::string>& found) {
  for (const CLI::App* command : subcommands_of(app)) {
    const std::string name = path + command->get_name();
    if (command->get_name() == word) found.push_back(name);
    find_commands(*command, word, name + " ", found);
  }
}

/// How far the words lead down the tree, and the first one that names no command, if there is one.
struct Reached {
  const CLI::App* app;
  std::string unknown;
};

Reached follow(const CLI::App& root, const std::vector<std::string>& words) {
  const CLI::App* app = &root;
  for (const std::string& word : words) {
    const auto below = subcommands_of(*app);
    if (below.empty()) break;
    if (word.starts_with("-")) continue;
    const auto found = std::find_if(
        below.begin(), below.end(), [&](const CLI::App* a) { return a->get_name() == word; });
    if (found == below.end()) return {app, word};
    app = *found;
  }
  return {app, {}};
}

std::string escaped_roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  // a line that begins with these is a request to roff
  if (!out.empty() && (out.front() == '.' || out.front() == '\'')) out.insert(0, "\\&");
  return out;
}

void add_options(const CLI::App& app, std::string& page) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_name() == "--help" || option->get_description().empty()) continue;
    const std::string name =
        option->get_positional() ? option->get_name(true) : option->get_name(false, true);
    const bool takes_value = option->get_items_expected_max() > 0 && !option->get_positional();
    const std::string value = takes_value ? " " + option->get_type_name() : std::string();
    page += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n",
                        escaped_roff(name),
                        escaped_roff(value),
                        escaped_roff(option->get_description()));
  }
}

void add_commands(const CLI::App& app, std::string& page) {
  for (const CLI::App* command : subcommands_of(app)) {
    const auto below = subcommands_of(*command);
    if (below.empty()) {
      page += fmt::format(".SS {}\n{}\n",
                          escaped_roff(full_name(*command)),
                          escaped_roff(command->get_description()));
      add_options(*command, page);
    }
    add_commands(*command, page);
  }
}

/// For completion: "map import" and what may follow it, for every command.
struct Completed {
  std::string path;
  std::vector<std::string> words;
};

void collect(const CLI::App& app, const std::string& path, std::vector<Completed>& all) {
  const auto below = subcommands_of(app);
  std::vector<std::string> words = below.empty() ? flags_of(app) : names_of(below);
  if (below.empty()) std::erase(words, "-h");
  all.push_back({path, words});
  for (const CLI::App* command : below) {
    collect(*command, path + (path.empty() ? "" : " ") + command->get_name(), all);
  }
}

}  // namespace

std::vector<std::string> command_words(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  return words;
}

std::string explain(const CLI::ParseError& error,
                    const CLI::App& app,
                    const std::vector<std::string>& words) {
  const Reached reached = follow(app, words);
  const std::string see = fmt::format("see {} --help", full_name(*reached.app));
  const auto below = names_of(subcommands_of(*reached.app));
  if (!reached.unknown.empty()) {
    std::string meant = guess(reached.unknown, below);
    std::vector<std::string> elsewhere;
    find_commands(app, reached.unknown, "", elsewhere);
    if (!elsewhere.empty()) {
      meant = fmt::format(", did you mean '{}'?", fmt::join(elsewhere, "' or '"));
    }
    return fmt::format(
        "unknown command '{}'{}; {}",
        reached.unknown,
        meant.empty() ? fmt::format(", expected one of: {}", fmt::join(below, ", ")) : meant,
        see);
  }
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) {
    const std::vector<std::string> left = app.remaining(true);
    const std::vector<std::string> known = flags_of(*reached.app);
    std::vector<std::string> unknown;  // in the order given
    std::string meant;
    for (const std::string& word : words) {
      if (std::find(left.begin(), left.end(), word) == left.end()) continue;
      unknown.push_back(word);
      if (meant.empty() && word.starts_with("-")) meant = guess(word, known);
    }
    return fmt::format("not expected: {}{}; {}", fmt::join(unknown, " "), meant, see);
  }
  if (!below.empty()) {
    return fmt::format("a command is missing, one of: {}; {}", fmt::join(below, ", "), see);
  }
  return fmt::format("{}; {}", error.what(), see);
}

std::string man_page(const CLI::App& app, const std::string& version) {
  std::string page = fmt::format(
      ".TH POINTFLIGHT 1 \"\" \"pointflight {}\" \"User Commands\"\n"
      ".SH NAME\npointflight \\- {}\n"
      ".SH SYNOPSIS\n\\fBpointflight\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n"
      ".SH COMMANDS\n",
      escaped_roff(version),
      escaped_roff(app.get_description().substr(app.get_description().find(':') + 2)));
  add_commands(app, page);
  page +=
      ".SH EXIT STATUS\n"
      ".TP\n0\nDone. A run is completed; its time (--duration) is up; it was idle: "
      "nothing was left to do and nobody commanded it.\n"
      ".TP\n1\nA run ended with its mission unfinished, by a collision, or because a vehicle left "
      "the map.\n"
      ".TP\n2\nSomething outside is wrong; one line on standard error says what, where, and what "
      "to "
      "do.\n"
      ".TP\n130\nInterrupted; files are closed.\n"
      ".SH ENVIRONMENT\n"
      ".TP\n\\fBPOINTFLIGHT_DATA\\fR\nThe folder with lidars/, vehicles/ and ros_profiles/, "
      "instead "
      "of the one that came with the program.\n"
      ".TP\n\\fBROS_MASTER_URI, ROS_DOMAIN_ID, CYCLONEDDS_URI\\fR\nAs for every ROS node.\n";
  return page;
}

std::string bash_completion(const CLI::App& app) {
  std::vector<Completed> all;
  collect(app, "", all);
  std::string paths;
  std::string cases;
  for (const Completed& command : all) {
    const std::string quoted = "'" + command.path + "'";
    if (!command.path.empty()) paths += (paths.empty() ? "" : " | ") + quoted;
    cases += fmt::format("    {}) words='{}' ;;\n", quoted, fmt::join(command.words, " "));
  }
  constexpr const char* kScript =
      R"(# completion of pointflight for bash; for zsh: autoload -U +X bashcompinit && bashcompinit first
_pointflight() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} path='' words='' i
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "${{path:+$path }}${{COMP_WORDS[i]}}" in
      {}) path="${{path:+$path }}${{COMP_WORDS[i]}}" ;;
    esac
  done
  case $path in
{}  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  # what is no flag may be a file
  [[ $current == -* ]] || COMPREPLY+=($(compgen -f -- "$current"))
}}
complete -o filenames -F _pointflight pointflight
)";
  return fmt::format(kScript, paths, cases);
}

}  // namespace pointflight::apps
