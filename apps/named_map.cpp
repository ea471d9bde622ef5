#include "apps/named_map.hpp"

#include <filesystem>

#include "apps/terminal.hpp"

namespace pointflight::apps {

std::optional<WorldMapOptions> world_in(const std::string& name) {
  std::error_code ignored;
  if (std::filesystem::exists(name, ignored)) return std::nullopt;
  const auto world = world_named(name);
  if (!world) return std::nullopt;
  return WorldMapOptions{*world};
}

std::shared_ptr<const SurfelMap> open_named_map(const std::string& name) {
  const auto world = world_in(name);
  if (!world) return SurfelMap::open(name);
  auto map = open_world_map(*world, Executor(), interruptible_progress());
  end_progress();
  return map;
}

std::shared_ptr<const SurfelMap> open_map_of(const Scenario& scenario) {
  auto map = scenario.open_map(interruptible_progress());
  end_progress();
  return map;
}

}  // namespace pointflight::apps
