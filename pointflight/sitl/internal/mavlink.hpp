// MAVLink, the language of flight controllers: its frames, versions 1 and 2
// (mavlink.io/en/guide/serialization.html), and the messages of common.xml that simulators exchange
// with PX4. Fields stand in the order of the wire, in the units of common.xml; vectors and
// quaternions (w, x, y, z) are arrays.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pointflight::mavlink {

/// What a kind of message is on the wire.
struct MessageKind {
  std::uint32_t id;
  std::uint8_t length;     ///< Bytes of all fields.
  std::uint8_t crc_extra;  ///< Says that both ends mean the same fields.
};

/// "I am here"; PX4 says it once on this link.
struct Heartbeat {
  static constexpr MessageKind kKind{0, 9, 50};
  std::uint32_t custom_mode = 0;
  std::uint8_t type = 0;       ///< MAV_TYPE
  std::uint8_t autopilot = 0;  ///< MAV_AUTOPILOT; 12 is PX4.
  std::uint8_t base_mode = 0;  ///< MAV_MODE_FLAG
  std::uint8_t status = 0;     ///< MAV_STATE
  std::uint8_t version = 3;    ///< Of MAVLink.
};

/// Sticks of a remote control, us; 65535: not used.
struct RcChannels {
  static constexpr MessageKind kKind{65, 42, 118};
  std::uint32_t time_boot_ms = 0;
  std::array<std::uint16_t, 18> channels{};
  std::uint8_t count = 0;
  std::uint8_t rssi = 255;  ///< 255: not known.
};

/// A command with numbers.
struct CommandLong {
  static constexpr MessageKind kKind{76, 33, 152};
  static constexpr std::uint16_t kSetMessageInterval = 511;  ///< Of message p1 (id): p2 (us).
  std::array<float, 7> parameters{};
  std::uint16_t command = 0;  ///< MAV_CMD
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;
  std::uint8_t confirmation = 0;
};

/// What the flight controller tells motors and servos.
struct HilActuatorControls {
  static constexpr MessageKind kKind{93, 81, 47};
  std::uint64_t time_usec = 0;
  std::uint64_t flags = 0;  ///< Bit 0: it is built for lockstep.
  std::array<float, 16> controls{};
  std::uint8_t mode = 0;  ///< MAV_MODE_FLAG

  [[nodiscard]] bool is_armed() const { return (mode & 128u) != 0; }
};

/// What sensors measured, body axes front, right, down.
struct HilSensor {
  static constexpr MessageKind kKind{107, 65, 108};
  static constexpr std::uint32_t kAccelerometer = 0x7;
  static constexpr std::uint32_t kGyroscope = 0x38;
  static constexpr std::uint32_t kMagnetometer = 0x1c0;
  static constexpr std::uint32_t kBarometer = 0x1a00;  ///< Pressure, its altitude, temperature.
  std::uint64_t time_usec = 0;
  std::array<float, 3> acceleration{};  ///< Specific force, m/s^2.
  std::array<float, 3> rates{};         ///< rad/s
  std::array<float, 3> field{};         ///< gauss
  float pressure = 0.0f;                ///< hPa
  float pressure_difference = 0.0f;     ///< hPa
  float pressure_altitude = 0.0f;       ///< m
  float temperature = 0.0f;             ///< deg C
  std::uint32_t updated = 0;            ///< Which of these are new: the masks above.
  std::uint8_t id = 0;                  ///< Of the instance; 0 is the clock of the others.
};

/// A fix of a satellite receiver.
struct HilGps {
  static constexpr MessageKind kKind{113, 39, 124};
  std::uint64_t time_usec = 0;
  std::int32_t latitude = 0;               ///< 1e-7 deg
  std::int32_t longitude = 0;              ///< 1e-7 deg
  std::int32_t altitude = 0;               ///< Above sea, mm.
  std::uint16_t horizontal = 65535;        ///< Accuracy as PX4 reads it, cm.
  std::uint16_t vertical = 65535;          ///< The same.
  std::uint16_t speed = 65535;             ///< cm/s
  std::array<std::int16_t, 3> velocity{};  ///< North, east, down, cm/s.
  std::uint16_t course = 65535;            ///< Over ground, 0.01 deg.
  std::uint8_t fix = 0;                    ///< GPS_FIX_TYPE; 3: in three dimensions.
  std::uint8_t satellites = 255;
  std::uint8_t id = 0;
  std::uint16_t yaw = 0;  ///< 0.01 deg; 0: not known.
};

/// The truth, which flight controllers only log.
struct HilStateQuaternion {
  static constexpr MessageKind kKind{115, 64, 4};
  std::uint64_t time_usec = 0;
  std::array<float, 4> q{};      ///< Body (front, right, down) in the world (north, east, down).
  std::array<float, 3> rates{};  ///< rad/s, body.
  std::int32_t latitude = 0;     ///< 1e-7 deg
  std::int32_t longitude = 0;    ///< 1e-7 deg
  std::int32_t altitude = 0;     ///< mm
  std::array<std::int16_t, 3> velocity{};  ///< North, east, down, cm/s.
  std::uint16_t indicated_airspeed = 0;    ///< cm/s
  std::uint16_t true_airspeed = 0;         ///< cm/s
  /// common.xml says mG; PX4 and its simulators have mm/s^2.
  std::array<std::int16_t, 3> acceleration{};
};

/// A range finder's.
struct DistanceSensor {
  static constexpr MessageKind kKind{132, 39, 85};
  static constexpr std::uint8_t kCustomOrientation = 100;  ///< MAV_SENSOR_ROTATION_CUSTOM: `q`.
  std::uint32_t time_boot_ms = 0;
  std::uint16_t least = 0;    ///< cm
  std::uint16_t most = 0;     ///< cm
  std::uint16_t current = 0;  ///< cm
  std::uint8_t type = 0;      ///< MAV_DISTANCE_SENSOR; 0: laser.
  std::uint8_t id = 0;
  std::uint8_t orientation = 25;  ///< MAV_SENSOR_ORIENTATION; 25: down.
  std::uint8_t covariance = 255;  ///< cm^2; 255: not known.
  float horizontal_field = 0.0f;  ///< rad
  float vertical_field = 0.0f;    ///< rad
  std::array<float, 4> q{};       ///< Of the sensor in the body, if `kCustomOrientation`.
  std::uint8_t quality = 0;       ///< 1 to 100; 0: not known.
};

/// What is around the vehicle, by direction.
struct ObstacleDistance {
  static constexpr MessageKind kKind{330, 167, 23};
  static constexpr std::uint8_t kBodyFrd = 12;  ///< MAV_FRAME_BODY_FRD
  std::uint64_t time_usec = 0;
  std::array<std::uint16_t, 72> distances{};  ///< cm; `most` + 1: nothing; 65535: not known.
  std::uint16_t least = 0;                    ///< cm
  std::uint16_t most = 0;                     ///< cm
  std::uint8_t sensor_type = 0;               ///< MAV_DISTANCE_SENSOR
  std::uint8_t increment = 0;                 ///< Between directions, clockwise, deg.
  float fine_increment = 0.0f;                ///< The same, if above 0.
  float offset = 0.0f;                        ///< Of the first direction from the front, deg.
  std::uint8_t frame = kBodyFrd;              ///< MAV_FRAME
};

/// Where a vehicle is, and how it moves, by an estimator outside of the flight controller. NaN: not
/// known.
struct Odometry {
  static constexpr MessageKind kKind{331, 233, 91};
  static constexpr std::uint8_t kLocalNed = 1;  ///< MAV_FRAME_LOCAL_NED
  static constexpr std::uint8_t kBodyFrd = 12;  ///< MAV_FRAME_BODY_FRD
  static constexpr std::uint8_t kVision = 2;    ///< MAV_ESTIMATOR_TYPE_VISION
  std::uint64_t time_usec = 0;
  std::array<float, 3> position{};          ///< m, `frame`.
  std::array<float, 4> q{};                 ///< Of `child_frame` in `frame`.
  std::array<float, 3> velocity{};          ///< m/s, `child_frame`.
  std::array<float, 3> rates{};             ///< rad/s, `child_frame`.
  std::array<float, 21> pose_covariance{};  ///< Upper right triangle: x, y, z, roll, pitch, yaw.
  std::array<float, 21> velocity_covariance{};  ///< The same of velocities and rates.
  std::uint8_t frame = kLocalNed;
  std::uint8_t child_frame = kBodyFrd;
  std::uint8_t resets = 0;
  std::uint8_t estimator = kVision;
  std::int8_t quality = 0;
};

/// Calls `visit(field)` for each field, in the order of the wire.
template <class Visit>
void for_each_field(Heartbeat& m, const Visit& visit) {
  visit(m.custom_mode), visit(m.type), visit(m.autopilot), visit(m.base_mode), visit(m.status);
  visit(m.version);
}
/// The same of others.
///@{
template <class Visit>
void for_each_field(RcChannels& m, const Visit& visit) {
  visit(m.time_boot_ms), visit(m.channels), visit(m.count), visit(m.rssi);
}
template <class Visit>
void for_each_field(CommandLong& m, const Visit& visit) {
  visit(m.parameters), visit(m.command), visit(m.target_system), visit(m.target_component);
  visit(m.confirmation);
}
template <class Visit>
void for_each_field(HilActuatorControls& m, const Visit& visit) {
  visit(m.time_usec), visit(m.flags), visit(m.controls), visit(m.mode);
}
template <class Visit>
void for_each_field(HilSensor& m, const Visit& visit) {
  visit(m.time_usec), visit(m.acceleration), visit(m.rates), visit(m.field), visit(m.pressure);
  visit(m.pressure_difference), visit(m.pressure_altitude), visit(m.temperature);
  visit(m.updated), visit(m.id);
}
template <class Visit>
void for_each_field(HilGps& m, const Visit& visit) {
  visit(m.time_usec), visit(m.latitude), visit(m.longitude), visit(m.altitude);
  visit(m.horizontal), visit(m.vertical), visit(m.speed), visit(m.velocity), visit(m.course);
  visit(m.fix), visit(m.satellites), visit(m.id), visit(m.yaw);
}
template <class Visit>
void for_each_field(HilStateQuaternion& m, const Visit& visit) {
  visit(m.time_usec), visit(m.q), visit(m.rates), visit(m.latitude), visit(m.longitude);
  visit(m.altitude), visit(m.velocity), visit(m.indicated_airspeed), visit(m.true_airspeed);
  visit(m.acceleration);
}
template <class Visit>
void for_each_field(DistanceSensor& m, const Visit& visit) {
  visit(m.time_boot_ms), visit(m.least), visit(m.most), visit(m.current), visit(m.type);
  visit(m.id), visit(m.orientation), visit(m.covariance), visit(m.horizontal_field);
  visit(m.vertical_field), visit(m.q), visit(m.quality);
}
template <class Visit>
void for_each_field(ObstacleDistance& m, const Visit& visit) {
  visit(m.time_usec), visit(m.distances), visit(m.least), visit(m.most), visit(m.sensor_type);
  visit(m.increment), visit(m.fine_increment), visit(m.offset), visit(m.frame);
}
template <class Visit>
void for_each_field(Odometry& m, const Visit& visit) {
  visit(m.time_usec), visit(m.position), visit(m.q), visit(m.velocity), visit(m.rates);
  visit(m.pose_covariance), visit(m.velocity_covariance), visit(m.frame), visit(m.child_frame);
  visit(m.resets), visit(m.estimator), visit(m.quality);
}
///@}

/// A message as it came, of one of the kinds above.
struct Frame {
  std::uint32_t id = 0;
  std::uint8_t system = 0;           ///< Who sent it.
  std::uint8_t component = 0;        ///< The same.
  std::uint8_t sequence = 0;         ///< Counts the sender's messages.
  std::vector<std::byte> payload{};  ///< As it was sent: zeros at its end may be missing.
};

/// Takes bytes as they come from a stream and finds the frames in them. Of whatever is none, of
/// kinds that it does not know, of what a checksum refuses, and of frames with flags that it does
/// not understand it drops a byte and looks on.
class FrameReader {
 public:
  /// More of the stream.
  void add(std::span<const std::byte> bytes);
  /// The next frame that has come as a whole; nothing until more bytes have come.
  std::optional<Frame> next();
  /// Bytes that belonged to no frame of a known kind.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  std::vector<std::byte> bytes_;
  std::size_t begin_ = 0;
  std::uint64_t dropped_ = 0;
};

/// Makes frames of version 2.
class FrameWriter {
 public:
  /// In whose name.
  FrameWriter(std::uint8_t system, std::uint8_t component)
      : system_(system), component_(component) {}

  /// Appends a message to a stream.
  template <class Message>
  void append(const Message& message, std::vector<std::byte>& stream) {
    payload_.clear();
    // visited only to be read
    for_each_field(const_cast<Message&>(message), [this](const auto& field) { this->put(field); });
    append(Message::kKind, stream);
  }

 private:
  template <class Number>
  void put(const Number& number) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&number);
    payload_.insert(payload_.end(), bytes, bytes + sizeof(Number));
  }
  void append(const MessageKind& kind, std::vector<std::byte>& stream);

  std::uint8_t system_, component_;
  std::uint8_t sequence_ = 0;
  std::vector<std::byte> payload_;
};

/// The message in a frame; nothing if the frame is of another kind.
template <class Message>
std::optional<Message> message_in(const Frame& frame);

/// CRC-16/MCRF4XX of bytes, going on from `crc`.
std::uint16_t checksum(std::span<const std::byte> bytes, std::uint16_t crc = 0xffff);

template <class Message>
std::optional<Message> message_in(const Frame& frame) {
  if (frame.id != Message::kKind.id) return std::nullopt;
  Message message;
  std::size_t at = 0;
  for_each_field(message, [&](auto& field) {
    auto* to = reinterpret_cast<std::byte*>(&field);
    for (std::size_t i = 0; i < sizeof(field); ++i, ++at) {
      to[i] = at < frame.payload.size() ? frame.payload[at] : std::byte{0};
    }
  });
  return message;
}

}  // namespace pointflight::mavlink
