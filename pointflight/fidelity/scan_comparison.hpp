#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/error_statistics.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/survey/supported_cells.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// A real scan.
struct RealScan {
  std::string name;             ///< Its file's, or its number.
  Pose T_world_sensor;          ///< At the scan's stamp.
  std::vector<SurveyRay> rays;  ///< Its returns, each with the sensor's position at its own time.

  /// A return as seen from the scan's pose, m.
  [[nodiscard]] Vector3f point_sensor(std::size_t i) const {
    return (T_world_sensor.inverse() * rays[i].point_world()).cast<float>();
  }
};

/// All scans of a survey. Throws InputError.
std::vector<RealScan> read_real_scans(const SurveySource& survey, const Progress& progress = {});

/// One real return and what was rendered along its ray.
struct ComparedRay {
  float range = 0.0f;      ///< Measured, m.
  float rendered = -1.0f;  ///< m; negative if nothing was hit.
  bool supported = false;  ///< By the cloud that was given: `Support`.
  bool assumed = false;    ///< Rendered on a surfel that no survey saw.
};

/// Renders the ray of each real return in `map`, which the renderer is of; one result a return, in
/// their order. Without a cloud no ray is supported.
std::vector<ComparedRay> compare_scan(const RealScan& scan,
                                      const Renderer& renderer,
                                      const SurfelMap& map,
                                      const SupportedCells* cloud,
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

/// Those of the rays that `counts` accepts.
ErrorCollector collect(const std::vector<ComparedRay>& rays,
                       const std::function<bool(const ComparedRay&)>& counts);

}  // namespace pointflight
