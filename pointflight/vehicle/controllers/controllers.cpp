#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/vehicle/controllers/cascaded_pid.hpp"
#include "pointflight/vehicle/controllers/geometric.hpp"

namespace pointflight {
namespace {

struct Entry {
  const char* name;
  std::unique_ptr<Controller> (*make)(const VehicleSettings& settings);
};

constexpr Entry kControllers[] = {
    {"cascade",
     [](const VehicleSettings& settings) -> std::unique_ptr<Controller> {
       return std::make_unique<CascadedPid>(settings);
     }},
    {"geometric",
     [](const VehicleSettings& settings) -> std::unique_ptr<Controller> {
       return std::make_unique<GeometricController>(settings);
     }},
};

}  // namespace

std::unique_ptr<Controller> make_controller(const std::string& name,
                                            const VehicleSettings& settings) {
  check_settings(settings, settings.path.empty() ? "vehicle" : settings.path);
  std::vector<std::string> names;
  for (const Entry& entry : kControllers) {
    if (name == entry.name) return entry.make(settings);
    names.emplace_back(entry.name);
  }
  throw InputError(
      fmt::format("controller '{}' is unknown; one of: {}", name, fmt::join(names, ", ")));
}

}  // namespace pointflight
