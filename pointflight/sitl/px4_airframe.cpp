#include "pointflight/sitl/px4_airframe.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/frames.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

/// Parameters of an airframe with the line that they are in.
struct AirframeParameter {
  double value = 0.0;
  std::size_t line = 0;
};
using AirframeParameters = std::map<std::string, AirframeParameter, std::less<>>;

AirframeParameters parameters_in(std::string_view text, const std::string& path) {
  AirframeParameters parameters;
  LineCursor lines(text);
  std::string_view line;
  while (lines.next(line)) {
    line = line.substr(0, line.find('#'));
    std::vector<std::string_view> words;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      words.push_back(word);
    }
    // "param set[-default] NAME VALUE", or "1 1 NAME VALUE TYPE"
    const bool is_command = words.size() >= 4 && words[0] == "param" && words[1].starts_with("set");
    const bool is_row = words.size() == 5 && words[2].starts_with("CA_");
    if (!is_command && !is_row) continue;
    if (!words[2].starts_with("CA_")) continue;
    double value = 0.0;
    if (!parse_number(words[3], value) || !std::isfinite(value)) {
      throw InputError(fmt::format("{}:{}: {}: '{}' is not a number",
                                   path,
                                   lines.number(),
                                   excerpt(words[2]),
                                   excerpt(words[3])));
    }
    parameters[std::string(words[2])] = {value, lines.number()};
  }
  return parameters;
}

double required(const AirframeParameters& parameters,
                const std::string& name,
                const std::string& path) {
  const auto found = parameters.find(name);
  if (found == parameters.end()) {
    throw InputError(fmt::format(
        "{}: {} is missing: not an airframe that says where its rotors are", path, name));
  }
  return found->second.value;
}

void refuse_tilt(const AirframeParameters& parameters, std::size_t rotor, const std::string& path) {
  // along its axis; PX4's default is up, (0, 0, -1) of front, right, down
  for (const char* axis : {"AX", "AY"}) {
    const auto found = parameters.find(fmt::format("CA_ROTOR{}_{}", rotor, axis));
    if (found == parameters.end() || found->second.value == 0.0) continue;
    throw InputError(fmt::format("{}:{}: {}: all rotors of a vehicle here push straight up",
                                 path,
                                 found->second.line,
                                 found->first));
  }
}

}  // namespace

VehicleSettings vehicle_from_px4_airframe(std::string_view text,
                                          const std::string& path,
                                          const VehicleSettings& like) {
  const AirframeParameters parameters = parameters_in(text, path);
  const double count = required(parameters, "CA_ROTOR_COUNT", path);
  if (!(count >= 4.0 && count <= static_cast<double>(kMostRotors)) || count != std::floor(count)) {
    throw InputError(fmt::format("{}:{}: CA_ROTOR_COUNT: {:g}; a vehicle has 4 to {} rotors",
                                 path,
                                 parameters.find("CA_ROTOR_COUNT")->second.line,
                                 count,
                                 kMostRotors));
  }
  VehicleSettings vehicle = like;
  vehicle.rotors.clear();
  double ratio = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    refuse_tilt(parameters, i, path);
    const auto of = [&](const char* what, double otherwise) {
      const auto found = parameters.find(fmt::format("CA_ROTOR{}_{}", i, what));
      return found == parameters.end() ? otherwise : found->second.value;
    };
    const Vector3d position_frd(required(parameters, fmt::format("CA_ROTOR{}_PX", i), path),
                                required(parameters, fmt::format("CA_ROTOR{}_PY", i), path),
                                of("PZ", 0.0));
    const double moment = of("KM", 0.05);  // m; positive: counter-clockwise from above
    ratio += std::abs(moment) / count;
    vehicle.rotors.push_back({frd_from_flu(position_frd), moment > 0.0 ? -1.0 : 1.0});
  }
  vehicle.rotor.torque_coefficient = ratio * vehicle.rotor.thrust_coefficient;
  vehicle.title = fmt::format("{}, rotors of a PX4 airframe", like.title);
  vehicle.source = fmt::format("rotors: {}; before: {}", path, like.source);
  return vehicle;
}

}  // namespace pointflight
