// Worlds that are made up: exact scenes of places as the field flies in, as many of each as there
// are seeds.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/registry.hpp"
#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight {

/// What differs between worlds of a kind: drawn from a range unless it is chosen.
struct WorldParameter {
  std::string name;       ///< For `--set`.
  std::string help;       ///< Half a sentence, with the unit.
  double low;             ///< Of the range.
  double high;            ///< Of the range; it may be drawn.
  bool is_whole = false;  ///< A whole number is drawn.
};

/// What was drawn or chosen, by name.
class WorldValues {
 public:
  /// One of them.
  void set(const std::string& name, double value) { values_[name] = value; }
  /// Throws std::out_of_range for names that the kind does not have.
  [[nodiscard]] double operator[](const std::string& name) const { return values_.at(name); }
  /// The same of a whole number.
  [[nodiscard]] int count(const std::string& name) const {
    return static_cast<int>(std::lround(values_.at(name)));
  }
  /// All of them.
  [[nodiscard]] const std::map<std::string, double>& all() const { return values_; }

 private:
  std::map<std::string, double> values_;
};

/// Where an eye is and what it looks at, m.
struct WorldView {
  Vector3d from;  ///< The eye.
  Vector3d to;    ///< What is in the middle of the picture.
};

/// A row of the table of worlds. To add one: a file in scenes/worlds with a function that returns
/// its row, and a line in `WorldKind::table`.
struct WorldKind {
  static constexpr const char* kWhat = "world";  ///< In messages.
  /// All kinds; programs may add their own.
  static Registry<WorldKind>& table();

  std::string name;                        ///< In scenarios and commands.
  std::string help;                        ///< Half a sentence.
  Vector3d size;                           ///< About, m.
  std::vector<WorldParameter> parameters;  ///< What differs, beside what the seed draws.
  /// Puts it together; returns where sensors may stand.
  std::function<Aabb(SceneBuilder& to, const WorldValues& values)> build;
  WorldView view;  ///< From inside, for pictures.
};

/// Which world.
struct WorldOptions {
  std::string name;                      ///< Of a row.
  std::uint64_t seed = 1;                ///< Of everything that differs.
  std::map<std::string, double> chosen;  ///< Parameters that are not drawn.
};

/// What "street" or "street:7" (a seed) names; nothing if it names no kind of world. Throws
/// InputError if what is behind the colon is no seed.
std::optional<WorldOptions> world_named(const std::string& name);

/// What the options come to. Throws InputError for names that are not known and values out of
/// range.
WorldValues values_of(const WorldOptions& options);
/// The scene; `name` is the world's. Throws InputError as above.
ExactScene make_world(const WorldOptions& options);

}  // namespace pointflight
