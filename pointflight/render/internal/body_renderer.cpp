#include "pointflight/render/internal/body_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kRaysPerChunk = 2048;  // rays
constexpr std::size_t kLanes = 8;
constexpr std::size_t kManyBodies = 200;  // from here on sorted rays are worth their sorting

/// The directions in which a body can be hit while the batch is fired: around the middle of the
/// rays' origins, as wide as it and everybody's motion make it.
struct Cone {
  const Body* body = nullptr;
  Vector3f axis = Vector3f::UnitX();
  float cos_limit = -1.0f;  ///< -1: all around.
};

/// Room for the rounding of directions to float.
constexpr double kCosSlack = 1e-6;

/// Where the rays of a batch start and when.
struct Start {
  Vector3d middle = Vector3d::Zero();
  double spread = 0.0;  ///< No origin lies farther from the middle, m.
  SimTime first, last;
};

Start start_of(const RayBatch& batch) {
  Start start;
  Aabb box;
  for (const Ray& ray : batch.rays) box.add(ray.origin_world);
  start.middle = 0.5 * (box.min + box.max);
  start.spread = 0.5 * box.size().norm();
  start.first = start.last = batch.time;
  if (!batch.time_offsets.empty()) {
    const auto [low, high] =
        std::minmax_element(batch.time_offsets.begin(), batch.time_offsets.end());
    start.first = batch.time + *low;
    start.last = batch.time + *high;
  }
  return start;
}

/// Bodies that some ray may hit; of wide beams `widest` is the radius, rad.
std::vector<Cone> cones_of(const RayBatch& batch, double widest) {
  const Start start = start_of(batch);
  std::vector<Cone> cones;
  for (const Body& body : batch.bodies) {
    const SimTime first = std::max(start.first, body.from);
    const SimTime last = std::min(start.last, body.until);
    if (first > last) continue;
    const SimTime middle = first + (last - first) / 2;
    const double moved = body.speed_max * to_seconds(last - middle);
    const double radius = visible_radius(body) + moved + start.spread;
    const Vector3d way = body.T_world_body(middle).translation - start.middle;
    const double distance = way.norm();
    if (distance - radius > static_cast<double>(batch.range_max)) continue;
    Cone cone;
    cone.body = &body;
    if (distance > 1.001 * radius) {
      cone.axis = (way / distance).cast<float>();
      const double sine = radius / distance;
      const double cosine = std::sqrt(1.0 - sine * sine);
      // cos(a + w) and a little less
      const double wider = cosine * (1.0 - 0.5 * widest * widest) - sine * widest;
      cone.cos_limit = static_cast<float>(wider - kCosSlack);
    }
    cones.push_back(cone);
  }
  return cones;
}

/// Directions of a chunk's rays as arrays, in whole groups of eight, and cones around blocks of
/// neighbours, so that a body asks only blocks that it may be seen from.
class Directions {
 public:
  /// `order`: the numbers of the chunk's rays, neighbours together if there are many bodies.
  Directions(std::span<const Ray> rays, std::span<const std::uint32_t> order) : order_(order) {
    const std::size_t groups = (order.size() + kLanes - 1) / kLanes * kLanes;
    for (std::size_t i = 0; i < groups; ++i) {
      const Vector3f& d = rays[order[std::min(i, order.size() - 1)]].direction_world;
      x_[i] = d.x();
      y_[i] = d.y();
      z_[i] = d.z();
    }
    for (std::size_t first = 0; first < groups; first += kBlock) {
      blocks_.push_back(block_of(first, std::min(first + kBlock, groups)));
    }
  }

  /// Appends the numbers of the rays within a cone.
  void within(const Cone& cone, std::vector<std::uint32_t>& found) const {
    const float sine = std::sqrt(std::max(0.0f, 1.0f - cone.cos_limit * cone.cos_limit));
    for (const Block& block : blocks_) {
      // apart if the angle between the axes is more than both half angles
      const bool whole = cone.cos_limit <= -block.cosine;
      const float limit = cone.cos_limit * block.cosine - sine * block.sine - kBlockSlack;
      if (!whole && cone.axis.dot(block.axis) < limit) continue;
      for (std::size_t g = block.begin; g < block.end; g += kLanes) group_within(cone, g, found);
    }
  }

 private:
  static constexpr std::size_t kBlock = 64;
  static constexpr float kBlockSlack = 1e-5f;  // room for rounding
  struct Block {
    std::size_t begin, end;
    Vector3f axis;
    float cosine, sine;  ///< Of the half angle.
  };

  [[nodiscard]] Vector3f at(std::size_t i) const { return {x_[i], y_[i], z_[i]}; }

  [[nodiscard]] Block block_of(std::size_t begin, std::size_t end) const {
    Vector3f sum = Vector3f::Zero();
    for (std::size_t i = begin; i < end; ++i) sum += at(i);
    if (sum.norm() < 0.1f) return {begin, end, Vector3f::UnitX(), -1.0f, 0.0f};  // all around
    const Vector3f axis = sum.normalized();
    float cosine = 1.0f;
    for (std::size_t i = begin; i < end; ++i) cosine = std::min(cosine, axis.dot(at(i)));
    return {begin, end, axis, cosine, std::sqrt(std::max(0.0f, 1.0f - cosine * cosine))};
  }

  void group_within(const Cone& cone, std::size_t g, std::vector<std::uint32_t>& found) const {
    std::array<float, kLanes> cosine{};
    float most = -2.0f;
    for (std::size_t k = 0; k < kLanes; ++k) {
      cosine[k] = cone.axis.x() * x_[g + k] + cone.axis.y() * y_[g + k] + cone.axis.z() * z_[g + k];
    }
    for (const float c : cosine) most = std::max(most, c);
    if (most < cone.cos_limit) return;
    for (std::size_t k = 0; k < kLanes && g + k < order_.size(); ++k) {
      if (cosine[k] >= cone.cos_limit) found.push_back(order_[g + k]);
    }
  }

  std::span<const std::uint32_t> order_;
  std::array<float, kRaysPerChunk> x_{}, y_{}, z_{};
  std::vector<Block> blocks_;
};

/// Numbers of a batch's rays: as they are, or along a curve over the sphere if sorting pays.
std::vector<std::uint32_t> ray_order(const RayBatch& batch,
                                     std::size_t bodies,
                                     const Executor& executor) {
  if (bodies >= kManyBodies && batch.order.size() == batch.rays.size()) {
    return {batch.order.begin(), batch.order.end()};
  }
  if (bodies >= kManyBodies) {
    std::vector<Vector3f> directions;
    directions.reserve(batch.rays.size());
    for (const Ray& ray : batch.rays) directions.push_back(ray.direction_world);
    return direction_order(directions, executor);
  }
  std::vector<std::uint32_t> order(batch.rays.size());
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

/// A ray in the frame of a body at the ray's own time.
Ray in_body(const Ray& ray, const Pose& T_world_body) {
  Ray own = ray;
  own.origin_world = T_world_body.inverse() * ray.origin_world;
  own.direction_world = (T_world_body.rotation.conjugate() * ray.direction_world.cast<double>())
                            .cast<float>()
                            .normalized();
  return own;
}

bool is_nearer(float range, float range_max, const Hit& hit) {
  return range <= range_max && (!hit.is_return() || range < hit.range);
}

/// Where a ray hits what is exact of a body, in the body's frame.
std::optional<SolidHit> meet_exact(const Body& body,
                                   const Vector3d& origin,
                                   const Vector3d& direction,
                                   SimTime time) {
  if (body.look) return intersect(*body.look, origin, direction, time);
  return intersect(std::get<Solid>(body.shape), origin, direction);
}

void meet_solid(const RayBatch& batch,
                const Body& body,
                std::span<const std::uint32_t> rays,
                std::span<Hit> hits) {
  for (const std::uint32_t i : rays) {
    const SimTime time = batch.time_of(i);
    if (time < body.from || time >= body.until) continue;
    const Ray& ray = batch.rays[i];
    const Pose T_body_world = body.T_world_body(time).inverse();
    const Vector3d direction = T_body_world.rotation * ray.direction_world.cast<double>();
    const auto met =
        meet_exact(body, T_body_world * ray.origin_world, direction.normalized(), time);
    if (!met || !is_nearer(static_cast<float>(met->range), ray.range_max, hits[i])) continue;
    hits[i].range = static_cast<float>(met->range);
    hits[i].cos_incidence = static_cast<float>(std::abs(met->normal.dot(direction)));
    hits[i].intensity = body.intensity;
    hits[i].label = body.label;
    hits[i].surfel = kNoSurfel;  // not that of the map behind it
  }
}

void meet_points(const RayBatch& batch,
                 const Body& body,
                 std::span<const std::uint32_t> rays,
                 std::span<Hit> hits) {
  const SurfelMap& map = *std::get<std::shared_ptr<const SurfelMap>>(body.shape);
  const KernelMap kernel_map = kernel_map_of(map);
  std::vector<MapRay> own;
  std::vector<std::uint32_t> number;
  for (const std::uint32_t i : rays) {
    const SimTime time = batch.time_of(i);
    if (time < body.from || time >= body.until) continue;
    own.push_back(map_ray(kernel_map, in_body(batch.rays[i], body.T_world_body(time))));
    number.push_back(i);
  }
  std::vector<std::uint32_t> order(own.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<KernelHit> found(own.size());
  // one by one: rays of one batch lie in frames that differ by the body's motion
  trace_beams(kernel_map, own, order, found, BeamGrouping::kSingly);
  for (std::size_t k = 0; k < own.size(); ++k) {
    Hit& hit = hits[number[k]];
    if (found[k].range < 0.0f || !is_nearer(found[k].range, own[k].range_max, hit)) continue;
    hit.range = found[k].range;
    hit.cos_incidence = found[k].cos_incidence;
    hit.intensity = map.intensity(found[k].strongest);
    hit.label = body.label;
    hit.surfel = kNoSurfel;
  }
}

}  // namespace

std::vector<std::uint32_t> rays_near_bodies(const RayBatch& batch,
                                            float widest,
                                            const Executor& executor) {
  if (batch.bodies.empty() || batch.rays.empty()) return {};
  const std::vector<Cone> cones = cones_of(batch, static_cast<double>(widest));
  if (cones.empty()) return {};
  const std::vector<std::uint32_t> order = ray_order(batch, cones.size(), executor);
  std::vector<std::uint8_t> is_near(batch.rays.size(), 0);
  executor.parallel_for(order.size(), kRaysPerChunk, [&](std::size_t begin, std::size_t end) {
    const Directions directions(batch.rays, std::span(order).subspan(begin, end - begin));
    std::vector<std::uint32_t> candidates;
    for (const Cone& cone : cones) directions.within(cone, candidates);
    for (const std::uint32_t i : candidates) is_near[i] = 1;
  });
  std::vector<std::uint32_t> near;
  for (const std::uint32_t i : order) {
    if (is_near[i] != 0) near.push_back(i);
  }
  return near;
}

void render_bodies(const RayBatch& batch, std::span<Hit> hits, const Executor& executor) {
  if (batch.bodies.empty() || batch.rays.empty()) return;
  const std::vector<Cone> cones = cones_of(batch, 0.0);
  if (cones.empty()) return;
  const std::vector<std::uint32_t> order = ray_order(batch, cones.size(), executor);
  executor.parallel_for(order.size(), kRaysPerChunk, [&](std::size_t begin, std::size_t end) {
    const Directions directions(batch.rays, std::span(order).subspan(begin, end - begin));
    std::vector<std::uint32_t> candidates;
    for (const Cone& cone : cones) {
      candidates.clear();
      directions.within(cone, candidates);
      if (candidates.empty()) continue;
      if (cone.body->look || std::holds_alternative<Solid>(cone.body->shape)) {
        meet_solid(batch, *cone.body, candidates, hits);
      } else {
        meet_points(batch, *cone.body, candidates, hits);
      }
    }
  });
}

}  // namespace pointflight
