#include "pointflight/render/beam_renderer.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/render/coverage.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kLanes = 8;
// 7 siblings a level and 60 levels of Morton bits; a corrupt map stops being followed here
constexpr std::size_t kStack = 512;
constexpr std::size_t kChunk = 1024;  // beams

using Lanes = std::array<float, kLanes>;
using LaneWords = std::array<std::uint32_t, kLanes>;

/// Numbers of the map that every beam needs.
struct Model {
  float r;
  float support_squared;
  float weight_scale;  ///< c = 36 / (pi M^2): the weights of a covered plane average 1.
  float tau;
  float window;  ///< m
};

Model model_of(const SurfelMap& map) {
  const RenderModel& m = map.model();
  const float support_squared = m.support * m.support;
  return {static_cast<float>(map.resolution()),
          support_squared,
          36.0f / (static_cast<float>(kPi) * support_squared),
          m.tau,
          m.window * static_cast<float>(map.resolution())};
}

struct Entry {
  float t;              ///< Where the beam enters the box.
  std::uint32_t index;  ///< Node, or word of a leaf's header.
  std::uint8_t meta;
};

/// Up to eight surfels of a leaf, one a lane, metres from the leaf's origin.
struct LeafLanes {
  alignas(32) LaneWords low;
  alignas(32) LaneWords high;
  alignas(32) Lanes x, y, z;    ///< Centre minus the beam's point nearest to the leaf's origin.
  alignas(32) Lanes variance2;  ///< s2^2
};

/// One beam on its way through the tree.
class Traversal {
 public:
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): the stack is written before it is read
  Traversal(const SurfelMap& map, const Model& model, HitList& hits)
      : nodes_(map.nodes()), words_(map.words()), map_(map), model_(model), hits_(hits) {}

  Hit trace(const Ray& ray) {
    hits_.clear();
    overflowed_ = false;
    if (nodes_.empty()) return {};
    start(ray);
    depth_ = 0;
    stack_[depth_++] = {0.0f, 0, Bvh8Node::kInner};
    // more visits than there are children means a cycle: a corrupt file
    std::size_t steps = nodes_.size() * kLanes + kLanes;
    while (depth_ > 0 && steps-- > 0) {
      const Entry entry = stack_[--depth_];
      if (entry.t > end_) continue;
      if (entry.meta == Bvh8Node::kInner) {
        visit_node(entry.index);
      } else {
        visit_leaf(entry);
      }
    }
    return finish();
  }

  [[nodiscard]] bool overflowed() const { return overflowed_; }

 private:
  void start(const Ray& ray) {
    origin_ = ray.origin_world - map_.origin_world();
    end_ = ray.range_max;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float d = ray.direction_world[static_cast<int>(axis)];
      direction_[axis] = d;
      start_[axis] = static_cast<float>(origin_[static_cast<int>(axis)]);
      // a zero would make 0 * inf below; a tiny slope reaches as far
      inverse_[axis] = 1.0f / (std::abs(d) > 1e-12f ? d : std::copysign(1e-12f, d));
    }
  }

  void visit_node(std::uint32_t index) {
    if (index >= nodes_.size()) return;
    const Bvh8Node& node = nodes_[index];
    alignas(32) Lanes enter;
    alignas(32) Lanes leave;
    enter.fill(0.0f);
    leave.fill(end_);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool forward = inverse_[axis] >= 0.0f;
      const std::uint8_t* near_side = forward ? node.lo[axis] : node.hi[axis];
      const std::uint8_t* far_side = forward ? node.hi[axis] : node.lo[axis];
      const float step = node.scale * inverse_[axis];
      const float offset = (node.origin[axis] - start_[axis]) * inverse_[axis];
      for (std::size_t i = 0; i < kLanes; ++i) {
        const float a = offset + static_cast<float>(near_side[i]) * step;
        const float b = offset + static_cast<float>(far_side[i]) * step;
        enter[i] = a > enter[i] ? a : enter[i];
        leave[i] = b < leave[i] ? b : leave[i];
      }
    }
    push_children(node, enter, leave);
  }

  void push_children(const Bvh8Node& node, const Lanes& enter, const Lanes& leave) {
    std::uint32_t inner = node.first_inner;
    std::uint32_t word = node.first_leaf_word;
    const std::size_t first = depth_;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint8_t meta = node.meta[i];
      if (meta == 0) continue;
      const bool is_inner = meta == Bvh8Node::kInner;
      const std::uint32_t index = is_inner ? inner : word;
      inner += is_inner ? 1u : 0u;
      word += is_inner ? 0u : meta + 1u;
      if (enter[i] > leave[i] || depth_ == kStack || (!is_inner && meta > kLanes)) continue;
      // insertion by entry distance, the nearest on top
      std::size_t at = depth_++;
      for (; at > first && stack_[at - 1].t < enter[i]; --at) stack_[at] = stack_[at - 1];
      stack_[at] = {enter[i], index, meta};
    }
  }

  void visit_leaf(const Entry& entry) {
    if (entry.index + entry.meta + kLeafPadding >= words_.size()) return;
    const LeafHeader leaf = decode_leaf(words_[entry.index]);
    // in double: maps may be kilometres wide, and the result must not depend on the path here
    const double r = map_.resolution();
    const auto vx = static_cast<float>(leaf.x * r - origin_.x());
    const auto vy = static_cast<float>(leaf.y * r - origin_.y());
    const auto vz = static_cast<float>(leaf.z * r - origin_.z());
    const float t_leaf = direction_[0] * vx + direction_[1] * vy + direction_[2] * vz;
    LeafLanes lanes;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by load
    load(entry.index + 1,
         direction_[0] * t_leaf - vx,
         direction_[1] * t_leaf - vy,
         direction_[2] * t_leaf - vz,
         lanes);
    if (reject(lanes, entry.meta)) return;
    test(lanes, entry, t_leaf);
    if (hits_.total_weight() >= model_.tau) shorten();
  }

  void load(std::size_t first, float base_x, float base_y, float base_z, LeafLanes& lanes) const {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const SurfelWord word = words_[first + i];
      lanes.low[i] = static_cast<std::uint32_t>(word);
      lanes.high[i] = static_cast<std::uint32_t>(word >> 32);
    }
    const float step = model_.r / 64.0f;
    const float r_squared = model_.r * model_.r;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint32_t low = lanes.low[i];
      lanes.x[i] =
          (static_cast<float>(static_cast<std::int32_t>(low & 1023u)) + 0.5f) * step - base_x;
      lanes.y[i] =
          (static_cast<float>(static_cast<std::int32_t>(low >> 10 & 1023u)) + 0.5f) * step - base_y;
      lanes.z[i] =
          (static_cast<float>(static_cast<std::int32_t>(low >> 20 & 1023u)) + 0.5f) * step - base_z;
      const std::uint32_t bits = 0x3b6bedfau + (lanes.high[i] >> 27) * 0x288000u;
      lanes.variance2[i] = std::bit_cast<float>(bits) * r_squared;
    }
  }

  /// True if the beam passes all surfels at more than their largest reach.
  [[nodiscard]] bool reject(const LeafLanes& lanes, std::uint8_t count) const {
    alignas(32) Lanes excess;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float along =
          direction_[0] * lanes.x[i] + direction_[1] * lanes.y[i] + direction_[2] * lanes.z[i];
      const float squared =
          lanes.x[i] * lanes.x[i] + lanes.y[i] * lanes.y[i] + lanes.z[i] * lanes.z[i];
      excess[i] = squared - along * along - model_.support_squared * lanes.variance2[i] * 1.01f;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (excess[i] <= 0.0f) return false;
    }
    return true;
  }

  /// Section 2 of the measurement model for eight surfels: u = S R (p - o), v = S R d,
  /// t = u.v / v.v, m^2 = |u - t v|^2, weight = c (1 - m^2 / M^2)^2.
  void test(const LeafLanes& lanes, const Entry& entry, float t_leaf) {
    constexpr float kQuaternionStep = 0.70711f / 127.0f;
    alignas(32) Lanes t;
    alignas(32) Lanes m2;
    const float dx = direction_[0];
    const float dy = direction_[1];
    const float dz = direction_[2];
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint32_t high = lanes.high[i];
      // shift up, then down with the sign
      const float qx =
          static_cast<float>(static_cast<std::int32_t>(high << 24) >> 24) * kQuaternionStep;
      const float qy =
          static_cast<float>(static_cast<std::int32_t>(high << 16) >> 24) * kQuaternionStep;
      const float qz =
          static_cast<float>(static_cast<std::int32_t>(high << 8) >> 24) * kQuaternionStep;
      const float rest = 1.0f - qx * qx - qy * qy - qz * qz;
      const float qw = std::sqrt(rest > 0.0f ? rest : 0.0f);
      // 1 / s_k^2: thickness by class, s1 = s2 * 0.75^k as three selects on the variance
      const std::uint32_t thickness = lanes.low[i] >> 30;
      const float s0 = (thickness & 2u) != 0 ? ((thickness & 1u) != 0 ? 0.27f : 0.14f)
                                             : ((thickness & 1u) != 0 ? 0.06f : kPlanarThickness);
      const std::uint32_t k = high >> 24 & 7u;
      float ratio = (k & 1u) != 0 ? 0.5625f : 1.0f;
      ratio *= (k & 2u) != 0 ? 0.31640625f : 1.0f;
      ratio *= (k & 4u) != 0 ? 0.1001129150390625f : 1.0f;
      const float inverse2 = 1.0f / lanes.variance2[i];
      const float inverse1 = inverse2 / ratio;
      const float inverse0 = 1.0f / (s0 * s0 * model_.r * model_.r);
      // columns of the rotation matrix: e0, e1, e2
      const float e0x = 1.0f - 2.0f * (qy * qy + qz * qz);
      const float e0y = 2.0f * (qx * qy + qw * qz);
      const float e0z = 2.0f * (qx * qz - qw * qy);
      const float e1x = 2.0f * (qx * qy - qw * qz);
      const float e1y = 1.0f - 2.0f * (qx * qx + qz * qz);
      const float e1z = 2.0f * (qy * qz + qw * qx);
      const float e2x = 2.0f * (qx * qz + qw * qy);
      const float e2y = 2.0f * (qy * qz - qw * qx);
      const float e2z = 1.0f - 2.0f * (qx * qx + qy * qy);
      const float p0 = e0x * lanes.x[i] + e0y * lanes.y[i] + e0z * lanes.z[i];
      const float p1 = e1x * lanes.x[i] + e1y * lanes.y[i] + e1z * lanes.z[i];
      const float p2 = e2x * lanes.x[i] + e2y * lanes.y[i] + e2z * lanes.z[i];
      const float d0 = e0x * dx + e0y * dy + e0z * dz;
      const float d1 = e1x * dx + e1y * dy + e1z * dz;
      const float d2 = e2x * dx + e2y * dy + e2z * dz;
      const float uv = p0 * d0 * inverse0 + p1 * d1 * inverse1 + p2 * d2 * inverse2;
      const float vv = d0 * d0 * inverse0 + d1 * d1 * inverse1 + d2 * d2 * inverse2;
      const float along = uv / vv;
      const float a0 = p0 - along * d0;
      const float a1 = p1 - along * d1;
      const float a2 = p2 - along * d2;
      t[i] = t_leaf + along;
      m2[i] = a0 * a0 * inverse0 + a1 * a1 * inverse1 + a2 * a2 * inverse2;
    }
    for (std::size_t i = 0; i < entry.meta; ++i) {
      if (!(m2[i] < model_.support_squared) || !(t[i] >= 0.0f) || !(t[i] <= end_)) continue;
      if (hits_.full() && !make_room(t[i])) continue;
      const float share = 1.0f - m2[i] / model_.support_squared;
      hits_.add({t[i],
                 model_.weight_scale * share * share,
                 static_cast<SurfelWord>(lanes.high[i]) << 32 | lanes.low[i],
                 static_cast<std::uint32_t>(entry.index + 1 + i)});
    }
  }

  /// Evaluates the hits so far; everything behind the window of a surface can no longer matter.
  void shorten() {
    const auto result = hits_.evaluate(model_.tau, model_.window);
    if (!result) return;
    const float end = result->first + model_.window;
    if (end < end_) {
      end_ = end;
      hits_.drop_behind(end_);
    }
  }

  /// True if a hit at t may be added after all.
  bool make_room(float t) {
    shorten();
    if (!hits_.full()) return t <= end_;
    overflowed_ = true;
    if (t >= hits_.hits().back().t) return false;
    hits_.drop_farthest();
    return true;
  }

  Hit finish() {
    if (hits_.total_weight() < model_.tau) return {};
    const auto result = hits_.evaluate(model_.tau, model_.window);
    if (!result) return {};
    Hit hit;
    hit.range = result->range;
    hit.intensity = map_.intensity(result->strongest);
    hit.cos_incidence = cos_incidence(result->first);
    return hit;
  }

  /// Against the mean of the normals met, each turned towards the sensor and weighted.
  [[nodiscard]] float cos_incidence(float first) const {
    const Vector3f d(direction_[0], direction_[1], direction_[2]);
    Vector3f normal = Vector3f::Zero();
    for (const SurfelHit& hit : hits_.hits()) {
      if (hit.t < first || hit.t > first + model_.window) continue;
      const Vector3f e0 = decode(hit.word).axes.col(0);
      normal += (e0.dot(d) > 0.0f ? -hit.weight : hit.weight) * e0;
    }
    const float length = normal.norm();
    return length > 0.0f ? std::min(1.0f, std::abs(normal.dot(d)) / length) : 1.0f;
  }

  std::span<const Bvh8Node> nodes_;
  std::span<const SurfelWord> words_;
  const SurfelMap& map_;
  const Model& model_;
  HitList& hits_;
  Vector3d origin_ = Vector3d::Zero();  ///< Of the beam, from the map's origin.
  std::array<float, 3> start_{};        ///< The same in float, for boxes.
  std::array<float, 3> direction_{};
  std::array<float, 3> inverse_{};
  float end_ = 0.0f;  ///< Nothing beyond matters.
  bool overflowed_ = false;
  std::size_t depth_ = 0;
  std::array<Entry, kStack> stack_;
};

}  // namespace

void BeamRenderer::render(const RayBatch& batch,
                          std::span<Hit> hits,
                          const Executor& executor) const {
  const Model model = model_of(*map_);
  executor.parallel_for(batch.rays.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    HitList list;
    Traversal traversal(*map_, model, list);
    for (std::size_t i = begin; i < end; ++i) {
      hits[i] = traversal.trace(batch.rays[i]);
      if (traversal.overflowed()) ++overflows_;
    }
  });
}

Hit BeamRenderer::trace(const Ray& ray) const {
  const Model model = model_of(*map_);
  HitList list;
  return Traversal(*map_, model, list).trace(ray);
}

}  // namespace pointflight
