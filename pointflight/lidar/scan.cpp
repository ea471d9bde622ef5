#include "pointflight/lidar/scan.hpp"

#include <cstring>

#include "pointflight/io/pcd_writer.hpp"

namespace pointflight {

void write_scan_pcd(const std::string& path, const Scan& scan) {
  constexpr std::size_t kFloats = 6;
  constexpr std::size_t kRow = kFloats * sizeof(float) + 2 * sizeof(std::uint16_t);
  std::vector<std::byte> rows(scan.points.size() * kRow);
  std::byte* at = rows.data();
  for (const ScanPoint& point : scan.points) {
    const float values[kFloats] = {point.position_sensor.x(),
                                   point.position_sensor.y(),
                                   point.position_sensor.z(),
                                   point.intensity,
                                   point.range,
                                   static_cast<float>(to_seconds(point.time_offset))};
    std::memcpy(at, values, sizeof values);
    const std::uint16_t integers[2] = {point.ring, static_cast<std::uint16_t>(point.label)};
    std::memcpy(at + sizeof values, integers, sizeof integers);
    at += kRow;
  }
  write_pcd(OutputFile(path),
            {{"x", 'F', 4},
             {"y", 'F', 4},
             {"z", 'F', 4},
             {"intensity", 'F', 4},
             {"range", 'F', 4},
             {"time", 'F', 4},
             {"ring", 'U', 2},
             {"label", 'U', 2}},
            scan.points.size(),
            rows);
}

}  // namespace pointflight
