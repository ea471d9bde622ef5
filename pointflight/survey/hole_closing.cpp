#include "pointflight/survey/hole_closing.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/map/edit/internal/surfel_gathering.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/surfel_changes.hpp"
#include "pointflight/survey/surfel_evidence.hpp"
#include "pointflight/survey/survey_hits.hpp"

namespace pointflight {
namespace {

constexpr float kTile = 0.32f;      // r: deviations of a surfel that goes on to all sides
constexpr double kApart = 0.7;      // r: between tiles of planes that overlap
constexpr double kNeighbour = 1.6;  // r: between neighbours

/// Positions, found by what they are near to.
class NearPositions {
 public:
  explicit NearPositions(double radius) : radius_(radius), index_(radius) {}

  void add(const Vector3d& position) {
    index_.add(position, static_cast<std::uint32_t>(positions_.size()));
    positions_.push_back(position);
  }
  [[nodiscard]] const std::vector<Vector3d>& positions() const { return positions_; }

  /// Calls `visit(index)` for those within the radius.
  template <class Visit>
  void for_each_near(const Vector3d& position, const Visit& visit) const {
    index_.for_each_around(position, [&](std::uint32_t index) {
      if ((positions_[index] - position).squaredNorm() < radius_ * radius_) visit(index);
    });
  }
  [[nodiscard]] bool has_near(const Vector3d& position) const {
    bool any = false;
    for_each_near(position, [&](std::uint32_t) { any = true; });
    return any;
  }

 private:
  double radius_;
  std::vector<Vector3d> positions_;
  GridIndex<std::uint32_t> index_;
};

/// The surfel of a cell: flat, as wide as those of a surface that goes on to all sides.
Surfel tile_of(const HoleCell& cell) {
  Surfel surfel;
  const Vector3d& normal = cell.normal_world;
  surfel.axes.col(0) = normal.cast<float>();
  surfel.axes.col(1) = normal.unitOrthogonal().cast<float>();
  surfel.axes.col(2) = surfel.axes.col(0).cross(surfel.axes.col(1));
  surfel.s = {kPlanarThickness, kTile, kTile};
  return surfel;
}

/// The map with tiles in all cells.
EditedMap tiled(const SurfelMap& map,
                const std::vector<HoleCell>& cells,
                const EditOptions& options,
                const Executor& executor) {
  NearPositions taken(kApart * map.resolution());
  std::size_t count = cells.size();
  for_each_surfel(map.words(), [&](const LeafHeader&, std::size_t) { ++count; });
  SurfelGathering all(map.origin_world(), map.resolution(), count, options);
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    all.add_as_is(leaf, map.words()[word], marks_of(map, word));
  });
  for (const HoleCell& cell : cells) {
    const Aabb& box = map.bounds_world();
    const bool is_inside = (cell.center_world.array() >= box.min.array()).all() &&
                           (cell.center_world.array() <= box.max.array()).all();
    if (!is_inside || taken.has_near(cell.center_world)) continue;
    taken.add(cell.center_world);
    SurfelMarks marks = marks_of(map, cell.beside);
    marks.note.is_assumed = true;
    all.add(cell.center_world, tile_of(cell), marks);
  }
  return all.build(description_of(map), true, "the map", executor);
}

constexpr std::size_t kTilePassed = 0;
constexpr std::size_t kTileThrough = 1;

/// Which tiles stay.
class TileJudge {
 public:
  TileJudge(const SurfelMap& map, const ClosingOptions& closing)
      : map_(map),
        closing_(closing),
        near_(kNeighbour * map.resolution()),
        words_(map.words().size(), kNone),
        evidence_(map.words().size(), 2) {
    for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
      if (!map.is_assumed(static_cast<std::uint32_t>(word))) return;
      words_[word] = static_cast<std::uint32_t>(near_.positions().size());
      near_.add(map.center_world(leaf, map.words()[word]));
    });
  }

  /// From several threads.
  void follow(const SurveyRay& ray, const RayHits& way) {
    for (const SurfelHit& hit : way.hits) {
      if (words_[hit.word] == kNone || hit.weight <= 0) continue;
      const float behind = ray.range - hit.t;
      if (ray.is_return && behind < static_cast<float>(closing_.right)) continue;
      evidence_.add(hit.word, kTilePassed, hit.weight);
      const Vector3f normal = decode(map_.words()[hit.word]).axes.col(0);
      const float depth = behind * std::abs(normal.dot(ray.direction_world));
      if (depth > static_cast<float>(closing_.through)) {
        evidence_.add(hit.word, kTileThrough, hit.weight);
      }
    }
  }

  /// Words that go.
  [[nodiscard]] std::vector<bool> condemned(ClosingReport& report) const {
    const std::size_t count = near_.positions().size();
    std::vector<bool> goes(count, false);
    std::vector<double> way(count, 1e30);
    std::vector<std::uint32_t> open;
    for (std::size_t word = 0; word < words_.size(); ++word) {
      if (words_[word] == kNone) continue;
      if (evidence_.sum(word, kTilePassed) > 0.0) {
        goes[words_[word]] = true;
        ++report.passed;
      }
      if (evidence_.sum(word, kTileThrough) > 0.0) {
        way[words_[word]] = 0.0;
        open.push_back(words_[word]);
      }
    }
    for (std::size_t n = 0; n < open.size(); ++n) {
      const std::uint32_t from = open[n];
      near_.for_each_near(near_.positions()[from], [&](std::uint32_t to) {
        const double length = (near_.positions()[to] - near_.positions()[from]).norm();
        if (way[from] + length >= way[to] || way[from] + length > closing_.opening) return;
        way[to] = way[from] + length;
        open.push_back(to);
      });
    }
    std::vector<bool> words(words_.size(), false);
    for (std::size_t word = 0; word < words_.size(); ++word) {
      if (words_[word] == kNone) continue;
      const bool is_beside = way[words_[word]] < 1e30;
      if (is_beside && !goes[words_[word]]) ++report.opening;
      words[word] = is_beside || goes[words_[word]];
      if (!words[word]) ++report.assumed;
    }
    return words;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  const SurfelMap& map_;
  const ClosingOptions& closing_;
  NearPositions near_;
  std::vector<std::uint32_t> words_;  ///< Of each word, its number among the tiles.
  SurfelEvidence evidence_;
};

}  // namespace

EditedMap close_holes(const SurfelMap& map,
                      const SurveyOpener& survey,
                      const ClosingOptions& closing,
                      const EditOptions& options,
                      const Executor& executor,
                      ClosingReport& report,
                      const Progress& progress) {
  report = {};
  pointflight::report(progress, "looking for holes in planes", 0.0);
  const auto planes = find_large_planes(map, closing.planes, executor);
  report.planes = planes.size();
  const auto cells = find_hole_cells(map, planes, closing.holes, executor);
  report.cells = cells.size();
  std::shared_ptr<const SurfelMap> full;
  {
    const EditedMap made = tiled(map, cells, options, executor);
    full = SurfelMap::from_bytes(map_bytes(made.tree, made.description), "the map with its holes");
  }
  TileJudge judge(*full, closing);
  if (full->has_assumed()) {
    follow_survey(*full,
                  survey,
                  closing.right,
                  executor,
                  "looking through holes in planes",
                  progress,
                  [&](const SurveyRay& ray, const RayHits& way) { judge.follow(ray, way); });
  }
  const auto goes = judge.condemned(report);
  return changed(
      *full,
      [&](const LeafHeader&, std::size_t word) -> std::optional<SurfelWord> {
        if (goes[word]) return std::nullopt;
        return full->words()[word];
      },
      options,
      executor);
}

}  // namespace pointflight
