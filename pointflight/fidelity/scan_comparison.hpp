#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/fidelity/error_statistics.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// A real scan: returns in the sensor frame and the sensor's pose.
struct RealScan {
  std::string file;                     ///< Name without folder.
  Pose T_world_sensor;                  ///< At the scan's stamp: one pose for all of its points.
  std::vector<Vector3f> points_sensor;  ///< m
};

/// Reads the scans that a TUM file of poses (map <- sensor) names in its ninth column; without one,
/// the clouds of the folder in sorted order. Points that are not finite or nearer than 1 cm are
/// left out. Throws InputError.
std::vector<RealScan> read_real_scans(const std::string& folder, const std::string& poses);

/// Which places a cloud supports: those with 16 or more of its points within 25 cm.
class SupportCloud {
 public:
  /// Reads the whole cloud. Throws InputError.
  explicit SupportCloud(const std::string& path);
  ~SupportCloud();
  /// Callable from several threads.
  [[nodiscard]] bool supports(const Vector3d& point_world) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// One real return and what was rendered along its ray.
struct ComparedRay {
  float range = 0.0f;      ///< Measured, m.
  float rendered = -1.0f;  ///< m; negative where nothing was met.
  bool supported = false;  ///< By the cloud that was given: `SupportCloud`.
};

/// Renders the ray of each real return from the scan's pose; one result a point, in their order.
/// Without a cloud no ray is supported.
std::vector<ComparedRay> compare_scan(const RealScan& scan,
                                      const Renderer& renderer,
                                      const SupportCloud* cloud,
                                      const Executor& executor);

/// Real scans beside each other: how well a ray's range is known from the other scans.
class ScanPlanes {
 public:
  /// Refers to `scans`, which must outlive it.
  explicit ScanPlanes(const std::vector<RealScan>& scans);
  ~ScanPlanes();

  /// The rays of one scan against the planes that the other scans' points within 25 cm of the
  /// return make (16 points or more, flat to a tenth of their extent): right, early or late as in
  /// ErrorStatistics. Rays without such a plane are left out.
  [[nodiscard]] ErrorCollector compare(std::size_t scan, const Executor& executor) const;

 private:
  struct Tree;
  const std::vector<RealScan>& scans_;
  std::unique_ptr<Tree> tree_;
};

/// All rays, or only the supported ones.
ErrorCollector collect(const std::vector<ComparedRay>& rays, bool supported_only);

}  // namespace pointflight
