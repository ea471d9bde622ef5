#include "pointflight/scenes/made_world.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

const WorldKind& kind_of(const std::string& name) {
  const WorldKind* kind = WorldKind::table().find(name);
  if (kind == nullptr) throw_unknown(WorldKind::kWhat, name, WorldKind::table().names());
  return *kind;
}

std::string names_of(const std::vector<WorldParameter>& parameters) {
  std::string names;
  for (const WorldParameter& p : parameters) names += (names.empty() ? "" : ", ") + p.name;
  return names;
}

}  // namespace

WorldValues values_of(const WorldOptions& options) {
  const WorldKind& kind = kind_of(options.name);
  for (const auto& [name, value] : options.chosen) {
    const auto has_name = [&name = name](const WorldParameter& p) { return p.name == name; };
    const auto at = std::find_if(kind.parameters.begin(), kind.parameters.end(), has_name);
    if (at == kind.parameters.end()) {
      throw InputError(fmt::format("world {} has no parameter '{}'; one of: {}",
                                   kind.name,
                                   name,
                                   names_of(kind.parameters)));
    }
    if (!(at->low <= value && value <= at->high)) {
      throw InputError(fmt::format(
          "world {}: {} is {}; {} to {} will do", kind.name, name, value, at->low, at->high));
    }
  }
  // draws of their own, so that choosing one leaves the others as they are
  SceneBuilder draws(options.seed, 1);
  WorldValues values;
  for (const WorldParameter& p : kind.parameters) {
    const double drawn = p.is_whole ? draws.whole(static_cast<int>(p.low), static_cast<int>(p.high))
                                    : draws.between(p.low, p.high);
    const auto chosen = options.chosen.find(p.name);
    values.set(p.name, chosen == options.chosen.end() ? drawn : chosen->second);
  }
  return values;
}

ExactScene make_world(const WorldOptions& options) {
  const WorldKind& kind = kind_of(options.name);
  SceneBuilder builder(options.seed, 0);
  const Aabb free = kind.build(builder, values_of(options));
  Aabb built;
  for (const Shape& shape : builder.scene().geometry.shapes) {
    const Aabb box = bounds(shape);
    built.add(box.min);
    built.add(box.max);
  }
  ExactScene scene = builder.finish({free.min.cwiseMax(built.min), free.max.cwiseMin(built.max)});
  scene.name = kind.name;
  scene.about = kind.help;
  return scene;
}

const std::vector<SceneClass>& scene_classes() {
  // reflectivities at 905 nm: round numbers of the ECOSTRESS spectral library's order
  static const std::vector<SceneClass> all = {{"wall", 0.5, "wall"},
                                              {"floor", 0.35, "floor"},
                                              {"ceiling", 0.6, "ceiling"},
                                              {"ground", 0.25, "earth, ground"},
                                              {"road", 0.15, "road, route"},
                                              {"sidewalk", 0.3, "sidewalk, pavement"},
                                              {"roof", 0.3, "building"},
                                              {"column", 0.45, "column, pillar"},
                                              {"beam", 0.4, "ceiling"},
                                              {"arch", 0.45, "wall"},
                                              {"vault", 0.5, "ceiling"},
                                              {"stairs", 0.35, "stairs, steps"},
                                              {"balustrade", 0.45, "bannister"},
                                              {"railing", 0.3, "railing, rail"},
                                              {"window frame", 0.5, "windowpane, window"},
                                              {"glass", 0.1, "windowpane, window"},
                                              {"door", 0.4, "door"},
                                              {"pipe", 0.4, "pipe"},
                                              {"table", 0.4, "table"},
                                              {"desk", 0.4, "desk"},
                                              {"chair", 0.3, "chair"},
                                              {"swivel chair", 0.1, "swivel chair"},
                                              {"monitor", 0.05, "monitor"},
                                              {"shelf", 0.4, "shelf"},
                                              {"cabinet", 0.4, "cabinet"},
                                              {"sofa", 0.3, "sofa, couch"},
                                              {"bed", 0.5, "bed"},
                                              {"ladder", 0.4, "ladder"},
                                              {"tree", 0.45, "tree"},
                                              {"bush", 0.5, "plant"},
                                              {"log", 0.3, "trunk"},
                                              {"rock", 0.3, "rock, stone"},
                                              {"grass", 0.5, "grass"},
                                              {"car", 0.3, "car, auto"},
                                              {"truck", 0.4, "truck"},
                                              {"forklift", 0.3, "forklift"},
                                              {"person", 0.35, "person"},
                                              {"pallet", 0.4, "pallet"},
                                              {"box", 0.45, "box"},
                                              {"rack", 0.4, "rack"},
                                              {"scaffold", 0.4, "scaffolding"},
                                              {"pylon", 0.4, "pylon"},
                                              {"wire", 0.2, "wire"},
                                              {"streetlight", 0.35, "streetlight"},
                                              {"crane", 0.35, "crane"},
                                              {"girder", 0.35, "girder"},
                                              {"rebar", 0.2, "rod"},
                                              {"machine", 0.3, "machine"},
                                              {"container", 0.3, "container"},
                                              {"lamp", 0.6, "light"},
                                              {"sign", 0.8, "signboard, sign"},
                                              {"water", 0.02, "water"},
                                              {"bench", 0.4, "bench"},
                                              {"net", 0.3, "net"},
                                              {"cable", 0.3, "cable"},
                                              {"rail", 0.3, "rail"}};
  return all;
}

double reflectivity_of(const std::string& scene_class) {
  for (const SceneClass& known : scene_classes()) {
    if (known.name == scene_class) return known.reflectivity;
  }
  return 0.3;
}

}  // namespace pointflight
