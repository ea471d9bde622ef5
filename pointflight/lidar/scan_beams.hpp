#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/render/sensor_beams.hpp"

namespace pointflight {

/// The beams of a sensor's scans: made once for all vehicles that carry it and scan at the same
/// instants. Callable from several threads.
class ScanBeams {
 public:
  /// Throws InputError.
  explicit ScanBeams(const LidarSettings& settings) : ScanBeams(settings, make_pattern(settings)) {}
  /// Of another pattern than the settings name; not null.
  ScanBeams(const LidarSettings& settings, std::unique_ptr<BeamPattern> pattern);

  /// Of one scan.
  struct Ordered {
    std::vector<Beam> beams;  ///< In firing order.
    /// Neighbours in direction one after the other; empty for patterns that do not repeat, whose
    /// neighbours fire at different times, so that it depends on how the sensor turns.
    std::vector<std::uint32_t> order;
    std::shared_ptr<const SensorBeams> in_sensor;  ///< The beams for renderers.
  };
  /// Of scan `index`; scans that were asked for lately are kept.
  [[nodiscard]] std::shared_ptr<const Ordered> of(std::uint64_t index,
                                                  const Executor& executor) const;

 private:
  /// Scans end at a time, but one that is late is taken with the next.
  static constexpr std::size_t kKept = 2;
  struct Kept {
    std::uint64_t index = 0;
    std::shared_ptr<const Ordered> beams;  ///< Null: none.
  };

  std::unique_ptr<BeamPattern> pattern_;
  Duration period_;
  bool measures_depth_;
  mutable std::mutex mutex_;
  mutable std::array<Kept, kKept> kept_;
  mutable std::size_t next_ = 0;  ///< Of `kept_`, to be replaced.
};

}  // namespace pointflight
