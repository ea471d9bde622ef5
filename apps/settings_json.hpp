#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pointflight/core/settings.hpp"

namespace pointflight::apps {

/// Settings as JSON, as a file would have them.
class SettingsJson : public SettingsVisitor {
 public:
  [[nodiscard]] const nlohmann::ordered_json& json() const { return levels_.front(); }

  void value(const Key& key, double& value) override;
  void value(const Key& key, std::int64_t& value) override;
  void value(const Key& key, bool& value) override;
  void value(const Key& key, std::string& value) override;
  void value(const Key& key, Eigen::Vector3d& value) override;
  void value(const Key& key, std::vector<double>& value) override;
  void value(const Key& key, std::vector<Eigen::Vector3d>& value) override;
  void value(const Key& key, std::vector<std::string>& value) override;
  void value(const Key& key, YamlList& value) override;
  void choice(const Key& key,
              std::string& value,
              std::span<const std::string_view> choices) override;

 protected:
  bool enter_condition(bool holds, std::string_view condition) override;
  bool enter(const Key& key) override;
  void leave() override;
  std::size_t enter_list(const Key& key, std::size_t size) override;
  void enter_item(std::size_t index) override;
  void leave_list() override;

 private:
  void set(const Key& key, nlohmann::ordered_json value);

  /// Open sections, lists and items, the innermost last; `names_` are theirs, empty of items.
  std::vector<nlohmann::ordered_json> levels_ = {nlohmann::ordered_json::object()};
  std::vector<std::string> names_;
};

template <class Settings>
nlohmann::ordered_json json_of_settings(Settings& settings) {
  SettingsJson visitor;
  describe(visitor, settings);
  return visitor.json();
}

/// JSON on stdout; text that is no UTF-8 does not stop it.
void print_json(const nlohmann::ordered_json& json);

/// A table of keys on stdout, as the pages in docs/ have it.
void print_reference(const std::string& rows);

}  // namespace pointflight::apps
