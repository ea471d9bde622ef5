#include "pointflight/survey/cloud_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pointflight/core/hash.hpp"
#include "pointflight/map/import/import_check.hpp"
#include "pointflight/map/import/spacing.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/render/ray_casting.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/survey/left_out_points.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMostPlaces = 4;
constexpr double kPlaceRadius = 30.0;  // m: what rays reach
constexpr std::size_t kFewestJudges = 2000;
constexpr double kRight = 0.1;    // m
constexpr double kSlack = 0.003;  // of the rays

using PointSink = std::function<void(const Vector3d& position_world)>;

void for_each_point(const std::vector<CloudSource>& clouds,
                    const ImportOptions& options,
                    const Progress& progress,
                    const PointSink& sink) {
  std::vector<CloudPoint> batch;
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    const auto reader = clouds[i].open({}, progress);
    while (reader->read(batch)) {
      for (const CloudPoint& point : batch) {
        const Vector3d p = world_position(point.position, options);
        if (p.allFinite()) sink(p);
      }
      report(progress,
             "looking at the points",
             (static_cast<double>(i) + reader->share_read()) / static_cast<double>(clouds.size()));
    }
  }
}

/// Points kept by chance, so that there are never more than `most`.
class ThinnedPoints {
 public:
  explicit ThinnedPoints(std::size_t most) : most_(most) {}
  void add(const Vector3d& point) {
    if (!is_kept(seen_++)) return;
    points_.push_back(point);
    numbers_.push_back(seen_ - 1);
    while (points_.size() > most_) thin();
  }
  [[nodiscard]] std::vector<Vector3d>& points() { return points_; }
  /// Of how many points one is kept.
  [[nodiscard]] std::uint64_t one_in() const { return one_in_; }

 private:
  [[nodiscard]] bool is_kept(std::uint64_t number) const {
    return scatter64(number) % one_in_ == 0;  // a power of two: kept ones are only ever given up
  }
  void thin() {
    one_in_ *= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!is_kept(numbers_[i])) continue;
      points_[kept] = points_[i];
      numbers_[kept++] = numbers_[i];
    }
    points_.resize(kept);
    numbers_.resize(kept);
  }

  std::size_t most_;
  std::vector<Vector3d> points_;
  std::vector<std::uint64_t> numbers_;
  std::uint64_t seen_ = 0;
  std::uint64_t one_in_ = 1;
};

/// An upright cylinder.
struct Place {
  Vector3d middle;
  double radius;

  [[nodiscard]] double distance(const Vector3d& point) const {
    return (point - middle).head<2>().norm();
  }
  [[nodiscard]] bool has(const Vector3d& point) const { return distance(point) < radius; }
};

/// Places around some of the points, of which one in so many is here, that hold no more than `most`
/// together.
std::vector<Place> places_in(const std::vector<Vector3d>& points,
                             std::uint64_t one_in,
                             std::size_t most) {
  constexpr std::uint64_t kTries = 32;
  const std::size_t share = most / kMostPlaces / static_cast<std::size_t>(one_in);
  std::vector<Place> places;
  for (std::uint64_t i = 0; i < kTries && places.size() < kMostPlaces; ++i) {
    Place place{points[scatter64(i + 1) % points.size()], kPlaceRadius};
    std::vector<double> distances;
    distances.reserve(points.size());
    for (const Vector3d& point : points) distances.push_back(place.distance(point));
    if (share < distances.size()) {
      const auto last = distances.begin() + static_cast<std::ptrdiff_t>(share);
      std::nth_element(distances.begin(), last, distances.end());
      place.radius = std::min(place.radius, *last);
    }
    const bool is_apart = std::ranges::all_of(places, [&](const Place& other) {
      return place.distance(other.middle) > place.radius + other.radius;
    });
    if (is_apart) places.push_back(place);
  }
  return places;
}

/// The points that are tried: all, or those of some places.
std::vector<Vector3d> points_to_try(const std::vector<CloudSource>& clouds,
                                    const ImportOptions& options,
                                    std::size_t most,
                                    const Progress& progress) {
  ThinnedPoints thinned(most);
  for_each_point(clouds, options, progress, [&](const Vector3d& point) { thinned.add(point); });
  if (thinned.one_in() == 1) return std::move(thinned.points());
  const std::vector<Place> places = places_in(thinned.points(), thinned.one_in(), most);
  thinned.points() = {};
  std::vector<Vector3d> points;
  for_each_point(clouds, options, progress, [&](const Vector3d& point) {
    const auto has = [&](const Place& place) { return place.has(point); };
    if (std::ranges::any_of(places, has)) points.push_back(point);
  });
  return points;
}

/// Those that are not left out.
class RemainingPoints : public CloudReader {
 public:
  explicit RemainingPoints(const std::vector<Vector3d>& points) : points_(points) {}

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    for (; next_ < points_.size() && batch.size() < kBatch; ++next_) {
      if (!is_left_out(next_)) batch.push_back({.position = points_[next_]});
    }
    return !batch.empty();
  }
  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(next_) / static_cast<double>(points_.size());
  }

 private:
  const std::vector<Vector3d>& points_;
  std::size_t next_ = 0;
};

/// Rays that judge, of points to try.
std::vector<LeftOutRay> judges_of(const std::vector<Vector3d>& points, const Executor& executor) {
  SpacingEstimate estimate;
  RemainingPoints reader(points);
  std::vector<CloudPoint> batch;
  while (reader.read(batch)) estimate.add(batch, executor);
  const double spacing = estimate.median_spacing();
  if (!(spacing > 0.0)) return {};
  // single precision holds millimetres around the middle
  const Vector3d origin = estimate.middle();
  std::vector<Vector3f> near;
  near.reserve(points.size());
  for (const Vector3d& point : points) near.push_back((point - origin).cast<float>());
  return rays_to_left_out(near, origin, spacing, executor);
}

double share_right(const ImportedMap& imported,
                   std::span<const Ray> rays,
                   std::span<const LeftOutRay> judges,
                   const Executor& executor) {
  const auto map =
      SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "a map of points");
  const auto renderer = make_renderer("beam", Scene{map});
  std::vector<Hit> hits(rays.size());
  cast_rays(*renderer, rays, hits, executor);
  std::size_t right = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double off = static_cast<double>(hits[i].range - judges[i].range);
    if (hits[i].is_return() && std::abs(off) <= kRight) ++right;
  }
  return static_cast<double>(right) / static_cast<double>(hits.size());
}

}  // namespace

std::vector<TriedResolution> try_resolutions(const std::vector<CloudSource>& clouds,
                                             const ImportOptions& options,
                                             const Executor& executor,
                                             const Progress& progress,
                                             std::size_t most_points) {
  const std::vector<Vector3d> points = points_to_try(clouds, options, most_points, progress);
  report(progress, "looking for rays", 0.0);
  const std::vector<LeftOutRay> judges = judges_of(points, executor);
  if (judges.size() < kFewestJudges) return {};
  std::vector<Ray> rays;
  rays.reserve(judges.size());
  for (const LeftOutRay& judge : judges) rays.push_back(judge.ray);
  ImportOptions chosen;  // the points are in the world
  chosen.outliers = options.outliers;
  chosen.tau = options.tau;
  chosen.quality = TreeQuality::kNormal;  // of use for seconds
  chosen.scratch_folder = options.scratch_folder;
  chosen.scratch_memory = options.scratch_memory;
  chosen.cells_memory = options.cells_memory;
  const auto remaining = [&](std::size_t) { return std::make_unique<RemainingPoints>(points); };
  const auto try_one = [&](const std::optional<double>& resolution) {
    chosen.resolution = resolution;
    const ImportedMap imported =
        build_map({clouds.front().name()}, remaining, chosen, executor, progress);
    return TriedResolution{
        imported.report.resolution, share_right(imported, rays, judges, executor), rays.size()};
  };
  return refine_resolutions(search_resolutions(try_one, kSlack), try_one);
}

CloudMap map_clouds(const std::vector<CloudSource>& sources,
                    const ImportOptions& options,
                    const Executor& executor,
                    const Progress& progress) {
  CloudMap made;
  ImportOptions chosen = options;
  check_options(options);
  const bool has_mesh =
      std::ranges::any_of(sources, [](const CloudSource& source) { return source.is_mesh(); });
  if (!options.resolution && !has_mesh && !sources.empty()) {
    made.tried = try_resolutions(sources, options, executor, progress);
    if (!made.tried.empty()) {
      // with all points the map is that much denser
      constexpr double kTried = 1.0 - 1.0 / static_cast<double>(kLeaveOut);
      const double best = peak_resolution(made.tried) * std::sqrt(kTried);
      chosen.resolution = std::round(best * 1e4) / 1e4;
      chosen.resolution_is_tried = true;
    }
  }
  made.map = import_clouds(sources, chosen, executor, progress);
  return made;
}

}  // namespace pointflight
