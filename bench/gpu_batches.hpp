// Scans for gpu_bench: patterns of LiDARs, and batches of them from anywhere in a map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/lidar/footprint.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/lidar/scan_beams.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Beams that all leave from one pose.
struct Pattern {
  std::string name;
  std::shared_ptr<const SensorBeams> beams;
  float range_max;
  std::shared_ptr<const ReturnModel> returns;  ///< Of wide beams; null: they are lines.
  std::shared_ptr<const Footprint> footprint;
};

/// "mid360", "mid360+wide" as it is shipped, "64x16".
inline Pattern pattern_of(const std::string& name) {
  const bool is_image = name == "64x16";
  const std::size_t plus = name.find('+');
  LidarSettings settings = load_lidar(is_image ? "marsim_grid" : name.substr(0, plus));
  if (is_image) {
    settings.grid.columns = 64;
    settings.grid.rows = 16;
    settings.range_max = 30.0;
  }
  const auto ordered = ScanBeams(settings).of(0, Executor());
  Pattern pattern{
      name, ordered->in_sensor, static_cast<float>(settings.range_max), nullptr, nullptr};
  if (plus == std::string::npos) return pattern;
  pattern.returns = std::make_shared<const ReturnModel>(settings, Surroundings{});
  pattern.footprint = std::make_shared<const Footprint>(settings.optics);
  pattern.range_max = static_cast<float>(pattern.returns->reach());
  return pattern;
}

/// As many scans from anywhere in the map, 2.5 to 7 m above its lowest point, tilted up to 11
/// degrees.
inline std::vector<AimedBeams> aims_of(const SurfelMap& map,
                                       const Pattern& pattern,
                                       std::size_t count,
                                       std::uint64_t set) {
  const RandomStream random(1, StreamId::kTest, 0);
  const Aabb& box = map.bounds_world();
  std::vector<AimedBeams> aims;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t at = set << 32 | 6 * i;
    const Pose pose{quaternion_from_rpy(random.uniform(at, -0.2, 0.2),
                                        random.uniform(at + 1, -0.2, 0.2),
                                        random.uniform(at + 2, -3.1, 3.1)),
                    {random.uniform(at + 3, box.min.x(), box.max.x()),
                     random.uniform(at + 4, box.min.y(), box.max.y()),
                     box.min.z() + random.uniform(at + 5, 2.5, 7.0)}};
    aims.push_back(aim_beams(pattern.beams, {&pose, 1}, pattern.range_max));
  }
  return aims;
}

/// Scans of a pattern as jobs, other poses each time.
class Batch {
 public:
  static constexpr std::uint64_t kSets = 3;

  Batch(const SurfelMap& map, const Pattern& pattern, std::size_t scans, bool wants_ranges) {
    const std::size_t beams = pattern.beams->beams.size();
    rays_ = scans * beams;
    const bool is_wide = pattern.returns != nullptr;
    if (is_wide) {
      echoes_.resize(rays_);
    } else if (wants_ranges) {
      ranges_.resize(rays_);
    } else {
      hits_.resize(rays_);
    }
    for (std::uint64_t set = 0; set < kSets; ++set) {
      aims_.push_back(aims_of(map, pattern, scans, set));
      jobs_.emplace_back(scans);
      for (std::size_t i = 0; i < scans; ++i) {
        RenderJob& job = jobs_.back()[i];
        job.batch.aimed = &aims_.back()[i];
        job.batch.order = pattern.beams->order;
        if (is_wide) {
          job.wide = pattern.footprint->beams(
              {}, *pattern.returns, std::span(echoes_).subspan(i * beams, beams));
        } else if (wants_ranges) {
          job.ranges = std::span(ranges_).subspan(i * beams, beams);
        } else {
          job.hits = std::span(hits_).subspan(i * beams, beams);
        }
      }
    }
  }
  [[nodiscard]] std::span<const RenderJob> next() { return jobs_[number_++ % kSets]; }
  [[nodiscard]] std::size_t rays() const { return rays_; }
  /// Of each ray, or of each beam's first echo.
  [[nodiscard]] std::vector<float> ranges() const {
    if (echoes_.empty()) return ranges_;
    std::vector<float> all;
    for (const Echoes& echoes : echoes_) {
      all.push_back(echoes.count > 0 ? echoes.all[0].range : -1.0f);
    }
    return all;
  }
  void start_again() { number_ = 0; }

 private:
  std::vector<std::vector<AimedBeams>> aims_;
  std::vector<std::vector<RenderJob>> jobs_;
  std::vector<float> ranges_;
  std::vector<Hit> hits_;
  std::vector<Echoes> echoes_;
  std::size_t rays_ = 0;
  std::size_t number_ = 0;
};

}  // namespace pointflight
