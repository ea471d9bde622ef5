#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/flight_log/internal/firmwares.hpp"
#include "pointflight/geometry/frames.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight::flight_log {
namespace {

constexpr double kMicro = 1e-6;

/// The columns of a message, in the order in which they were asked for; null without them.
template <std::size_t N>
struct Columns {
  const LogTable* table = nullptr;
  std::array<int, N> index{};

  Columns(const LogTables& tables, std::string_view message, std::array<std::string_view, N> names)
      : table(tables.with(message, names)) {
    if (table == nullptr) return;
    for (std::size_t i = 0; i < N; ++i) index[i] = table->find(names[i]);
  }
  [[nodiscard]] std::size_t rows() const { return table == nullptr ? 0 : table->rows(); }
  [[nodiscard]] double at(std::size_t row, std::size_t i) const { return table->at(row, index[i]); }
  [[nodiscard]] Vector3d vector(std::size_t row, std::size_t first) const {
    return {at(row, first), at(row, first + 1), at(row, first + 2)};
  }
};

/// Columns of RCOU by motor, -1 where there is none.
std::vector<int> motor_columns(const LogTables& tables, const LogTable& table) {
  // SERVOn_FUNCTION: 33 to 40 are motors 1 to 8, 82 to 85 motors 9 to 12
  std::vector<int> columns;
  for (int n = 1; n <= 14; ++n) {
    const int function = tables.choice(fmt::format("SERVO{}_FUNCTION", n), n <= 4 ? 32 + n : 0);
    int motor = -1;
    if (function >= 33 && function <= 40) motor = function - 33;
    if (function >= 82 && function <= 85) motor = function - 82 + 8;
    const int column = table.find(fmt::format("C{}", n));
    if (motor < 0 || column < 0) continue;
    if (columns.size() <= static_cast<std::size_t>(motor)) {
      columns.resize(static_cast<std::size_t>(motor) + 1, -1);
    }
    columns[static_cast<std::size_t>(motor)] = column;
  }
  return columns;
}

void convert_ardupilot_outputs(const LogTables& tables, FlightLog& log) {
  log.outputs_from = "RCOU";
  const LogTable* table = tables.with("RCOU", std::array<std::string_view, 1>{"C1"});
  if (table == nullptr) return;
  const double low = tables.parameter("MOT_PWM_MIN", 1000.0);
  const double high = tables.parameter("MOT_PWM_MAX", 2000.0);
  if (!(high > low)) return;
  const std::vector<int> columns = motor_columns(tables, *table);
  for (std::size_t row = 0; row < table->rows(); ++row) {
    LoggedOutputs& record = log.outputs.emplace_back();
    record.time = kMicro * table->at(row, 0);
    for (const int column : columns) {
      const double pulse = column < 0 ? 0.0 : table->at(row, column);
      record.outputs.push_back(pulse <= low ? std::numeric_limits<float>::quiet_NaN()
                                            : static_cast<float>((pulse - low) / (high - low)));
    }
  }
}

}  // namespace

const std::set<std::string, std::less<>>& ardupilot_messages_wanted() {
  static const std::set<std::string, std::less<>> kWanted = {"IMU", "ATT", "XKF1", "NKF1", "RCOU"};
  return kWanted;
}

void convert_ardupilot(const LogTables& tables, FlightLog& log) {
  const Columns<7> imu(tables, "IMU", {"TimeUS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"});
  for (std::size_t row = 0; row < imu.rows(); ++row) {
    log.imu.push_back({kMicro * imu.at(row, 0),
                       frd_from_flu(imu.vector(row, 1)),
                       frd_from_flu(imu.vector(row, 4))});
  }
  const Columns<4> attitude(tables, "ATT", {"TimeUS", "Roll", "Pitch", "Yaw"});
  for (std::size_t row = 0; row < attitude.rows(); ++row) {
    const Vector3d rpy = kDegree * attitude.vector(row, 1);
    log.attitude.push_back(
        {kMicro * attitude.at(row, 0), q_ned_frd(quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()))});
  }
  for (const std::string_view message : {"XKF1", "NKF1"}) {
    if (!log.motion.empty()) break;
    const Columns<7> motion(tables, message, {"TimeUS", "PN", "PE", "PD", "VN", "VE", "VD"});
    for (std::size_t row = 0; row < motion.rows(); ++row) {
      log.motion.push_back({kMicro * motion.at(row, 0),
                            ned_from_enu(motion.vector(row, 1)),
                            ned_from_enu(motion.vector(row, 4))});
    }
  }
  convert_ardupilot_outputs(tables, log);
}

}  // namespace pointflight::flight_log
