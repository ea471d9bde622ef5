#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pointflight/flight_log/internal/firmwares.hpp"
#include "pointflight/geometry/frames.hpp"

namespace pointflight::flight_log {
namespace {

constexpr double kMicrosecond = 1e-6;
constexpr float kStopped = std::numeric_limits<float>::quiet_NaN();

Vector3d vector_in(const LogTable& table, std::size_t row, const std::array<int, 3>& columns) {
  return {table.at(row, columns[0]), table.at(row, columns[1]), table.at(row, columns[2])};
}

std::array<int, 3> columns_of(const LogTable& table, std::string_view name) {
  return {table.find(fmt::format("{}[0]", name)),
          table.find(fmt::format("{}[1]", name)),
          table.find(fmt::format("{}[2]", name))};
}

void convert_px4_imu(const LogTables& tables, FlightLog& log) {
  constexpr std::array<std::string_view, 6> kColumns = {"gyro_rad[0]",
                                                        "gyro_rad[1]",
                                                        "gyro_rad[2]",
                                                        "accelerometer_m_s2[0]",
                                                        "accelerometer_m_s2[1]",
                                                        "accelerometer_m_s2[2]"};
  const LogTable* table = tables.with("sensor_combined", kColumns);
  if (table == nullptr) return;
  const auto gyro = columns_of(*table, "gyro_rad");
  const auto accel = columns_of(*table, "accelerometer_m_s2");
  for (std::size_t row = 0; row < table->rows(); ++row) {
    log.imu.push_back({kMicrosecond * table->at(row, 0),
                       frd_from_flu(vector_in(*table, row, gyro)),
                       frd_from_flu(vector_in(*table, row, accel))});
  }
}

void convert_px4_estimate(const LogTables& tables, FlightLog& log) {
  constexpr std::array<std::string_view, 4> kAttitude = {"q[0]", "q[1]", "q[2]", "q[3]"};
  if (const LogTable* table = tables.with("vehicle_attitude", kAttitude)) {
    std::array<int, 4> c{};  // in any order: a file says it
    for (std::size_t i = 0; i < c.size(); ++i) c[i] = table->find(kAttitude[i]);
    for (std::size_t row = 0; row < table->rows(); ++row) {
      const Quaterniond q(
          table->at(row, c[0]), table->at(row, c[1]), table->at(row, c[2]), table->at(row, c[3]));
      if (!(q.squaredNorm() > 0.5 && q.squaredNorm() < 2.0)) continue;
      log.attitude.push_back({kMicrosecond * table->at(row, 0), q_ned_frd(q).normalized()});
    }
  }
  constexpr std::array<std::string_view, 6> kMotion = {"x", "y", "z", "vx", "vy", "vz"};
  if (const LogTable* table = tables.with("vehicle_local_position", kMotion)) {
    const std::array<int, 3> p = {table->find("x"), table->find("y"), table->find("z")};
    const std::array<int, 3> v = {table->find("vx"), table->find("vy"), table->find("vz")};
    for (std::size_t row = 0; row < table->rows(); ++row) {
      log.motion.push_back({kMicrosecond * table->at(row, 0),
                            ned_from_enu(vector_in(*table, row, p)),
                            ned_from_enu(vector_in(*table, row, v))});
    }
  }
}

/// Outputs of control allocation: shares of the greatest thrust, before the thrust curve.
std::vector<LoggedOutputs> allocated_outputs(const LogTables& tables) {
  std::vector<LoggedOutputs> list;
  const LogTable* table =
      tables.with("actuator_motors", std::array<std::string_view, 1>{"control[0]"});
  if (table == nullptr) return list;
  const double square_share = std::clamp(tables.parameter("THR_MDL_FAC", 0.0), 0.0, 1.0);
  const int rotors = tables.choice("CA_ROTOR_COUNT", 12);
  std::vector<int> columns;
  for (int i = 0; i < std::min(rotors, 12); ++i) {
    const int column = table->find(fmt::format("control[{}]", i));
    if (column >= 0) columns.push_back(column);
  }
  for (std::size_t row = 0; row < table->rows(); ++row) {
    LoggedOutputs& record = list.emplace_back();
    record.time = kMicrosecond * table->at(row, 0);
    for (const int column : columns) {
      record.outputs.push_back(
          static_cast<float>(px4_output_for(table->at(row, column), square_share)));
    }
  }
  return list;
}

/// Where the output of a motor is in a message of pulses, and how long its pulses are.
struct PulseRange {
  int column = -1;
  double low = 1000.0;
  double high = 2000.0;
};

/// By motor.
std::vector<PulseRange> pulse_ranges(const LogTables& tables, const LogTable& table) {
  constexpr int kFirstMotor = 101;  // in PWM_MAIN_FUNCn
  std::vector<PulseRange> motors;
  for (int n = 1; n <= 16; ++n) {
    const int function =
        tables.choice(fmt::format("PWM_MAIN_FUNC{}", n), n <= 8 ? kFirstMotor + n - 1 : 0);
    const int motor = function - kFirstMotor;
    const int column = table.find(fmt::format("output[{}]", n - 1));
    if (motor < 0 || motor >= 12 || column < 0) continue;
    if (motors.size() <= static_cast<std::size_t>(motor)) {
      motors.resize(static_cast<std::size_t>(motor) + 1);
    }
    PulseRange& range = motors[static_cast<std::size_t>(motor)];
    range.column = column;
    range.low = tables.parameter(fmt::format("PWM_MAIN_MIN{}", n),
                                 tables.parameter("PWM_MAIN_MIN", 1000.0));
    range.high = tables.parameter(fmt::format("PWM_MAIN_MAX{}", n),
                                  tables.parameter("PWM_MAIN_MAX", 2000.0));
  }
  return motors;
}

std::vector<LoggedOutputs> pulse_outputs(const LogTables& tables, std::string_view message) {
  std::vector<LoggedOutputs> list;
  const LogTable* table = tables.with(message, std::array<std::string_view, 1>{"output[0]"});
  if (table == nullptr) return list;
  const std::vector<PulseRange> motors = pulse_ranges(tables, *table);
  for (std::size_t row = 0; row < table->rows(); ++row) {
    LoggedOutputs& record = list.emplace_back();
    record.time = kMicrosecond * table->at(row, 0);
    for (const PulseRange& range : motors) {
      if (range.column < 0) {
        record.outputs.push_back(kStopped);
        continue;
      }
      const double value = table->at(row, range.column);
      // simulated outputs are from 0 to 1 already
      const bool is_pulse = value > 2.0;
      const double share = is_pulse ? (value - range.low) / (range.high - range.low) : value;
      const bool turns = !is_pulse || value >= range.low;
      record.outputs.push_back(turns ? static_cast<float>(share) : kStopped);
    }
  }
  return list;
}

}  // namespace

double px4_output_for(double thrust, double f) {
  if (!(f > 0.0) || !std::isfinite(thrust)) return thrust;
  const double linear = 1.0 - f;
  return (std::sqrt(linear * linear + 4.0 * f * std::max(0.0, thrust)) - linear) / (2.0 * f);
}

const std::set<std::string, std::less<>>& px4_messages_wanted() {
  static const std::set<std::string, std::less<>> kWanted = {"sensor_combined",
                                                             "vehicle_attitude",
                                                             "vehicle_local_position",
                                                             "actuator_motors",
                                                             "actuator_outputs",
                                                             "actuator_outputs_sim"};
  return kWanted;
}

void convert_px4(const LogTables& tables, FlightLog& log) {
  convert_px4_imu(tables, log);
  convert_px4_estimate(tables, log);
  log.outputs = allocated_outputs(tables);
  log.outputs_from = "actuator_motors";
  // the default set of messages has one of them ten times as often as the other
  for (const std::string_view message : {"actuator_outputs_sim", "actuator_outputs"}) {
    std::vector<LoggedOutputs> pulses = pulse_outputs(tables, message);
    if (pulses.size() <= log.outputs.size()) continue;
    log.outputs = std::move(pulses);
    log.outputs_from = message;
  }
}

}  // namespace pointflight::flight_log
