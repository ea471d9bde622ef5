// What barometers, magnetometers, satellite receivers and range finders say: sensor_msgs.
#pragma once

#include <array>
#include <cstdint>

#include "ros_common/messages/geometry.hpp"

namespace pointflight::msg {

/// Of a barometer.
struct FluidPressure {
  static constexpr TypeName kType{"sensor_msgs", "FluidPressure"};
  Header header;                ///< The body's frame.
  double fluid_pressure = 0.0;  ///< Pa
  double variance = 0.0;        ///< Pa^2; 0: unknown.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("fluid_pressure", m.fluid_pressure);
    v("variance", m.variance);
  }
};

/// Of a magnetometer.
struct MagneticField {
  static constexpr TypeName kType{"sensor_msgs", "MagneticField"};
  Header header;                                      ///< The body's frame.
  Vector3 magnetic_field;                             ///< T
  std::array<double, 9> magnetic_field_covariance{};  ///< Zeros: unknown.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("magnetic_field", m.magnetic_field);
    v("magnetic_field_covariance", m.magnetic_field_covariance);
  }
};

/// Of which satellites a fix is.
struct NavSatStatus {
  static constexpr TypeName kType{
      "sensor_msgs",
      "NavSatStatus",
      "sensor_msgs",
      "int8 STATUS_NO_FIX =  -1\nint8 STATUS_FIX =      0\nint8 STATUS_SBAS_FIX = 1\n"
      "int8 STATUS_GBAS_FIX = 2\nuint16 SERVICE_GPS =     1\nuint16 SERVICE_GLONASS = 2\n"
      "uint16 SERVICE_COMPASS = 4\nuint16 SERVICE_GALILEO = 8\n"};
  std::int8_t status = 0;     ///< A fix.
  std::uint16_t service = 1;  ///< GPS.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("status", m.status);
    v("service", m.service);
  }
};

/// A fix.
struct NavSatFix {
  static constexpr TypeName kType{"sensor_msgs",
                                  "NavSatFix",
                                  "sensor_msgs",
                                  "uint8 COVARIANCE_TYPE_UNKNOWN = 0\n"
                                  "uint8 COVARIANCE_TYPE_APPROXIMATED = 1\n"
                                  "uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN = 2\n"
                                  "uint8 COVARIANCE_TYPE_KNOWN = 3\n"};
  static constexpr std::uint8_t kDiagonalKnown = 2;        ///< Of `position_covariance_type`.
  Header header;                                           ///< The body's frame.
  NavSatStatus status;                                     ///< A fix.
  double latitude = 0.0;                                   ///< deg, WGS 84.
  double longitude = 0.0;                                  ///< deg
  double altitude = 0.0;                                   ///< Above the ellipsoid, m.
  std::array<double, 9> position_covariance{};             ///< East, north, up, m^2.
  std::uint8_t position_covariance_type = kDiagonalKnown;  ///< What is known of it.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("status", m.status);
    v("latitude", m.latitude);
    v("longitude", m.longitude);
    v("altitude", m.altitude);
    v("position_covariance", m.position_covariance);
    v("position_covariance_type", m.position_covariance_type);
  }
};

/// Of a range finder.
struct Range {
  static constexpr TypeName kType{
      "sensor_msgs", "Range", "sensor_msgs", "uint8 ULTRASOUND=0\nuint8 INFRARED=1\n"};
  Header header;                    ///< The body's frame.
  std::uint8_t radiation_type = 1;  ///< Infrared.
  float field_of_view = 0.0f;       ///< rad: one ray.
  float min_range = 0.0f;           ///< m
  float max_range = 0.0f;           ///< m
  float range = 0.0f;               ///< m; infinity where nothing is within reach (REP 117).
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("radiation_type", m.radiation_type);
    v("field_of_view", m.field_of_view);
    v("min_range", m.min_range);
    v("max_range", m.max_range);
    v("range", m.range);
  }
};

}  // namespace pointflight::msg
