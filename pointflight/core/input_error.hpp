#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace pointflight {

/// Something outside the program is wrong: a file, a flag, a message, a full disk.
///
/// The text is one line for the user: where (file, line or byte), what was found, what would do.
/// The command line prints it and exits with 2. Our own mistakes are assertions, not InputErrors.
class InputError : public std::runtime_error {
 public:
  /// Control characters in `text` become '?': what it quotes comes from outside.
  explicit InputError(std::string text) : std::runtime_error(one_line(std::move(text))) {}

 private:
  /// What is quoted from a file may hold line breaks and escape sequences.
  static std::string one_line(std::string text) {
    for (char& c : text) c = static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? '?' : c;
    return text;
  }
};

/// Runs `action` for what the key of a settings file names; an InputError in it is given the
/// location of the key ("scenario.yaml:7") in front.
template <class Action>
auto at_key(const std::string& location, const std::string& key, const Action& action) {
  try {
    return action();
  } catch (const InputError& error) {
    throw InputError(location + ": " + key + ": " + error.what());
  }
}

}  // namespace pointflight
