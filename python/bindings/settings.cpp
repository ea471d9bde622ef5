// Files of settings: scenarios and vehicles, checked as the program checks them.
#include "pointflight/core/settings.hpp"

#include <memory>
#include <string>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/settings_json.hpp"
#include "pointflight/sim/scenario.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/run_objects.hpp"

namespace pointflight::python {
namespace {

/// Of a copy, since visitors may write.
template <class Settings>
std::string json_of(Settings settings) {
  SettingsJson visitor;
  describe(visitor, settings);
  return visitor.text();
}

py::list names_of(const Scenario& scenario) {
  py::list names;
  for (const VehicleSetup& setup : scenario.fleet()) names.append(setup.name);
  return names;
}

}  // namespace

void add_settings(py::module_& module) {
  py::class_<Scenario, std::shared_ptr<Scenario>>(module, "_Scenario")
      .def_static(
          "load",
          [](const std::string& path) { return std::make_shared<Scenario>(load_scenario(path)); },
          py::arg("path"))
      .def_static(
          "parse",
          [](const std::string& text, const std::string& path) {
            return std::make_shared<Scenario>(parse_scenario(text, path));
          },
          py::arg("text"),
          py::arg("path"))
      .def_property_readonly("path", [](const Scenario& s) { return s.path; })
      .def_property_readonly("json", [](const Scenario& s) { return json_of(s); })
      .def_property_readonly("text", [](const Scenario& s) { return scenario_yaml(s); })
      .def_property_readonly("names", &names_of);
  py::class_<VehicleSettings, std::shared_ptr<VehicleSettings>>(module, "_Vehicle")
      .def_static(
          "load",
          [](const std::string& name) {
            return std::make_shared<VehicleSettings>(load_vehicle(name));
          },
          py::arg("name"))
      .def_property_readonly("title", [](const VehicleSettings& v) { return v.title; })
      .def_property_readonly("json", [](const VehicleSettings& v) { return json_of(v); })
      .def_property_readonly("mass", [](const VehicleSettings& v) { return v.mass; })
      .def_property_readonly("weight", [](const VehicleSettings& v) { return v.mass * kGravity; })
      .def_property_readonly("rotor_count",
                             [](const VehicleSettings& v) { return v.rotors.size(); })
      .def_property_readonly("hover_speed",
                             [](const VehicleSettings& v) { return v.hover_speed(); })
      .def_property_readonly("thrust_max", [](const VehicleSettings& v) {
        return v.thrust_to_weight() * v.mass * kGravity;
      });
}

}  // namespace pointflight::python
