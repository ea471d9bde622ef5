#include "apps/settings_json.hpp"

#include <fmt/format.h>

namespace pointflight::apps {

using Json = nlohmann::ordered_json;

void SettingsJson::set(const Key& key, Json value) {
  levels_.back()[std::string(key.name)] = std::move(value);
}

void SettingsJson::value(const Key& key, double& value) {
  set(key, value);
}
void SettingsJson::value(const Key& key, std::int64_t& value) {
  set(key, value);
}
void SettingsJson::value(const Key& key, bool& value) {
  set(key, value);
}
void SettingsJson::value(const Key& key, std::string& value) {
  set(key, value);
}
void SettingsJson::value(const Key& key, Eigen::Vector3d& value) {
  set(key, {value.x(), value.y(), value.z()});
}
void SettingsJson::value(const Key& key, std::vector<double>& value) {
  set(key, value);
}
void SettingsJson::value(const Key& key, std::vector<Eigen::Vector3d>& value) {
  Json list = Json::array();
  for (const Eigen::Vector3d& v : value) list.push_back({v.x(), v.y(), v.z()});
  set(key, std::move(list));
}
void SettingsJson::value(const Key& key, std::vector<std::string>& value) {
  set(key, value);
}
void SettingsJson::value(const Key& key, YamlList& value) {
  set(key, value.items);
}
void SettingsJson::choice(const Key& key,
                          std::string& value,
                          std::span<const std::string_view> /*choices*/) {
  set(key, value);
}

bool SettingsJson::enter_condition(bool holds, std::string_view /*condition*/) {
  return holds;
}
bool SettingsJson::enter(const Key& key) {
  names_.emplace_back(key.name);
  levels_.push_back(Json::object());
  return true;
}
void SettingsJson::leave() {
  Json done = std::move(levels_.back());
  levels_.pop_back();
  const std::string name = std::move(names_.back());
  names_.pop_back();
  if (name.empty()) {
    levels_.back().push_back(std::move(done));
  } else {
    levels_.back()[name] = std::move(done);
  }
}
std::size_t SettingsJson::enter_list(const Key& key, std::size_t size) {
  names_.emplace_back(key.name);
  levels_.push_back(Json::array());
  return size;
}
void SettingsJson::enter_item(std::size_t /*index*/) {
  names_.emplace_back();
  levels_.push_back(Json::object());
}
void SettingsJson::leave_list() {
  leave();
}

void print_json(const Json& json) {
  fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
}

void print_reference(const std::string& rows) {
  fmt::print("| key | unit | default | range | meaning |\n| --- | --- | --- | --- | --- |\n{}",
             rows);
}

}  // namespace pointflight::apps
