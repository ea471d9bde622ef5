#pragma once

#include <string>

#include "pointflight/core/input_error.hpp"

namespace pointflight {

/// Runs `action`; an InputError of more than one line is a finding.
template <class Action>
void expect_one_line(const Action& action) {
  try {
    action();
  } catch (const InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
}

}  // namespace pointflight
