#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// A world of analytic shapes: what a map of it should answer is known exactly.
struct ExactScene {
  std::string name;                      ///< As `scene_names` has it, or the path.
  std::string about;                     ///< One line: what it is there to show.
  ShapeScene geometry;                   ///< World, m.
  std::vector<std::string> tags;         ///< Kinds of shapes: "wall", "rod", ...
  std::vector<std::uint16_t> shape_tag;  ///< Of each shape, an index in `tags`.
  /// Of each shape the number of the thing that it is a part of; empty: not known.
  std::vector<std::uint32_t> shape_object;
  /// Diffuse reflectivity of each shape, 0 to 1; empty: not known.
  std::vector<float> shape_reflectivity;
  /// Points of each shape relative to the rest of the cloud; empty: all 1.
  std::vector<float> shape_density;
  std::vector<bool> is_target;  ///< Of each shape: small scenes aim their beams at these.
  std::vector<Pose> poses;      ///< Where sensors stand; empty: random positions in `free`.
  Aabb free;                    ///< Sensors stand in it, at least 0.3 m from every shape.

  /// Adds a tag for the shapes from number `first` on. `density` and `target` as above.
  void tag_from(std::size_t first,
                const std::string& tag,
                float density = 1.0f,
                bool target = false);
};

/// A shipped scene by name, or one of your own from a file: `shape,tag,x0,...` as CSV, plain or xz
/// (docs/fidelity.md). Throws InputError that lists the names.
ExactScene load_scene(const std::string& name_or_path);

/// A scene from the text of such a file; `path` names it in messages. Throws InputError.
ExactScene parse_scene(std::string_view text, const std::string& path);

/// Names and one line each.
std::vector<std::pair<std::string, std::string>> scene_names();

/// A yard with a house, a staircase, a net, railings, glass and vegetation of several kinds.
ExactScene make_yard_scene();

/// The small exact cases by name; nothing for another name.
std::optional<ExactScene> make_small_scene(const std::string& name);
/// Names and one line each.
std::vector<std::pair<std::string, std::string>> small_scene_names();

/// How a scene is sampled to a cloud.
struct SceneSampling {
  double points_per_cell = 8.0;  ///< Points a square of `resolution`.
  double resolution = 0.05;      ///< m
  double density_min = 2000.0;   ///< At least so many a square metre.
  double noise = 0.0;            ///< Deviation along the surface normal, m.
  std::uint64_t seed = 1;        ///< Of where the points lie.
  /// Glass and water have points as well: of maps that know what they are (`Opacity`).
  bool with_mirrors = false;
  /// Of the points in a cube of the resolution only the first is kept, as maps are often thinned.
  bool one_per_cell = false;
};

/// Streams the points of a sampled scene, with the reflectivity in percent as intensity if it is
/// known; the scene must outlive it.
std::unique_ptr<CloudReader> sampled_cloud(const ExactScene& scene, const SceneSampling& sampling);

}  // namespace pointflight
