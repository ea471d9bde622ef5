#include "pointflight/vehicle/controllers/cascaded_pid.hpp"
#include "pointflight/vehicle/controllers/geometric.hpp"

namespace pointflight {

Registry<ControllerKind>& ControllerKind::table() {
  static Registry<ControllerKind> table = {
      {.name = "cascade",
       .help = "cascaded PID",
       .make = [](const VehicleSettings& s) { return std::make_unique<CascadedPid>(s); },
       .integrates_attitude = true,
       .tilt_max_deg = 85.0},
      {.name = "geometric",
       .help = "on SE(3), after Lee et al.",
       .make = [](const VehicleSettings& s) { return std::make_unique<GeometricController>(s); },
       .integrates_attitude = false,
       .tilt_max_deg = 180.0}};
  return table;
}

std::unique_ptr<Controller> make_controller(const Choice<ControllerKind>& kind,
                                            const VehicleSettings& settings) {
  check_settings(settings, settings.path.empty() ? "vehicle" : settings.path);
  return kind->make(settings);
}

}  // namespace pointflight
