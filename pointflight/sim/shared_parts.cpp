#include "pointflight/sim/shared_parts.hpp"

#include <utility>

namespace pointflight {

SharedParts::SharedParts(std::shared_ptr<const SurfelMap> map, std::string folder)
    : map_(std::move(map)), folder_(std::move(folder)) {}

std::shared_ptr<const Renderer> SharedParts::renderer(const Choice<RendererKind>& kind) {
  auto& made = renderers_[&*kind];
  if (!made) made = make_renderer(*kind, Scene{map_});
  return made;
}

const SharedParts::LidarModel& SharedParts::lidar(const std::string& model) {
  LidarModel& made = lidars_[model];
  if (made.beams) return made;
  made.settings = load_lidar(model, folder_);
  made.beams = std::make_shared<const ScanBeams>(made.settings);
  return made;
}

}  // namespace pointflight
