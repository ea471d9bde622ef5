#include "tests/flight_log/log_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace pointflight {
namespace {

/// In the order of time, each with what writes it.
struct Entry {
  double time;
  std::string bytes;
};

std::string in_order(std::vector<Entry> entries) {
  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.time < b.time;
  });
  std::string text;
  for (const Entry& entry : entries) text += entry.bytes;
  return text;
}

std::uint64_t microseconds(double time) {
  return static_cast<std::uint64_t>(std::llround(1e6 * time));
}

/// Of front, right, down in north, east, down: the rotation matrix between both frames, in words of
/// matrices, and not of quaternions as the reader does it.
Matrix3d ned_frd(const Quaterniond& q_enu_flu) {
  Matrix3d ned_from_enu;
  ned_from_enu << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const Matrix3d flu_from_frd = Vector3d(1, -1, -1).asDiagonal();
  return ned_from_enu * q_enu_flu.toRotationMatrix() * flu_from_frd;
}

std::string ulog_data(std::uint16_t number, double time, const LogBytes& fields) {
  LogBytes bytes;
  bytes.put(number).put(microseconds(time));
  return ulog_message('D', bytes.text + fields.text);
}

LogBytes packet(std::uint8_t kind) {
  LogBytes bytes;
  bytes.put(std::uint8_t{0xA3}).put(std::uint8_t{0x95}).put(kind);
  return bytes;
}

std::string fmt_packet(std::uint8_t kind,
                       std::uint8_t length,
                       const std::string& name,
                       const std::string& letters,
                       const std::string& labels) {
  return packet(128)
      .put(kind)
      .put(length)
      .put_text(name, 4)
      .put_text(letters, 16)
      .put_text(labels, 64)
      .text;
}

}  // namespace

std::string ulog_message(char kind, const std::string& payload) {
  LogBytes bytes;
  bytes.put(static_cast<std::uint16_t>(payload.size())).put(kind);
  return bytes.text + payload;
}

std::string ulog_start(unsigned char incompatible) {
  LogBytes bytes;
  for (const int c : {0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35, 0x01}) {
    bytes.put(static_cast<std::uint8_t>(c));
  }
  bytes.put(std::uint64_t{0});
  LogBytes flags;
  flags.put_text("", 8).put(incompatible).put_text("", 7).put_text("", 24);
  return bytes.text + ulog_message('B', flags.text);
}

std::string ulog_format(const std::string& definition) {
  return ulog_message('F', definition);
}

std::string ulog_parameter(const std::string& name, float value) {
  LogBytes bytes;
  const std::string key = "float " + name;
  bytes.put(static_cast<std::uint8_t>(key.size())).put_text(key, key.size()).put(value);
  return ulog_message('P', bytes.text);
}

std::string ulog_subscription(std::uint16_t number,
                              const std::string& name,
                              std::uint8_t instance) {
  LogBytes bytes;
  bytes.put(instance).put(number).put_text(name, name.size());
  return ulog_message('A', bytes.text);
}

std::string ulog_of(const FlightLog& log,
                    const std::vector<std::pair<std::string, float>>& parameters) {
  std::string text =
      ulog_start() +
      ulog_format(
          "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
          "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;"
          "uint32_t accelerometer_integral_dt;uint8_t accelerometer_clipping;uint8_t[3] "
          "_padding0;") +
      ulog_format(
          "vehicle_attitude:uint64_t timestamp;uint64_t timestamp_sample;float[4] q;"
          "float[4] delta_q_reset;uint8_t quat_reset_counter;uint8_t[7] _padding0;") +
      ulog_format(
          "vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;"
          "float vy;float vz;bool xy_valid;") +
      ulog_format(
          "actuator_motors:uint64_t timestamp;uint64_t timestamp_sample;float[12] control;"
          "uint16_t reversible_flags;uint8_t[6] _padding0;");
  for (const auto& [name, value] : parameters) text += ulog_parameter(name, value);
  text += ulog_subscription(0, "sensor_combined") + ulog_subscription(1, "vehicle_attitude") +
          ulog_subscription(2, "vehicle_local_position") + ulog_subscription(3, "actuator_motors");
  std::vector<Entry> entries;
  const auto put_frd = [](LogBytes& bytes, const Vector3d& v) {
    bytes.put(static_cast<float>(v.x()))
        .put(static_cast<float>(-v.y()))
        .put(static_cast<float>(-v.z()));
  };
  const auto put_ned = [](LogBytes& bytes, const Vector3d& v) {
    bytes.put(static_cast<float>(v.y()))
        .put(static_cast<float>(v.x()))
        .put(static_cast<float>(-v.z()));
  };
  for (const LoggedImu& imu : log.imu) {
    LogBytes bytes;
    put_frd(bytes, imu.gyro);
    bytes.put(std::uint32_t{4000}).put(std::int32_t{0});
    put_frd(bytes, imu.accel);
    bytes.put(std::uint32_t{4000}).put(std::uint8_t{0});
    entries.push_back({imu.time, ulog_data(0, imu.time, bytes)});
  }
  for (const LoggedAttitude& attitude : log.attitude) {
    const Quaterniond q(ned_frd(attitude.q_world_body));
    LogBytes bytes;
    bytes.put(microseconds(attitude.time));
    for (const double c : {q.w(), q.x(), q.y(), q.z()}) bytes.put(static_cast<float>(c));
    for (int i = 0; i < 4; ++i) bytes.put(0.0f);
    bytes.put(std::uint8_t{0});
    entries.push_back({attitude.time, ulog_data(1, attitude.time, bytes)});
  }
  for (const LoggedMotion& motion : log.motion) {
    LogBytes bytes;
    put_ned(bytes, motion.p_world);
    put_ned(bytes, motion.v_world);
    bytes.put(std::uint8_t{1});
    entries.push_back({motion.time, ulog_data(2, motion.time, bytes)});
  }
  for (const LoggedOutputs& outputs : log.outputs) {
    LogBytes bytes;
    bytes.put(microseconds(outputs.time));
    for (std::size_t i = 0; i < 12; ++i) {
      bytes.put(i < outputs.outputs.size() ? outputs.outputs[i] : std::nanf(""));
    }
    bytes.put(std::uint16_t{0});
    entries.push_back({outputs.time, ulog_data(3, outputs.time, bytes)});
  }
  return text + in_order(std::move(entries));
}

std::string dataflash_of(const FlightLog& log) {
  std::string text =
      fmt_packet(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
      fmt_packet(64, 35, "PARM", "QNff", "TimeUS,Name,Value,Default") +
      fmt_packet(65, 36, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ") +
      fmt_packet(66, 17, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw") +
      fmt_packet(67, 36, "XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD") +
      fmt_packet(68, 19, "RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4");
  text += packet(64).put(std::uint64_t{0}).put_text("MOT_PWM_MIN", 16).put(1100.0f).put(0.0f).text;
  text += packet(64).put(std::uint64_t{0}).put_text("MOT_PWM_MAX", 16).put(1900.0f).put(0.0f).text;
  std::vector<Entry> entries;
  const auto put_floats = [](LogBytes& bytes, double a, double b, double c) {
    bytes.put(static_cast<float>(a)).put(static_cast<float>(b)).put(static_cast<float>(c));
  };
  for (const LoggedImu& imu : log.imu) {
    for (const std::uint8_t instance : {std::uint8_t{0}, std::uint8_t{1}}) {
      LogBytes bytes = packet(65).put(microseconds(imu.time)).put(instance);
      const double wrong = instance == 0 ? 1.0 : 5.0;  // the second IMU is not read
      put_floats(bytes, wrong * imu.gyro.x(), -imu.gyro.y(), -imu.gyro.z());
      put_floats(bytes, imu.accel.x(), -imu.accel.y(), -imu.accel.z());
      entries.push_back({imu.time, bytes.text});
    }
  }
  for (const LoggedAttitude& attitude : log.attitude) {
    const Matrix3d R = ned_frd(attitude.q_world_body);
    constexpr double kCentidegrees = 100.0 * 57.29577951308232;
    const double yaw = std::atan2(R(1, 0), R(0, 0));
    LogBytes bytes = packet(66).put(microseconds(attitude.time));
    bytes.put(static_cast<std::int16_t>(std::lround(kCentidegrees * std::atan2(R(2, 1), R(2, 2)))));
    bytes.put(static_cast<std::int16_t>(std::lround(kCentidegrees * std::asin(-R(2, 0)))));
    const long centidegrees = std::lround(kCentidegrees * yaw);
    bytes.put(static_cast<std::uint16_t>((centidegrees + 36000) % 36000));
    entries.push_back({attitude.time, bytes.text});
  }
  for (const LoggedMotion& motion : log.motion) {
    LogBytes bytes = packet(67).put(microseconds(motion.time)).put(std::uint8_t{0});
    put_floats(bytes, motion.v_world.y(), motion.v_world.x(), -motion.v_world.z());
    put_floats(bytes, motion.p_world.y(), motion.p_world.x(), -motion.p_world.z());
    entries.push_back({motion.time, bytes.text});
  }
  for (const LoggedOutputs& outputs : log.outputs) {
    LogBytes bytes = packet(68).put(microseconds(outputs.time));
    for (std::size_t i = 0; i < 4; ++i) {
      bytes.put(static_cast<std::uint16_t>(
          std::lround(1100.0 + 800.0 * static_cast<double>(outputs.outputs[i]))));
    }
    entries.push_back({outputs.time, bytes.text});
  }
  return text + in_order(std::move(entries));
}

FlightLog parsed(const std::string& bytes) {
  return parse_flight_log(std::as_bytes(std::span(bytes)), "flight.ulg");
}

}  // namespace pointflight
