#include "pointflight/scenes/made_world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

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

std::optional<WorldOptions> world_named(const std::string& name) {
  const std::size_t colon = name.find(':');
  WorldOptions options{name.substr(0, colon), 1, {}};
  if (WorldKind::table().find(options.name) == nullptr) return std::nullopt;
  if (colon == std::string::npos) return options;
  const char* end = name.data() + name.size();
  const auto read = std::from_chars(name.data() + colon + 1, end, options.seed);
  if (read.ec != std::errc() || read.ptr != end) {
    throw InputError(fmt::format("'{}': a seed is a whole number, as in {}:7", name, options.name));
  }
  return options;
}

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

}  // namespace pointflight
