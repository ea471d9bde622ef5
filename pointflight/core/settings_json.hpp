#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/settings.hpp"

namespace pointflight {

/// Settings as JSON, with the keys of a file in its order; those without effect are left out.
class SettingsJson : public SettingsVisitor {
 public:
  SettingsJson();
  ~SettingsJson() override;

  /// What was visited so far, in one line.
  [[nodiscard]] std::string text() const;

  void leave_as_is(std::string_view name, std::string& yaml) override;
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
  struct Levels;  // nlohmann's header stays out of ours
  std::unique_ptr<Levels> levels_;
};

}  // namespace pointflight
