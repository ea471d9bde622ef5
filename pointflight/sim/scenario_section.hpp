#pragma once

#include <any>
#include <functional>
#include <string>
#include <vector>

#include "pointflight/core/registry.hpp"
#include "pointflight/core/settings.hpp"

namespace pointflight {

/// A part of scenario files that a higher floor or a program reads, such as `ros`.
struct ScenarioSection {
  std::string name;   ///< Its key, on top of the file.
  std::string help;   ///< Half a sentence.
  std::any settings;  ///< With their defaults.
  std::any example;   ///< With one entry in each list, so that the page of keys has all.
  /// The keys, as `describe` of any settings.
  std::function<void(SettingsVisitor&, std::any&)> describe;
  /// Names or paths of model files in it, which a run's folder keeps a copy of.
  std::function<std::vector<std::string*>(std::any&)> models;
};

/// The sections besides the scenario's own, in the order in which they are written. To add to
/// before scenarios are read.
Registry<ScenarioSection>& scenario_sections();

}  // namespace pointflight
