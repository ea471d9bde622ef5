#pragma once

#include <functional>
#include <memory>
#include <string>

#include "pointflight/core/registry.hpp"

namespace pointflight {

class Controller;
struct VehicleSettings;

/// A row of the table of controllers.
struct ControllerKind {
  static constexpr const char* kWhat = "controller";  ///< In messages.
  /// "cascade", the first, and "geometric"; programs may add their own before files are read.
  static Registry<ControllerKind>& table();

  std::string name;  ///< In files.
  std::string help;  ///< Half a sentence.
  /// For a vehicle whose settings were checked. May throw InputError.
  std::function<std::unique_ptr<Controller>(const VehicleSettings& settings)> make;
  bool integrates_attitude = false;  ///< `LoopDesign::integral` of its attitude loops counts.
  double tilt_max_deg = 180.0;       ///< It flies no steeper.
};

}  // namespace pointflight
