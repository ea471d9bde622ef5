// A vehicle that goes where a log went.
#pragma once

#include "pointflight/flight_log/flight_log.hpp"
#include "pointflight/sim/vehicle_source.hpp"

namespace pointflight {

/// Follows the way of a log from one of its times on; its sensors are here. The log's frame lies in
/// the map as `T_map_log` has it, upright. At the end it stays.
class LogSource : public VehicleSource {
 public:
  /// The log must outlive it. `from` in the log's time, s.
  LogSource(const FlightLog& log, double from, const Pose& T_map_log)
      : log_(log), from_(from), T_map_log_(T_map_log) {}

  std::optional<SourcedState> state_at(SimTime time) override;

 private:
  const FlightLog& log_;
  double from_;
  Pose T_map_log_;
};

}  // namespace pointflight
