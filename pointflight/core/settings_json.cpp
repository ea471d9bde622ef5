#include "pointflight/core/settings_json.hpp"

#include <yaml-cpp/yaml.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace pointflight {
namespace {

using Json = nlohmann::ordered_json;

Json list_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// Of YAML that was left as it is; what JSON takes for a number or a truth value is one.
Json json_of(const YAML::Node& node) {
  if (node.IsMap()) {
    Json object = Json::object();
    for (const auto& entry : node) object[entry.first.Scalar()] = json_of(entry.second);
    return object;
  }
  if (node.IsSequence()) {
    Json list = Json::array();
    for (const YAML::Node& item : node) list.push_back(json_of(item));
    return list;
  }
  if (!node.IsScalar()) return nullptr;
  const Json value = Json::parse(node.Scalar(), nullptr, false);
  return value.is_number() || value.is_boolean() ? value : Json(node.Scalar());
}

}  // namespace

struct SettingsJson::Levels {
  /// Open sections, lists and items, the innermost last; `names` are theirs, empty of items.
  std::vector<Json> open = {Json::object()};
  std::vector<std::string> names;

  void set(std::string_view name, Json value) { open.back()[std::string(name)] = std::move(value); }
  void begin(std::string_view name, Json empty) {
    names.emplace_back(name);
    open.push_back(std::move(empty));
  }
};

SettingsJson::SettingsJson() : levels_(std::make_unique<Levels>()) {}
SettingsJson::~SettingsJson() = default;

std::string SettingsJson::text() const {
  return levels_->open.front().dump(-1, ' ', false, Json::error_handler_t::replace);
}

void SettingsJson::leave_as_is(std::string_view name, std::string& yaml) {
  if (!yaml.empty()) levels_->set(name, json_of(YAML::Load(yaml)[std::string(name)]));
}
void SettingsJson::value(const Key& key, double& value) {
  levels_->set(key.name, value);
}
void SettingsJson::value(const Key& key, std::int64_t& value) {
  levels_->set(key.name, value);
}
void SettingsJson::value(const Key& key, bool& value) {
  levels_->set(key.name, value);
}
void SettingsJson::value(const Key& key, std::string& value) {
  levels_->set(key.name, value);
}
void SettingsJson::value(const Key& key, Eigen::Vector3d& value) {
  levels_->set(key.name, list_of(value));
}
void SettingsJson::value(const Key& key, std::vector<double>& value) {
  levels_->set(key.name, value);
}
void SettingsJson::value(const Key& key, std::vector<Eigen::Vector3d>& value) {
  Json list = Json::array();
  for (const Eigen::Vector3d& v : value) list.push_back(list_of(v));
  levels_->set(key.name, std::move(list));
}
void SettingsJson::value(const Key& key, std::vector<std::string>& value) {
  levels_->set(key.name, value);
}
void SettingsJson::value(const Key& key, YamlList& value) {
  levels_->set(key.name, value.items);
}
void SettingsJson::choice(const Key& key,
                          std::string& value,
                          std::span<const std::string_view> /*choices*/) {
  levels_->set(key.name, value);
}

bool SettingsJson::enter_condition(bool holds, std::string_view /*condition*/) {
  return holds;
}
bool SettingsJson::enter(const Key& key) {
  levels_->begin(key.name, Json::object());
  return true;
}
void SettingsJson::leave() {
  Json done = std::move(levels_->open.back());
  levels_->open.pop_back();
  const std::string name = std::move(levels_->names.back());
  levels_->names.pop_back();
  if (name.empty()) {
    levels_->open.back().push_back(std::move(done));
  } else {
    levels_->set(name, std::move(done));
  }
}
std::size_t SettingsJson::enter_list(const Key& key, std::size_t size) {
  levels_->begin(key.name, Json::array());
  return size;
}
void SettingsJson::enter_item(std::size_t /*index*/) {
  levels_->begin("", Json::object());
}
void SettingsJson::leave_list() {
  leave();
}

}  // namespace pointflight
