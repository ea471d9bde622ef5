#include "pointflight/scenes/exact_scene.hpp"

#include <fmt/format.h>
#include <lzma.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <unordered_set>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/scenes/made_world.hpp"
#include "pointflight/scenes/scene_class.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLargestScene = 1u << 30;  // bytes, unpacked

std::string unpack_xz(const std::string& packed, const std::string& path) {
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, kLargestScene, 0) != LZMA_OK) {
    throw InputError(fmt::format("{}: no memory to unpack", path));
  }
  std::string text;
  std::array<char, 65536> part{};
  stream.next_in = reinterpret_cast<const std::uint8_t*>(packed.data());
  stream.avail_in = packed.size();
  lzma_ret result = LZMA_OK;
  while (result == LZMA_OK && text.size() < kLargestScene) {
    stream.next_out = reinterpret_cast<std::uint8_t*>(part.data());
    stream.avail_out = part.size();
    result = lzma_code(&stream, LZMA_FINISH);
    text.append(part.data(), part.size() - stream.avail_out);
  }
  lzma_end(&stream);
  if (result != LZMA_STREAM_END) {
    throw InputError(fmt::format("{}: damaged or cut off xz data", path));
  }
  return text;
}

std::string text_of(const std::string& path) {
  require_regular_file(path);
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.good() && !file.eof()) throw InputError(fmt::format("{}: cannot be read", path));
  return path.ends_with(".xz") ? unpack_xz(text, path) : text;
}

/// A row of a scene file: shape, tag and up to eleven numbers, absent ones 0.
struct Row {
  std::string_view shape;
  std::string tag;
  std::array<double, 11> v{};

  [[nodiscard]] Vector3d point(std::size_t at) const { return {v[at], v[at + 1], v[at + 2]}; }
};

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

Row row_of(std::string_view line, const std::string& location) {
  const auto fields = fields_of(line);
  Row row;
  if (fields.size() < 3 || fields.size() > 2 + row.v.size()) {
    throw InputError(
        fmt::format("{}: {} columns; it takes shape,tag,x0,y0,z0,x1,y1,z1,x2,y2,z2,r0,r1",
                    location,
                    fields.size()));
  }
  row.shape = fields[0];
  row.tag = fields[1];
  for (std::size_t i = 2; i < fields.size(); ++i) {
    if (fields[i].empty()) continue;
    if (!parse_number(fields[i], row.v[i - 2]) || !(std::abs(row.v[i - 2]) < 1e9)) {
      throw InputError(fmt::format("{}: '{}' is not a number", location, excerpt(fields[i])));
    }
  }
  return row;
}

Shape shape_of(const Row& row, const std::string& location) {
  if (row.shape == "triangle") return Triangle{row.point(0), row.point(3), row.point(6)};
  if (row.shape == "cone") {
    if (row.v[9] < 0.0 || row.v[10] < 0.0 || row.v[9] + row.v[10] <= 0.0 ||
        (row.point(3) - row.point(0)).norm() < 1e-6) {
      throw InputError(
          fmt::format("{}: a cone needs an axis and a radius r0 or r1 above 0", location));
    }
    return Cone{row.point(0), row.point(3), row.v[9], row.v[10]};
  }
  if (row.shape == "disc") {
    if (row.v[9] <= 0.0 || row.point(3).norm() < 1e-6) {
      throw InputError(
          fmt::format("{}: a disc needs a normal x1,y1,z1 and a radius r0 above 0", location));
    }
    return Disc{row.point(0), row.point(3).normalized(), row.v[9]};
  }
  throw InputError(fmt::format(
      "{}: '{}' is no shape; known: triangle, cone, disc", location, excerpt(row.shape)));
}

void read_shapes(std::string_view text, const std::string& path, ExactScene& scene) {
  LineCursor lines(text);
  for (std::string_view line; lines.next(line);) {
    if (line.empty() || line.starts_with('#') || line.starts_with("shape,")) continue;
    const std::string location = fmt::format("{}: line {}", path, lines.number());
    const Row row = row_of(line, location);
    const std::size_t first = scene.geometry.shapes.size();
    scene.geometry.shapes.push_back(shape_of(row, location));
    scene.tag_from(first, row.tag);
  }
  if (scene.geometry.shapes.empty()) throw InputError(fmt::format("{}: no shapes", path));
}

/// Rows of x, y, z (m), yaw (rad) after a head line.
void read_poses(const std::string& path, ExactScene& scene) {
  const std::string text = text_of(path);
  LineCursor lines(text);
  for (std::string_view line; lines.next(line);) {
    if (lines.number() == 1 || line.empty()) continue;
    const auto fields = fields_of(line);
    std::array<double, 4> v{};
    bool good = fields.size() == v.size();
    for (std::size_t i = 0; good && i < v.size(); ++i) good = parse_number(fields[i], v[i]);
    if (!good) throw InputError(fmt::format("{}: line {}: not x,y,z,yaw", path, lines.number()));
    scene.poses.push_back({quaternion_from_rpy(0, 0, v[3]), {v[0], v[1], v[2]}});
  }
}

/// The forest's ground: z(x, y) as triangles on a 0.2 m grid, each square split along the diagonal
/// from its low corner to its high corner.
void add_relief(ExactScene& scene) {
  constexpr double kStep = 0.2;
  constexpr int kColumns = 240;
  constexpr int kRows = 135;
  const auto corner = [](int i, int j) {
    const double x = i * kStep;
    const double y = j * kStep;
    return Vector3d(x,
                    y,
                    1.0 + 0.8 * math::sin(0.21 * x) * math::cos(0.17 * y) +
                        0.15 * math::sin(1.1 * x + 0.7 * y) + 0.05 * math::sin(3.1 * x - 2.3 * y));
  };
  const std::size_t first = scene.geometry.shapes.size();
  for (int i = 0; i < kColumns; ++i) {
    for (int j = 0; j < kRows; ++j) {
      const Vector3d low = corner(i, j);
      const Vector3d high = corner(i + 1, j + 1);
      scene.geometry.shapes.emplace_back(Triangle{low, corner(i + 1, j), high});
      scene.geometry.shapes.emplace_back(Triangle{low, high, corner(i, j + 1)});
    }
  }
  scene.tag_from(first, "ground");
}

ExactScene shipped(const std::string& name) {
  ExactScene scene;
  scene.name = name;
  const std::string path = data_folder() + "/scenes/" + name + ".csv.xz";
  read_shapes(text_of(path), path, scene);
  read_poses(data_folder() + "/scenes/" + name + "_poses.csv", scene);
  if (name == "forest") add_relief(scene);
  return scene;
}

/// Draws shape after shape, a batch at a time.
class SampledCloud : public CloudReader {
 public:
  SampledCloud(const ExactScene& scene, const SceneSampling& sampling)
      : scene_(scene), sampling_(sampling) {
    const double density =
        std::max(sampling.density_min,
                 sampling.points_per_cell / (sampling.resolution * sampling.resolution));
    double owed = 0.0;  // carried over, so that many small shapes get their share
    for (std::size_t i = 0; i < scene.geometry.shapes.size(); ++i) {
      // without their notes panes and water would be opaque, which they are not (SceneTree)
      const bool is_mirror = opacity_of_class(scene.tags[scene.shape_tag[i]]) != Opacity::kOpaque;
      const double thin = is_mirror && !sampling.with_mirrors ? 0.0
                          : scene.shape_density.empty()
                              ? 1.0
                              : static_cast<double>(scene.shape_density[i]);
      owed += area(scene.geometry.shapes[i]) * density * thin;
      const auto count = static_cast<std::uint64_t>(owed);
      owed -= static_cast<double>(count);
      counts_.push_back(count);
      total_ += count;
    }
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.size() < kBatch && shape_ < counts_.size()) {
      const std::uint64_t count =
          std::min<std::uint64_t>(kBatch - batch.size(), counts_[shape_] - done_);
      const float intensity = has_intensity() ? 100.0f * scene_.shape_reflectivity[shape_] : 0.0f;
      sample_shape(scene_.geometry.shapes[shape_],
                   static_cast<std::uint32_t>(shape_),
                   done_,
                   count,
                   sampling_.noise,
                   sampling_.seed,
                   [&](const Vector3d& p) {
                     if (!sampling_.one_per_cell || is_first_in_cell(p)) {
                       batch.push_back({p, intensity});
                     }
                   });
      done_ += count;
      read_ += count;
      if (done_ == counts_[shape_]) {
        ++shape_;
        done_ = 0;
      }
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return !scene_.shape_reflectivity.empty(); }
  [[nodiscard]] double share_read() const override {
    return total_ == 0 ? 1.0 : static_cast<double>(read_) / static_cast<double>(total_);
  }

 private:
  /// The grid that thins the cloud is not the one of the map.
  bool is_first_in_cell(const Vector3d& p) {
    constexpr double kPhase = 0.19;
    std::array<std::uint32_t, 3> cell{};
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t at = floor_to_integer(p[axis] / sampling_.resolution + kPhase);
      cell[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(at + (1 << 20));
    }
    return occupied_.insert(morton_encode(cell[0], cell[1], cell[2])).second;
  }

  const ExactScene& scene_;
  SceneSampling sampling_;
  std::unordered_set<std::uint64_t> occupied_;
  std::vector<std::uint64_t> counts_;  ///< Points of each shape.
  std::uint64_t total_ = 0;
  std::uint64_t read_ = 0;
  std::size_t shape_ = 0;
  std::uint64_t done_ = 0;  ///< Of the present shape.
};

}  // namespace

void ExactScene::tag_from(std::size_t first, const std::string& tag, float density, bool target) {
  auto at = std::find(tags.begin(), tags.end(), tag);
  if (at == tags.end()) at = tags.insert(tags.end(), tag);
  const auto index = static_cast<std::uint16_t>(at - tags.begin());
  const std::size_t count = geometry.shapes.size();
  shape_tag.resize(first);
  shape_tag.resize(count, index);
  shape_density.resize(first, 1.0f);
  shape_density.resize(count, density);
  is_target.resize(first, false);
  is_target.resize(count, target);
}

std::vector<std::pair<std::string, std::string>> scene_names() {
  std::vector<std::pair<std::string, std::string>> names = {
      {"hall", "45 x 20 x 8 m: pillars, tables, pipes, 2 cm rods, 5 cm partitions, a ladder"},
      {"forest", "48 x 27 x 19 m: relief, 160 trees with branches, 56,000 leaves"},
      {"yard", "30 x 20 x 8 m: trees, hedge, grass, net, railings, glass, shelves, a staircase"}};
  const auto small = small_scene_names();
  names.insert(names.end(), small.begin(), small.end());
  return names;
}

ExactScene load_scene(const std::string& name_or_path) {
  if (name_or_path == "hall" || name_or_path == "forest") return shipped(name_or_path);
  if (name_or_path == "yard") return make_yard_scene();
  if (auto small = make_small_scene(name_or_path)) return std::move(*small);
  if (const auto world = world_named(name_or_path)) return make_world(*world);
  std::error_code ignored;
  if (!fs::is_regular_file(name_or_path, ignored)) {
    std::string known;
    for (const auto& [name, about] : scene_names()) known += (known.empty() ? "" : ", ") + name;
    for (const WorldKind& world : WorldKind::table().rows()) known += ", " + world.name;
    throw InputError(
        fmt::format("'{}' is neither a file nor a scene; known: {}", name_or_path, known));
  }
  return parse_scene(text_of(name_or_path), name_or_path);
}

ExactScene parse_scene(std::string_view text, const std::string& path) {
  ExactScene scene;
  scene.name = fs::path(path).stem().string();
  read_shapes(text, path, scene);
  for (const Shape& shape : scene.geometry.shapes) {
    const Aabb box = bounds(shape);
    scene.free.add(box.min);
    scene.free.add(box.max);
  }
  return scene;
}

std::unique_ptr<CloudReader> sampled_cloud(const ExactScene& scene, const SceneSampling& sampling) {
  return std::make_unique<SampledCloud>(scene, sampling);
}

}  // namespace pointflight
