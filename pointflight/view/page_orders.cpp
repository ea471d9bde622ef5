#include "pointflight/view/page_orders.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "pointflight/core/input_error.hpp"
#include "pointflight/view/internal/small_json-inl.hpp"

namespace pointflight {
namespace {

using nlohmann::json;

constexpr double kFarthestGoal = 1e7;  // m
constexpr double kFastest = 200.0;     // m/s
constexpr double kMostRate = 1000.0;
constexpr double kLongestRun = 1e6;  // s

double number_of(const json& value, const char* name, double most) {
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  if (!(std::abs(number) <= most)) {
    throw InputError(fmt::format("'{}' is to be a number, {} at most", name, most));
  }
  return number;
}

Vector3d vector_of(const json& value, const char* name, double most) {
  if (!value.is_array() || value.size() != 3) {
    throw InputError(fmt::format("'{}' is to be three numbers", name));
  }
  return {number_of(value[0], name, most),
          number_of(value[1], name, most),
          number_of(value[2], name, most)};
}

bool flag_of(const json& value, const char* name) {
  if (!value.is_boolean()) throw InputError(fmt::format("'{}' is to be true or false", name));
  return value.get<bool>();
}

/// About the run as a whole; nothing if it is another.
std::optional<Order> run_order(const json& order) {
  if (order.contains("pause")) return PauseOrder{flag_of(order["pause"], "pause")};
  if (order.contains("step")) return StepOrder{};
  if (order.contains("reset")) return ResetOrder{};
  if (order.contains("seek")) {
    const double to = number_of(order["seek"], "seek", kLongestRun);
    return SeekOrder{SimTime(from_seconds(std::max(0.0, to)))};
  }
  if (order.contains("rate")) {
    const double rate = number_of(order["rate"], "rate", kMostRate);
    if (rate < 0.0) throw InputError("'rate' is not below 0");
    return RateOrder{rate};
  }
  return std::nullopt;
}

}  // namespace

Order page_order(std::string_view text, const std::vector<MotionLimits>& motions) {
  const json order = parse_small_json(text);
  if (order.is_discarded() || !order.is_object()) throw InputError("an order is a JSON object");
  if (auto of_run = run_order(order)) return *of_run;
  VehicleOrder told;
  const auto vehicle = order.find("vehicle");
  if (vehicle == order.end() || !vehicle->is_number_unsigned() ||
      vehicle->get<std::uint64_t>() >= motions.size()) {
    throw InputError(fmt::format("'vehicle' is to be a number below {}", motions.size()));
  }
  told.vehicle = vehicle->get<std::size_t>();
  if (order.contains("goal")) {
    WaypointCommand command;
    command.mission.motion = motions[told.vehicle];
    command.mission.waypoints = {vector_of(order["goal"], "goal", kFarthestGoal)};
    told.command = command;
  } else if (order.contains("velocity")) {
    VelocityCommand command;
    command.v_world = vector_of(order["velocity"], "velocity", kFastest);
    command.in_body = true;
    command.turn = true;
    command.yaw_rate =
        order.contains("yaw_rate") ? number_of(order["yaw_rate"], "yaw_rate", 100.0) : 0.0;
    told.command = command;
  } else if (order.contains("hover")) {
    told.command = HoverCommand{};
  } else {
    throw InputError("an order has a goal, a velocity, hover, pause, step, reset, rate or seek");
  }
  return told;
}

}  // namespace pointflight
