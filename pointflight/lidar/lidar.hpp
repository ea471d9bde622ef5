#pragma once

#include <memory>
#include <optional>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/motion.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/blockage.hpp"
#include "pointflight/lidar/exposure.hpp"
#include "pointflight/lidar/footprint.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/lidar/scan.hpp"
#include "pointflight/lidar/scan_beams.hpp"
#include "pointflight/lidar/stereo.hpp"
#include "pointflight/map/known_space.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

class RangeOffsets;

/// Which scan to take.
struct ScanRequest {
  std::uint64_t index = 0;  ///< Scan number: `Lidar::pattern_scan`, and its number among draws.
  SimTime start;            ///< When it starts in the run.
  bool snapshot = false;    ///< All beams from the pose at the scan's middle, as in the paper.
  bool noise = true;        ///< Of ranges and directions, by the sensor file.
  std::uint64_t seed = 0;   ///< Of all noise and of which beams come back.
  /// Points get `is_unknown` by it; null: they do not.
  const KnownSpace* known = nullptr;
  /// What is rendered, if it says more of its surfels (`SurfelMap::notes`): points get
  /// `PointTruth::part_of` and, on assumed ones, `is_assumed` and, if `known` is there,
  /// `is_unknown`.
  const SurfelMap* map = nullptr;
  bool truth = false;            ///< `Scan::truth` is wanted.
  std::span<const Body> bodies;  ///< What moves in the map, without what carries the sensor.
};

/// A LiDAR: pattern, renderer, returns.
class Lidar {
 public:
  /// `sensor` numbers it within the run: the entity of its random streams. LiDARs of the same
  /// settings may share their beams; null: it has its own. With `surroundings` returns are modelled
  /// (`ReturnModel`, `Footprint`, directions with noise); without, whatever a beam hits within the
  /// sensor's range comes back with the map's intensity and Gaussian noise of the range. Throws
  /// InputError if the file of what is blocked cannot be read.
  Lidar(const LidarSettings& settings,
        std::uint32_t sensor,
        std::shared_ptr<const ScanBeams> beams = nullptr,
        const std::optional<Surroundings>& surroundings = std::nullopt);

  /// As given to the constructor.
  [[nodiscard]] const LidarSettings& settings() const { return settings_; }
  /// The same one with beams that are lines.
  [[nodiscard]] Lidar as_lines() const;
  /// Duration of a scan: 1 / rate, rounded to a nanosecond.
  [[nodiscard]] Duration period() const;
  /// `Scan::middle` of a scan that starts then.
  [[nodiscard]] SimTime middle_of(SimTime start, std::span<const Beam> beams, bool snapshot) const;
  /// True if a beam may have several points.
  [[nodiscard]] bool reports_echoes() const;
  /// The longest ray that it can see something at, m from the sensor.
  [[nodiscard]] double reach() const;

  /// Begins a scan in arrears: the track of the sensor and the bodies must know all instants of the
  /// scan. LiDAR, renderer and what the request refers to must outlive the exposure. The result
  /// does not depend on the executor's threads.
  [[nodiscard]] std::unique_ptr<Exposure> aim(const ScanRequest& request,
                                              const PoseTrack& T_world_sensor,
                                              const Renderer& renderer,
                                              const Executor& executor) const;

  /// Takes one scan: aims, has its rays rendered as long as there are some, and finishes it.
  [[nodiscard]] Scan take(const ScanRequest& request,
                          const PoseTrack& T_world_sensor,
                          const Renderer& renderer,
                          const Executor& executor) const;

  /// Which scan of its pattern is scan `index` of a run with this seed. Where returns are modelled
  /// a run starts anywhere in a pattern that does not repeat: all sensors of one model at the same
  /// scan.
  [[nodiscard]] std::uint64_t pattern_scan(std::uint64_t index, std::uint64_t seed) const;
  /// The beams of a scan of the pattern.
  [[nodiscard]] std::vector<Beam> beams(std::uint64_t pattern_scan,
                                        const Executor& executor) const {
    return beams_->of(pattern_scan, executor)->beams;
  }

 private:
  struct Aimed;
  class OneScan;
  [[nodiscard]] std::vector<Pose> poses_of(const PoseTrack& T_world_sensor,
                                           const Aimed& aimed) const;
  [[nodiscard]] std::vector<BeamDeviation> direction_noise(const ScanRequest& request,
                                                           std::size_t beams,
                                                           const Executor& executor) const;
  [[nodiscard]] RayBatch batch_of(const Aimed& aimed) const;

  struct Received;
  void take_out_blocked(const Aimed& aimed, Received& received, const Executor& executor) const;
  void leave_motion(const Aimed& aimed, const PoseTrack& T_world_sensor, Scan& scan) const;

  /// What came back of a scan's beams.
  struct Received {
    std::vector<Return> returns;         ///< `most` for each beam, in its order.
    std::size_t most = 1;                ///< Returns that a beam may have.
    std::vector<std::uint8_t> infrared;  ///< `Scan::infrared`
  };
  template <class Seen>
  [[nodiscard]] Received reported(const Aimed& aimed,
                                  std::span<const Seen> seen,
                                  const Executor& executor) const;
  [[nodiscard]] Received received(const Aimed& aimed,
                                  std::span<const Hit> hits,
                                  const Executor& executor) const;
  [[nodiscard]] Received received(const Aimed& aimed,
                                  std::span<const Echoes> echoes,
                                  const Executor& executor) const;
  [[nodiscard]] RangeOffsets offsets_of(const Aimed& aimed) const;
  [[nodiscard]] Received received_as_ideal(const Aimed& aimed,
                                           std::span<const Hit> hits,
                                           const Executor& executor) const;
  [[nodiscard]] Received received_as_stereo(const Aimed& aimed,
                                            std::span<const Hit> hits,
                                            const Executor& executor) const;
  [[nodiscard]] std::vector<std::uint8_t> infrared_of(std::span<const Beam> beams,
                                                      std::span<const Hit> hits,
                                                      const Executor& executor) const;
  [[nodiscard]] Scan written(const Aimed& aimed,
                             const PoseTrack& T_world_sensor,
                             Received received,
                             const Executor& executor) const;
  [[nodiscard]] float depth_share(const Beam& beam) const;
  [[nodiscard]] double range_limit() const;

  LidarSettings settings_;
  std::uint32_t sensor_;
  std::shared_ptr<const ScanBeams> beams_;
  std::optional<ReturnModel> returns_;
  Footprint footprint_;
  std::shared_ptr<const Blockage> blockage_;  ///< Null: nothing is blocked.
  std::optional<StereoCamera> stereo_;
  bool measures_depth_ = false;  ///< Limits and noise are of the depth along the axis.
};

}  // namespace pointflight
