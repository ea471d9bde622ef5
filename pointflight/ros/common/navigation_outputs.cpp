// Rows of the table of outputs for the sensors of `sim/navigation_sensors`.
#include <limits>

#include "pointflight/ros/common/messages.hpp"
#include "pointflight/ros/common/output_rows.hpp"

namespace pointflight {
namespace {

constexpr double kMicro = 1e-6;  // T in uT

msg::FluidPressure barometer_message(const OutputStream& stream, const Measurement& m) {
  msg::FluidPressure message;
  message.header = stream.header(m.time);
  message.fluid_pressure = m.values[0];
  return message;
}

msg::MagneticField magnetometer_message(const OutputStream& stream, const Measurement& m) {
  msg::MagneticField message;
  message.header = stream.header(m.time);
  message.magnetic_field = {kMicro * m.values[0], kMicro * m.values[1], kMicro * m.values[2]};
  return message;
}

msg::NavSatFix gnss_message(const OutputStream& stream, const Measurement& m) {
  msg::NavSatFix message;
  message.header = stream.header(m.time);
  message.latitude = m.values[0];
  message.longitude = m.values[1];
  message.altitude = m.values[2];
  message.position_covariance[0] = m.values[6] * m.values[6];
  message.position_covariance[4] = message.position_covariance[0];
  message.position_covariance[8] = m.values[7] * m.values[7];
  return message;
}

msg::Range range_message(const OutputStream& stream, const Measurement& m) {
  msg::Range message;
  message.header = stream.header(m.time);
  message.range =
      m.values[0] < 0.0 ? std::numeric_limits<float>::infinity() : static_cast<float>(m.values[0]);
  message.min_range = static_cast<float>(m.values[1]);
  message.max_range = static_cast<float>(m.values[2]);
  return message;
}

}  // namespace

std::vector<OutputType> navigation_outputs() {
  const auto frame = OutputType::Frame::kBody;
  return {{.name = "barometer",
           .help = "what a sensor of kind barometer measures",
           .make = per_sample<barometer_message>(),
           .frame = frame,
           .sensor = "barometer"},
          {.name = "magnetometer",
           .help = "what a sensor of kind magnetometer measures",
           .make = per_sample<magnetometer_message>(),
           .frame = frame,
           .sensor = "magnetometer"},
          {.name = "gnss",
           .help = "fixes of a sensor of kind gnss",
           .make = per_sample<gnss_message>(),
           .frame = frame,
           .sensor = "gnss"},
          {.name = "range_finder",
           .help = "what a sensor of kind range_finder measures",
           .make = per_sample<range_message>(),
           .frame = frame,
           .sensor = "range_finder"}};
}

}  // namespace pointflight
