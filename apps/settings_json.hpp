#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "pointflight/core/settings_json.hpp"

namespace pointflight::apps {

/// Settings as JSON, as a file would have them.
template <class Settings>
nlohmann::ordered_json json_of_settings(Settings& settings) {
  SettingsJson visitor;
  describe(visitor, settings);
  return nlohmann::ordered_json::parse(visitor.text());
}

/// JSON on stdout; text that is no UTF-8 does not stop it.
void print_json(const nlohmann::ordered_json& json);

/// A table of keys on stdout, as the pages in docs/ have it.
void print_reference(const std::string& rows);

}  // namespace pointflight::apps
