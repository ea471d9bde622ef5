#pragma once

#include <stdexcept>
#include <string>

namespace pointflight {

/// Something outside the program is wrong: a file, a flag, a message, a full disk.
///
/// The text is one line for the user: where (file, line or byte), what was found, what would do.
/// The command line prints it and exits with 2. Our own mistakes are assertions, not InputErrors.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& text) : std::runtime_error(text) {}
};

}  // namespace pointflight
