// A beam as wide as the sensor's is: sub-rays over its cross-section, and what they hit.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/lidar/echoes.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// The beams of a scan in the world.
struct WideBeams {
  const RayBatch& middles;  ///< Their axes; times, bodies and order as for a renderer.
  /// Of each, the horizontal of the sensor across the beam: unit vectors in the world.
  std::span<const Vector3f> across;
};

/// A beam's cross-section: an elliptical Gaussian, truncated where its density falls to 1 / e^2 of
/// the centre's (2 sigma; sigma = full angle at half maximum / 2.3548), which optics calls the
/// beam's radius.
///
/// Eight sub-rays tell whether a beam hits one surface: its middle and a heptagon around its rim.
/// Where they do, they are the beam. Where they do not (ranges off a plane by more than 0.2 m, some
/// hit nothing, or the renderer knows of a surface between them that is nearer) and what is
/// reported hangs on the shares of light, 32 sub-rays spread over the cross-section are taken
/// instead; then 96 and 288, while it hangs on an echo that at most eight of them hit. Each beam's
/// are turned by an angle of its own, so that errors of neighbours differ. With `optics.sub_rays`
/// from 2 to 8 the eight are all; above it there are so many, spread, for every beam.
class Footprint {
 public:
  /// Of a sensor without divergence beams are lines.
  explicit Footprint(const OpticsSettings& optics);

  /// True if beams are lines.
  [[nodiscard]] bool is_line() const { return sub_rays_ == 1; }
  /// Finds the echoes of each beam; by `returns` surfaces give back light, and echoes count.
  void trace(const WideBeams& beams,
             const Renderer& renderer,
             const ReturnModel& returns,
             std::span<Echoes> echoes,
             const Executor& executor) const;

 private:
  /// A sub-ray: its position across the beam in sigmas, and its share of the light.
  struct SubRay {
    float x, y, share;
  };
  friend class FootprintRounds;

  [[nodiscard]] static std::vector<SubRay> rim();
  [[nodiscard]] static std::vector<SubRay> spread(std::size_t count);
  void aim(const WideBeams& beams,
           std::size_t beam,
           std::span<const SubRay> sub_rays,
           std::span<Ray> rays) const;
  [[nodiscard]] bool judge(std::size_t level,
                           std::span<BeamPart> parts,
                           float known,
                           float range_max,
                           const ReturnModel& returns,
                           Echoes& echoes) const;
  std::int64_t sub_rays_;
  float sigma_across_, sigma_up_;               ///< rad
  float merge_;                                 ///< m, of `echoes_of`.
  std::vector<std::vector<SubRay>> levels_;     ///< The next if one is not enough.
  std::array<std::array<float, 2>, 64> turns_;  ///< Cosine and sine.
};

/// The echoes of one scan's beams, found round by round: each round asks for the sub-rays of some
/// beams, at most `kRaysAtOnce`; first few for all beams, then more for those that need them.
class FootprintRounds {
 public:
  /// All must outlive it; `echoes`: of each beam, as they are found.
  FootprintRounds(const Footprint& footprint,
                  const WideBeams& beams,
                  const ReturnModel& returns,
                  std::span<Echoes> echoes);

  /// The sub-rays of the next round, valid until `receive`; nothing: all echoes are found.
  [[nodiscard]] std::optional<RenderJob> next(const Executor& executor);
  /// The hits of the round are there.
  void receive(const Executor& executor);

 private:
  const Footprint& footprint_;
  WideBeams beams_;
  const ReturnModel& returns_;
  std::span<Echoes> echoes_;
  bool has_begun_ = false;
  std::size_t level_ = 0;
  std::vector<std::uint32_t> wanted_;   ///< Beams of this level.
  std::size_t done_ = 0;                ///< Of `wanted_`.
  std::vector<std::uint32_t> more_;     ///< Beams of the next level.
  std::span<const std::uint32_t> now_;  ///< Beams of this round.
  std::vector<Ray> rays_;
  std::vector<Duration> offsets_;
  std::vector<Hit> hits_;
  std::vector<float> nearest_;
};

}  // namespace pointflight
