#pragma once

#include <map>
#include <memory>
#include <string>

#include "pointflight/core/registry.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/scan_beams.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// What the vehicles of a run share: the map, one renderer of each kind, one sensor file and its
/// beams for all that carry the sensor. Used from one thread, while a run is set up.
class SharedParts {
 public:
  /// A LiDAR of a sensor file.
  struct LidarModel {
    LidarSettings settings;                  ///< Of the file.
    std::shared_ptr<const ScanBeams> beams;  ///< Of its scans.
  };

  /// `folder`: what relative paths of sensor files are taken from.
  SharedParts(std::shared_ptr<const SurfelMap> map, std::string folder);

  /// Lives as long as the run.
  [[nodiscard]] const SurfelMap& map() const { return *map_; }
  /// Of a kind. May throw InputError.
  std::shared_ptr<const Renderer> renderer(const Choice<RendererKind>& kind);
  /// Of a name or path. Throws InputError.
  const LidarModel& lidar(const std::string& model);

 private:
  std::shared_ptr<const SurfelMap> map_;
  std::string folder_;
  std::map<const RendererKind*, std::shared_ptr<const Renderer>> renderers_;
  std::map<std::string, LidarModel> lidars_;
};

}  // namespace pointflight
