// What the tables of each firmware mean.
#pragma once

#include <set>
#include <string>

#include "pointflight/flight_log/flight_log.hpp"
#include "pointflight/flight_log/internal/log_tables.hpp"

namespace pointflight::flight_log {

/// Messages of PX4 that are read.
const std::set<std::string, std::less<>>& px4_messages_wanted();
/// Messages of ArduPilot that are read.
const std::set<std::string, std::less<>>& ardupilot_messages_wanted();

/// Fills what a log has; what is missing stays empty.
void convert_px4(const LogTables& tables, FlightLog& log);
/// The same.
void convert_ardupilot(const LogTables& tables, FlightLog& log);

/// PX4's thrust curve: the output to a motor for a share of the greatest thrust,
/// f u^2 + (1 - f) u = thrust (THR_MDL_FAC = f).
double px4_output_for(double thrust, double square_share);

}  // namespace pointflight::flight_log
