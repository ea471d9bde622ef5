#include "pointflight/scenes/world_map.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "pointflight/scenes/scene_class.hpp"
#include "pointflight/scenes/surface_notes.hpp"

namespace pointflight {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const WorldMapOptions& options) {
  Json json{{"world", options.world.name},
            {"seed", options.world.seed},
            {"set", Json::object()},
            {"resolution", options.resolution}};
  for (const auto& [name, value] : options.world.chosen) json["set"][name] = value;
  return json;
}

Json json_of(const Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

/// A thing: the shapes of one number.
struct Thing {
  std::uint8_t kind = 0;  ///< Of its first shape.
  float reflectivity = 0.0f;
  Aabb box;
};

std::map<std::uint32_t, Thing> things_of(const ExactScene& scene) {
  std::map<std::uint32_t, Thing> things;
  for (std::size_t i = 0; i < scene.geometry.shapes.size(); ++i) {
    Thing& thing = things[scene.shape_object[i]];
    if (thing.box.empty()) {
      thing.kind = class_number(scene.tags[scene.shape_tag[i]]);
      thing.reflectivity = scene.shape_reflectivity[i];
    }
    const Aabb box = bounds(scene.geometry.shapes[i]);
    thing.box.add(box.min);
    thing.box.add(box.max);
  }
  return things;
}

}  // namespace

std::string name_of(const WorldMapOptions& options) {
  std::string name = fmt::format("{}:{}", options.world.name, options.world.seed);
  for (const auto& [parameter, value] : options.world.chosen) {
    name += fmt::format(" {}={}", parameter, value);
  }
  return fmt::format("{} at {} m", name, options.resolution);
}

ImportedMap make_world_map(const WorldMapOptions& options,
                           const Executor& executor,
                           const Progress& progress) {
  const ExactScene scene = make_world(options.world);
  SceneSampling sampling;
  sampling.points_per_cell = 6.0;
  sampling.resolution = options.resolution;
  sampling.density_min = 0.0;
  sampling.seed = options.world.seed;
  sampling.with_mirrors = true;
  ImportOptions import;
  import.resolution = options.resolution;
  import.outliers.enabled = false;  // there are none
  ImportedMap made = build_map(
      {fmt::format("world {}, seed {}", options.world.name, options.world.seed)},
      [&](std::size_t) { return sampled_cloud(scene, sampling); },
      import,
      executor,
      progress);
  set_reflectivity(made.description, 0.01);  // percent
  note_surfaces(scene, made.tree, made.description, executor, progress);
  set_world(made.description, options);
  return made;
}

std::shared_ptr<const SurfelMap> open_world_map(const WorldMapOptions& options,
                                                const Executor& executor,
                                                const Progress& progress) {
  const ImportedMap made = make_world_map(options, executor, progress);
  return SurfelMap::from_bytes(map_bytes(made.tree, made.description), name_of(options));
}

void set_world(MapDescription& description, const WorldMapOptions& options) {
  auto metadata = Json::parse(description.metadata, nullptr, false);
  if (!metadata.is_object()) metadata = Json::object();
  metadata["world"] = json_of(options);
  description.metadata = metadata.dump();
}

std::optional<WorldMapOptions> world_of(const SurfelMap& map) {
  const auto metadata = Json::parse(map.metadata(), nullptr, false);
  if (!metadata.is_object() || !metadata.contains("world")) return std::nullopt;
  try {
    const Json& json = metadata["world"];
    WorldMapOptions options;
    json.at("world").get_to(options.world.name);
    json.at("seed").get_to(options.world.seed);
    json.at("resolution").get_to(options.resolution);
    for (const auto& [name, value] : json.at("set").items()) {
      options.world.chosen[name] = value.get<double>();
    }
    return options;
  } catch (const Json::exception&) {
    return std::nullopt;  // whatever it is, it is not ours
  }
}

std::string world_truth(const WorldMapOptions& options, const ExactScene& scene) {
  Json json = json_of(options);
  json["parameters"] = values_of(options.world).all();
  json["classes"] = Json::array();
  const auto classes = scene_classes();
  for (std::size_t i = 0; i < classes.size(); ++i) {
    json["classes"].push_back(
        {{"number", i + 1}, {"name", std::string(classes[i].name)}, {"ade20k", classes[i].ade20k}});
  }
  json["things"] = Json::array();
  for (const auto& [number, thing] : things_of(scene)) {
    json["things"].push_back({{"number", number},
                              {"class", thing.kind},
                              {"reflectivity", thing.reflectivity},
                              {"min", json_of(thing.box.min)},
                              {"max", json_of(thing.box.max)}});
  }
  // a line for each class and thing
  std::string text = "{\n";
  for (const auto& [key, value] : json.items()) {
    if (text.size() > 2) text += ",\n";
    text += fmt::format("  \"{}\": ", key);
    if (!value.is_array()) {
      text += value.dump();
      continue;
    }
    text += "[";
    for (std::size_t i = 0; i < value.size(); ++i) {
      text += fmt::format("{}\n    {}", i == 0 ? "" : ",", value[i].dump());
    }
    text += "\n  ]";
  }
  return text + "\n}\n";
}

}  // namespace pointflight
