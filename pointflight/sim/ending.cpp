#include "pointflight/sim/ending.hpp"

#include <algorithm>

namespace pointflight {
namespace {

/// All who have a mission and nothing else to do are at their goals; nobody lies broken or empty.
bool have_arrived(const RunOutlook& outlook) {
  return std::all_of(outlook.vehicles.begin(), outlook.vehicles.end(), [](const auto& vehicle) {
    return !vehicle || vehicle->arrived;
  });
}

bool has_crashed(const RunOutlook& outlook) {
  return std::any_of(outlook.vehicles.begin(), outlook.vehicles.end(), [](const auto& vehicle) {
    return vehicle && vehicle->crashed;
  });
}

/// True if nothing but the lack of commands ends the run: programs gave some, or nobody had a plan.
bool is_idle(const RunOutlook& outlook) {
  if (outlook.has_duration) return false;
  bool had_plan = false;
  for (const auto& vehicle : outlook.vehicles) {
    if (!vehicle) continue;
    if (vehicle->commanded) return true;
    had_plan = had_plan || vehicle->has_plan;
  }
  return !had_plan;
}

/// Somebody flies where nothing can be measured any more, or falls through a hole in the floor. A
/// wreck that does so ends nothing while others fly.
bool has_left_map(const RunOutlook& outlook) {
  bool any_flies = false;
  bool any_lost = false;
  for (const auto& vehicle : outlook.vehicles) {
    if (!vehicle) continue;
    if (vehicle->is_lost && !vehicle->crashed) return true;
    any_lost = any_lost || vehicle->is_lost;
    any_flies = any_flies || !vehicle->crashed;
  }
  return any_lost && !any_flies;
}

}  // namespace

const char* to_string(RunEnd end) {
  switch (end) {
    case RunEnd::kRunning:
      return "running";
    case RunEnd::kCompleted:
      return "completed";
    case RunEnd::kMissionUnfinished:
      return "mission unfinished";
    case RunEnd::kTimeUp:
      return "time up";
    case RunEnd::kCollision:
      return "collision";
    case RunEnd::kLeftMap:
      return "left the map";
    case RunEnd::kInterrupted:
      return "interrupted";
    case RunEnd::kIdle:
      return "idle";
  }
  return "";
}

const char* reason_of(RunEnd end) {
  if (end == RunEnd::kIdle) {
    return "nothing left to do, no command for 10 s, and the scenario has no duration";
  }
  if (end == RunEnd::kTimeUp) return "the mission goes on; so long was asked for";
  if (end == RunEnd::kLeftMap) return "over 50 m beside or below it, or 500 m above";
  return "";
}

Ending ending_of(const RunOutlook& outlook, SimTime now) {
  if (outlook.stops) return {RunEnd::kCollision, now};
  if (now >= outlook.end_time && !outlook.is_landing) {
    if (!have_arrived(outlook)) {
      const bool is_time_up = outlook.may_end_early && !has_crashed(outlook);
      return {is_time_up ? RunEnd::kTimeUp : RunEnd::kMissionUnfinished, now};
    }
    return {is_idle(outlook) ? RunEnd::kIdle : RunEnd::kCompleted, now};
  }
  if (has_left_map(outlook)) return {RunEnd::kLeftMap, now};
  return {};
}

}  // namespace pointflight
