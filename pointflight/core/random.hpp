#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace pointflight {

/// What a random draw is for. The list only grows and numbers are never reused: a draw's address is
/// part of every recorded result.
enum class StreamId : std::uint32_t {
  kLidarRangeNoise = 1,  ///< entity: vehicle << 8 | lidar, index: scan << 32 | beam
  kImuGyroNoise = 2,     ///< index: sample * 3 + axis
  kImuGyroBias = 3,      ///< index: sample * 3 + axis
  kImuAccelNoise = 4,    ///< index: sample * 3 + axis
  kImuAccelBias = 5,     ///< index: sample * 3 + axis
  kForest = 6,           ///< made-up forests (entity 0) and worlds (1 and up); index: draw number
  kCloudSampling = 7,    ///< points on analytic shapes; entity: shape, index: point
  kMissionSearch = 8,    ///< candidate positions in `scenario new`; index: candidate
  // 9: was blocks of a cloud, now a plain hash
  kScenePoses = 10,       ///< where sensors stand in an exact scene; index: try
  kAimedBeams = 11,       ///< beams at the targets of a small scene; entity: pose, index: beam
  kObstacles = 12,        ///< entity: obstacle, index: (times replaced << 12) + draw
  kGusts = 13,            ///< entity: vehicle, index: physics step * 4 + draw
  kDroppedScans = 14,     ///< entity: vehicle << 8 | lidar, index: scan
  kOwnSensors = 15,       ///< of kinds that programs add; entity: vehicle << 8 | sensor
  kSurvey = 16,           ///< of an exact scene; entity: which draw, index: its number
  kLidarDetection = 17,   ///< entity: vehicle << 8 | lidar, index: scan << 32 | beam
  kLidarAngle = 18,       ///< of beams' directions; entity and index as above
  kImuGyroFlicker = 19,   ///< index: (sample * processes + process) * 3 + axis
  kImuAccelFlicker = 20,  ///< the same
  kImuTurnOn = 21,        ///< IMU errors that are constant over a run; index: what * 3 + axis
  kImuClock = 22,         ///< index: sample
  kVibration = 23,        ///< angles that rotors start from; index: rotor
  kPatternPhase = 24,     ///< which scan of a pattern that does not repeat a run starts with
  kLidarWeather = 25,     ///< drops and fog; entity and index as of kLidarDetection
  kLidarEcho = 26,        ///< entity: echo << 28 | vehicle << 8 | lidar, index as above
  kOdometry = 27,         ///< entity: vehicle, index: report * 9 + draw
  kNavigation = 28,       ///< entity: vehicle << 8 | sensor, index: measurement * 12 + draw
  kStereo = 29,           ///< of windows; entity: vehicle << 8 | lidar, index: scan << 32 | node
  kStudy = 30,            ///< values drawn for a campaign; entity: key, index: draw
  kLeftOutPoints = 31,    ///< entity: 0 positions, index: try; 1, 2 ends of rays: point
  kLidarOffset = 32,      ///< of ranges; entity: vehicle << 8 | lidar, index: 0 all, 1 + ring
  kLidarBlockage = 33,    ///< entity: vehicle << 8 | lidar, index: second of the run
  kLidarDeskewing = 34,   ///< entity: vehicle << 8 | lidar, index: draw * 6 + component
  kLearning = 35,         ///< free positions; index: draw
  kPlaces = 36,           ///< of made-up worlds; index: draw
  kSeeThrough = 37,       ///< entity: draw << 28 | vehicle << 8 | lidar, index: scan << 32 | beam
  kReflectivity = 38,     ///< of things in made-up worlds; entity: of the world, index: thing
  kSurfaceNotes = 39,     ///< rays through surfels of made-up worlds; index: 2 * ray + 0, 1
  kTest = 1000,           ///< inputs of tests and benchmarks
};

/// Random numbers addressed by (seed, stream, entity, index): Philox 4x32-10 as a pure function.
///
/// A draw costs no state and moves no other draw, so that adding a sensor, a vehicle or a thread
/// changes nothing else. `entity` numbers the vehicle or sensor.
class RandomStream {
 public:
  /// `entity`: see the stream's own comment.
  RandomStream(std::uint64_t seed, StreamId stream, std::uint32_t entity)
      : seed_(seed), stream_(stream), entity_(entity) {}

  /// 128 random bits.
  [[nodiscard]] std::array<std::uint32_t, 4> bits(std::uint64_t index) const;

  /// Two independent uniforms in [0, 1) with 53 bits each.
  [[nodiscard]] std::array<double, 2> uniform2(std::uint64_t index) const;
  /// The first of `uniform2`.
  [[nodiscard]] double uniform(std::uint64_t index) const { return uniform2(index)[0]; }
  /// Uniform in [low, high).
  [[nodiscard]] double uniform(std::uint64_t index, double low, double high) const {
    return low + (high - low) * uniform(index);
  }

  /// Two independent standard normals (Box-Muller; never rejection, which would need state).
  [[nodiscard]] std::array<double, 2> normal2(std::uint64_t index) const;
  /// The first of `normal2`.
  [[nodiscard]] double normal(std::uint64_t index) const { return normal2(index)[0]; }

  /// A standard normal that moves continuously with `t`: a draw at each integer, in between a
  /// mixture of two of the same variance. Its correlation is 0.58 over two thirds, 0.29 over one, 0
  /// over two. Number `which` of `count` independent ones.
  [[nodiscard]] double moving_normal(double t,
                                     std::uint64_t which = 0,
                                     std::uint64_t count = 1) const;

  /// `uniform2` of the indices from `first` on, the same bits in a fraction of the time: the first
  /// of each pair to `u`, the second to `v`, which are as long.
  void uniform2(std::uint64_t first, std::span<double> u, std::span<double> v) const;
  /// `normal2`, likewise.
  void normal2(std::uint64_t first, std::span<double> u, std::span<double> v) const;

 private:
  std::uint64_t seed_;
  StreamId stream_;
  std::uint32_t entity_;
};

}  // namespace pointflight
