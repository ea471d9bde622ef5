#include "pointflight/flight_log/flight_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/flight_log/internal/firmwares.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr double kLongestLog = 1e7;  // s; what is beyond is no time since a firmware's start

bool is_finite_record(const LoggedOutputs&) {
  return true;  // NaN: stopped
}
bool is_finite_record(const LoggedImu& r) {
  return r.gyro.allFinite() && r.accel.allFinite();
}
bool is_finite_record(const LoggedAttitude& r) {
  return r.q_world_body.coeffs().allFinite();
}
bool is_finite_record(const LoggedMotion& r) {
  return r.p_world.allFinite() && r.v_world.allFinite();
}

/// Takes out what is not finite or does not come after what was before it.
template <class Record>
void keep_ascending(std::vector<Record>& records, FlightLog& log) {
  double last = -1.0;
  const auto is_wrong = [&](const Record& record) {
    const bool fits = record.time > last && record.time < kLongestLog && is_finite_record(record);
    if (fits) last = record.time;
    return !fits;
  };
  log.skipped += std::erase_if(records, is_wrong);
}

/// Takes out the outputs at the end that never drove a motor: messages have room for more than
/// there are.
void trim_outputs(std::vector<LoggedOutputs>& records) {
  std::size_t most = 0;
  for (const LoggedOutputs& record : records) {
    for (std::size_t i = most; i < record.outputs.size(); ++i) {
      if (std::isfinite(record.outputs[i])) most = i + 1;
    }
  }
  for (LoggedOutputs& record : records)
    record.outputs.resize(std::min(most, record.outputs.size()));
}

/// Index of the record at or before a time, and how far it is to the next, 0 to 1.
template <class Record>
std::pair<std::size_t, double> place_of(const std::vector<Record>& records, double time) {
  const auto after = std::upper_bound(
      records.begin(), records.end(), time, [](double t, const Record& r) { return t < r.time; });
  if (after == records.begin()) return {0, 0.0};
  const auto i = static_cast<std::size_t>(after - records.begin()) - 1;
  if (after == records.end()) return {i, 0.0};
  return {i, (time - records[i].time) / (after->time - records[i].time)};
}

void require_list(bool is_there, const FlightLog& log, const char* px4, const char* ardupilot) {
  if (is_there) return;
  throw InputError(log.firmware == "PX4"
                       ? fmt::format("{}: has no {}: log it (SDLOG_PROFILE)", log.path, px4)
                       : fmt::format("{}: has no {}: log it (LOG_BITMASK)", log.path, ardupilot));
}

}  // namespace

RigidBodyState FlightLog::state_at(double time) const {
  RigidBodyState state;
  const auto [m, m_share] = place_of(motion, time);
  const LoggedMotion& next = motion[std::min(m + 1, motion.size() - 1)];
  state.p_world = motion[m].p_world + m_share * (next.p_world - motion[m].p_world);
  state.v_world = motion[m].v_world + m_share * (next.v_world - motion[m].v_world);
  const auto [a, a_share] = place_of(attitude, time);
  const Quaterniond& q = attitude[a].q_world_body;
  Eigen::Vector4d to = attitude[std::min(a + 1, attitude.size() - 1)].q_world_body.coeffs();
  if (to.dot(q.coeffs()) < 0.0) to = -to;
  state.q_world_body.coeffs() = (q.coeffs() + a_share * (to - q.coeffs())).normalized();
  const auto [g, g_share] = place_of(imu, time);
  const LoggedImu& after = imu[std::min(g + 1, imu.size() - 1)];
  state.omega_body = imu[g].gyro + g_share * (after.gyro - imu[g].gyro);
  return state;
}

FlightLog parse_flight_log(std::span<const std::byte> bytes, const std::string& path) {
  namespace fl = flight_log;
  FlightLog log;
  log.path = path;
  if (fl::is_ulog(bytes)) {
    log.firmware = "PX4";
    const fl::LogTables tables = fl::read_ulog(bytes, path, fl::px4_messages_wanted());
    log.skipped = tables.skipped;
    fl::convert_px4(tables, log);
  } else if (fl::is_dataflash(bytes)) {
    log.firmware = "ArduPilot";
    const fl::LogTables tables = fl::read_dataflash(bytes, path, fl::ardupilot_messages_wanted());
    log.skipped = tables.skipped;
    fl::convert_ardupilot(tables, log);
  } else {
    throw InputError(path +
                     ": byte 0: neither a ULog of PX4 nor a DataFlash log (.bin) of ArduPilot");
  }
  keep_ascending(log.outputs, log);
  trim_outputs(log.outputs);
  keep_ascending(log.imu, log);
  keep_ascending(log.attitude, log);
  keep_ascending(log.motion, log);
  require_list(!log.outputs.empty(), log, "actuator_motors or actuator_outputs", "RCOU");
  require_list(!log.imu.empty(), log, "sensor_combined", "IMU");
  require_list(!log.attitude.empty(), log, "vehicle_attitude", "ATT");
  require_list(!log.motion.empty(), log, "vehicle_local_position", "XKF1");
  return log;
}

FlightLog read_flight_log(const std::string& path) {
  const MappedFile file(path);
  FlightLog log = parse_flight_log(file.bytes(), path);
  throw_if_mapped_file_was_cut();
  return log;
}

}  // namespace pointflight
