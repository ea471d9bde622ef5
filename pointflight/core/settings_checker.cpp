#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"

namespace pointflight {

void SettingsChecker::require(std::string_view name, bool fine, std::string_view what) {
  if (!fine) fail(Key{name, {}, {}}, std::string(what));
}

void SettingsChecker::fail(const Key& key, const std::string& what) const {
  std::string path;
  for (const std::string& part : path_) {
    path += path.empty() || part.front() == '[' ? part : "." + part;
  }
  if (!path.empty()) path += ".";
  throw InputError(fmt::format("{}: {}{}: {}", name_, path, key.name, what));
}

void SettingsChecker::check(const Key& key, double number) const {
  if (std::isfinite(number) && number >= key.min && number <= key.max) return;
  const std::string unit = key.unit.empty() ? "" : fmt::format(" {}", key.unit);
  fail(key, fmt::format("{}{} is not between {} and {}", number, unit, key.min, key.max));
}

void SettingsChecker::value(const Key& key, double& value) {
  check(key, value);
}
void SettingsChecker::value(const Key& key, std::int64_t& value) {
  check(key, static_cast<double>(value));
}
void SettingsChecker::value(const Key& /*key*/, bool& /*value*/) {}
void SettingsChecker::value(const Key& /*key*/, std::string& /*value*/) {}
void SettingsChecker::value(const Key& key, Eigen::Vector3d& value) {
  for (const double number : value) check(key, number);
}
void SettingsChecker::value(const Key& key, std::vector<double>& value) {
  for (const double number : value) check(key, number);
}
void SettingsChecker::value(const Key& key, std::vector<Eigen::Vector3d>& value) {
  for (Eigen::Vector3d& v : value) this->value(key, v);
}
void SettingsChecker::value(const Key& /*key*/, std::vector<std::string>& /*value*/) {}
void SettingsChecker::value(const Key& /*key*/, YamlList& /*value*/) {}
void SettingsChecker::choice(const Key& key,
                             std::string& value,
                             std::span<const std::string_view> choices) {
  if (std::find(choices.begin(), choices.end(), value) != choices.end()) return;
  fail(key, fmt::format("'{}' is unknown; one of: {}", value, fmt::join(choices, ", ")));
}

bool SettingsChecker::enter(const Key& key) {
  path_.emplace_back(key.name);
  return true;
}
void SettingsChecker::leave() {
  path_.pop_back();
}
std::size_t SettingsChecker::enter_list(const Key& key, std::size_t size) {
  path_.emplace_back(key.name);
  return size;
}
void SettingsChecker::enter_item(std::size_t index) {
  path_.push_back(fmt::format("[{}]", index));
}
void SettingsChecker::leave_list() {
  path_.pop_back();
}

}  // namespace pointflight
