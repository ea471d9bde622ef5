#pragma once

#include <memory>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/motion.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/scan.hpp"
#include "pointflight/lidar/scan_beams.hpp"
#include "pointflight/map/known_space.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Which scan to take.
struct ScanRequest {
  std::uint64_t index = 0;  ///< Scan number: its pattern, and its place in the noise stream.
  SimTime start;            ///< When it starts in the run.
  bool snapshot = false;    ///< All beams from the pose at the scan's middle, as in the paper.
  bool noise = true;        ///< Range noise of the sensor file.
  std::uint64_t seed = 0;   ///< Of the range noise.
  /// Points get `is_unknown` by it; null: they do not.
  const KnownSpace* known = nullptr;
  std::span<const Body> bodies;  ///< What moves in the map, without what carries the sensor.
};

/// A LiDAR: pattern, renderer, noise.
class Lidar {
 public:
  /// `sensor` numbers it within the run: the entity of its random streams. LiDARs of the same
  /// settings may share their beams; null: it has its own.
  Lidar(const LidarSettings& settings,
        std::uint32_t sensor,
        std::shared_ptr<const ScanBeams> beams = nullptr);

  /// As given to the constructor.
  [[nodiscard]] const LidarSettings& settings() const { return settings_; }
  /// Duration of a scan: 1 / rate, rounded to a nanosecond.
  [[nodiscard]] Duration period() const;
  /// `Scan::middle` of a scan that starts then.
  [[nodiscard]] SimTime middle_of(SimTime start, std::span<const Beam> beams, bool snapshot) const;
  /// The longest ray that it can see something at, m from the sensor.
  [[nodiscard]] double reach() const;

  /// Takes one scan in arrears: the track of the sensor and the bodies must know all instants of
  /// the scan. The result does not depend on the executor's threads.
  [[nodiscard]] Scan take(const ScanRequest& request,
                          const PoseTrack& T_world_sensor,
                          const Renderer& renderer,
                          const Executor& executor) const;

  /// The beams of a scan.
  [[nodiscard]] std::vector<Beam> beams(std::uint64_t scan_index, const Executor& executor) const {
    return beams_->of(scan_index, executor)->beams;
  }

 private:
  [[nodiscard]] std::vector<Ray> rays_of(std::span<const Beam> beams,
                                         SimTime start,
                                         const PoseTrack& T_world_sensor,
                                         bool snapshot,
                                         std::span<Duration> offsets,
                                         const Executor& executor) const;
  [[nodiscard]] float depth_share(const Beam& beam) const;

  LidarSettings settings_;
  std::uint32_t sensor_;
  std::shared_ptr<const ScanBeams> beams_;
  bool measures_depth_ = false;  ///< Limits and noise are of the depth along the axis.
};

}  // namespace pointflight
