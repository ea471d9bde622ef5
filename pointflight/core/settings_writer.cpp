#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "pointflight/core/settings.hpp"

namespace pointflight {
namespace {

/// All digits, so that what is written reads back the same; 0, not -0.
std::string number_text(double value) {
  return fmt::format("{}", value == 0.0 ? 0.0 : value);
}

std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", number_text(v.x()), number_text(v.y()), number_text(v.z()));
}

std::string list_text(const std::vector<double>& values) {
  std::vector<std::string> texts;
  texts.reserve(values.size());
  for (const double value : values) texts.push_back(number_text(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

/// Text as YAML; double quotes with YAML's escapes keep any path intact.
std::string quoted_where_needed(const std::string& value) {
  bool plain = !value.empty() && value.front() != '-' && value.front() != ' ';
  for (const char c : value) {
    plain = plain && (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '.' ||
                      c == '_' || c == '-');
  }
  if (plain) return value;
  std::string quoted = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";  // else YAML folds lines
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string list_text(const std::vector<std::string>& values) {
  std::vector<std::string> texts;
  texts.reserve(values.size());
  for (const std::string& value : values) texts.push_back(quoted_where_needed(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string interval_text(const Key& key) {
  const bool low = std::isfinite(key.min);
  const bool high = std::isfinite(key.max);
  if (low && high) return fmt::format("{} .. {}", key.min, key.max);
  if (low) return fmt::format(">= {}", key.min);
  if (high) return fmt::format("<= {}", key.max);
  return "";
}

}  // namespace

// ---- YAML with comments ----

void SettingsWriter::line(const Key& key, const std::string& value, const std::string& extra) {
  std::string indent(static_cast<std::size_t>(depth_) * 2, ' ');
  if (first_of_item_) {
    indent.replace(indent.size() - 2, 2, "- ");
    first_of_item_ = false;
  }
  const std::string setting =
      fmt::format("{}{}:{}{}", indent, key.name, value.empty() ? "" : " ", value);
  const std::string unit = key.unit.empty() ? "" : fmt::format("[{}] ", key.unit);
  text_ += fmt::format("{:<44}  # {}{}{}\n", setting, unit, key.help, extra);
}

void SettingsWriter::value(const Key& key, double& value) {
  line(key, number_text(value));
}
void SettingsWriter::value(const Key& key, std::int64_t& value) {
  line(key, fmt::format("{}", value));
}
void SettingsWriter::value(const Key& key, bool& value) {
  line(key, value ? "true" : "false");
}
void SettingsWriter::value(const Key& key, std::string& value) {
  line(key, quoted_where_needed(value));
}
void SettingsWriter::value(const Key& key, Eigen::Vector3d& value) {
  line(key, vector_text(value));
}
void SettingsWriter::value(const Key& key, std::vector<double>& value) {
  line(key, list_text(value));
}
void SettingsWriter::value(const Key& key, std::vector<Eigen::Vector3d>& value) {
  line(key, value.empty() ? "[]" : "");
  const std::string indent(static_cast<std::size_t>(depth_) * 2 + 2, ' ');
  for (const Eigen::Vector3d& v : value) text_ += indent + "- " + vector_text(v) + "\n";
}
void SettingsWriter::value(const Key& key, std::vector<std::string>& value) {
  line(key, list_text(value));
}
void SettingsWriter::value(const Key& key, YamlList& value) {
  line(key, fmt::format("[{}]", fmt::join(value.items, ", ")));
}
void SettingsWriter::choice(const Key& key,
                            std::string& value,
                            std::span<const std::string_view> choices) {
  line(key, value, fmt::format(" ({})", fmt::join(choices, ", ")));
}

void SettingsWriter::leave_as_is(std::string_view /*name*/, std::string& yaml) {
  if (!yaml.empty()) text_ += "\n" + yaml + "\n";
}

bool SettingsWriter::enter_condition(bool holds, std::string_view /*condition*/) {
  return holds;
}
bool SettingsWriter::enter(const Key& key) {
  if (depth_ == 0) text_ += "\n";
  line(key, "");
  ++depth_;
  return true;
}
void SettingsWriter::leave() {
  --depth_;
}
std::size_t SettingsWriter::enter_list(const Key& key, std::size_t size) {
  if (depth_ == 0) text_ += "\n";
  line(key, size == 0 ? "[]" : "");
  depth_ += 1;
  return size;
}
void SettingsWriter::enter_item(std::size_t /*index*/) {
  ++depth_;
  first_of_item_ = true;
}
void SettingsWriter::leave_list() {
  --depth_;
}

// ---- Markdown table ----

void SettingsTable::row(const Key& key, const std::string& value, const std::string& range) {
  std::string path;
  for (const std::string& part : path_) path += part.empty() ? "" : part + ".";
  const std::string condition =
      conditions_.empty() ? "" : fmt::format(" (only `{}`)", fmt::join(conditions_, "`, `"));
  text_ += fmt::format("| `{}{}` | {} | {} | {} | {}{} |\n",
                       path,
                       key.name,
                       key.unit,
                       key.required    ? "**required**"
                       : value.empty() ? ""
                                       : "`" + value + "`",
                       range,
                       key.help,
                       condition);
}

void SettingsTable::value(const Key& key, double& value) {
  row(key, number_text(value), interval_text(key));
}
void SettingsTable::value(const Key& key, std::int64_t& value) {
  row(key, fmt::format("{}", value), interval_text(key));
}
void SettingsTable::value(const Key& key, bool& value) {
  row(key, value ? "true" : "false", "true, false");
}
void SettingsTable::value(const Key& key, std::string& value) {
  row(key, value, "text");
}
void SettingsTable::value(const Key& key, Eigen::Vector3d& value) {
  row(key, vector_text(value), interval_text(key));
}
void SettingsTable::value(const Key& key, std::vector<double>& value) {
  row(key, list_text(value), interval_text(key));
}
void SettingsTable::value(const Key& key, std::vector<Eigen::Vector3d>& value) {
  row(key, value.empty() ? "[]" : "", "list of [x, y, z]");
}
void SettingsTable::value(const Key& key, std::vector<std::string>& value) {
  row(key, list_text(value), "list of texts");
}
void SettingsTable::value(const Key& key, YamlList& /*value*/) {
  row(key, "", "list of values");
}
void SettingsTable::choice(const Key& key,
                           std::string& value,
                           std::span<const std::string_view> choices) {
  row(key, value, fmt::format("{}", fmt::join(choices, ", ")));
}

bool SettingsTable::enter_condition(bool /*holds*/, std::string_view condition) {
  conditions_.emplace_back(condition);
  return true;
}
void SettingsTable::leave_condition() {
  conditions_.pop_back();
}
bool SettingsTable::enter(const Key& key) {
  if (path_.empty()) text_ += fmt::format("| **{}** | | | | {} |\n", key.name, key.help);
  path_.emplace_back(key.name);
  return true;
}
std::vector<std::string> SettingsTable::other_keys(std::vector<std::string> /*own*/) {
  return {"KEY"};
}
void SettingsTable::leave() {
  path_.pop_back();
}
std::size_t SettingsTable::enter_list(const Key& key, std::size_t size) {
  text_ += fmt::format("| **{}** | | | a list | {} |\n", key.name, key.help);
  path_.push_back(std::string(key.name) + "[]");
  return size;
}
void SettingsTable::enter_item(std::size_t /*index*/) {
  path_.emplace_back();  // an item adds no name: its keys print as `list[].key`
}
void SettingsTable::leave_list() {
  path_.pop_back();
}

}  // namespace pointflight
