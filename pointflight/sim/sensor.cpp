#include "pointflight/sim/sensor.hpp"

#include "pointflight/sim/navigation_sensors.hpp"

namespace pointflight {

SimTime arrival_of(const Sample& sample) {
  return std::visit(
      [](const auto& s) {
        if constexpr (requires { s.delivered; }) {
          return s.delivered;
        } else if constexpr (requires { s.scan; }) {
          return s.scan->end;
        } else {
          return s.time;
        }
      },
      sample);
}

Registry<SensorKind>& sensor_kinds() {
  static Registry<SensorKind> kinds = [] {
    Registry<SensorKind> own;
    add_navigation_sensors(own);
    return own;
  }();
  return kinds;
}

void describe(SettingsVisitor& v, SensorSetup& s) {
  const SensorKind* before = s.kind;
  v.choice({"kind", "", "what it measures"}, s.kind, sensor_kinds());
  if (s.kind == nullptr) return;
  if (s.kind != before || !s.settings.has_value()) s.settings = s.kind->settings;
  s.kind->describe(v, s.settings);
}

}  // namespace pointflight
