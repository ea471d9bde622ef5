// Logs as firmwares write them, byte by byte: written from the definitions of the formats, and not
// from our readers.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/flight_log/flight_log.hpp"

namespace pointflight {

/// A file that grows.
class LogBytes {
 public:
  template <class T>
  LogBytes& put(T value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    text.append(bytes, sizeof(T));
    return *this;
  }
  LogBytes& put_text(const std::string& words, std::size_t length) {
    text += words;
    text.append(length - words.size(), '\0');
    return *this;
  }
  std::string text;
};

/// A message of a ULog: its size, its kind, what it says.
std::string ulog_message(char kind, const std::string& payload);
/// What every ULog begins with, flags included.
std::string ulog_start(unsigned char incompatible = 0);
/// Format, or a message that says as much by itself.
std::string ulog_format(const std::string& definition);
/// Of the type "float NAME".
std::string ulog_parameter(const std::string& name, float value);
/// From here on data of number `number` is of a message.
std::string ulog_subscription(std::uint16_t number,
                              const std::string& name,
                              std::uint8_t instance = 0);

/// A log as PX4 has it, in its frames and units.
std::string ulog_of(const FlightLog& log,
                    const std::vector<std::pair<std::string, float>>& parameters = {});

/// The same of ArduPilot: RCOU, IMU, ATT, XKF1, PARM.
std::string dataflash_of(const FlightLog& log);

/// Parses bytes as a log.
FlightLog parsed(const std::string& bytes);

}  // namespace pointflight
