#include "pointflight/survey/internal/surfel_blame.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

// Kinds of evidence: by size for each axis and fate, early rays as such, and for each axis where
// the rays want the centre and how much they had to say about it.
constexpr std::size_t by_size(std::size_t axis, Fate fate) {
  return 3 * axis + static_cast<std::size_t>(fate);
}
constexpr std::size_t kEarlyRays = 9;
constexpr std::size_t pull(std::size_t axis) {
  return 10 + axis;
}
constexpr std::size_t hold(std::size_t axis) {
  return 13 + axis;
}
constexpr std::size_t kKinds = 16;

}  // namespace

SurfelBlame::SurfelBlame(const SurfelMap& map, const FitOptions& fit)
    : map_(map),
      fit_(fit),
      support_squared_(static_cast<double>(map.model().support) *
                       static_cast<double>(map.model().support)),
      headers_(map.words().size(), 0),
      sums_(map.words().size(), kKinds) {
  for_each_surfel(map.words(), [&](const LeafHeader&, std::size_t word) {
    headers_[word] = static_cast<std::uint8_t>(headers_[word - 1] + 1);
  });
}

/// w = c (1 - q / M^2)^2 with q = sum a_k^2, a_k the coordinates of the ray's nearest point from
/// the centre in units of s_k, and c = 36 / (pi M^2). So dw / d(ln s_k) is
/// 4 c (1 - q / M^2) a_k^2 / M^2; moving the centre along axis k gives the same with a_k.
SurfelBlame::Slopes SurfelBlame::slopes(const SurveyRay& ray, const SurfelHit& hit) const {
  const Surfel surfel = decode(map_.words()[hit.word]);
  const LeafHeader leaf = decode_leaf(map_.words()[hit.word - headers_[hit.word]]);
  const Vector3d nearest = ray.origin_world +
                           static_cast<double>(hit.t) * ray.direction_world.cast<double>() -
                           map_.center_world(leaf, map_.words()[hit.word]);
  std::array<double, 3> coordinates{};
  double q = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double a = surfel.axes.col(k).cast<double>().dot(nearest) /
                     (map_.resolution() * static_cast<double>(surfel.s[k]));
    coordinates[static_cast<std::size_t>(k)] = a;
    q += a * a;
  }
  const double inside = std::max(0.0, 1.0 - q / support_squared_);
  const double scale = 4.0 * 36.0 / (kPi * support_squared_) * inside / support_squared_;
  Slopes slopes{};
  for (std::size_t k = 0; k < 3; ++k) {
    slopes.by_position[k] = scale * coordinates[k];
    slopes.by_size[k] = slopes.by_position[k] * coordinates[k];
  }
  return slopes;
}

void SurfelBlame::add(const SurveyRay& ray, Fate fate, const SurfelHit& hit) {
  const Slopes slope = slopes(ray, hit);
  const double counts = fate == Fate::kLeak ? fit_.leak_weight : 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sums_.add(hit.word, by_size(axis, fate), slope.by_size[axis]);
    const double position = counts * slope.by_position[axis];
    sums_.add(hit.word, hold(axis), std::abs(position));
    if (fate == Fate::kLeak) sums_.add(hit.word, pull(axis), position);
    if (fate == Fate::kEarly) sums_.add(hit.word, pull(axis), -position);
  }
  if (fate == Fate::kEarly) sums_.add(hit.word, kEarlyRays, 1.0);
}

double SurfelBlame::size_factor(std::size_t word, std::size_t axis) const {
  const double early = sums_.sum(word, by_size(axis, Fate::kEarly));
  const double right = sums_.sum(word, by_size(axis, Fate::kRight));
  double leaks = fit_.leak_weight * sums_.sum(word, by_size(axis, Fate::kLeak));
  if (axis > 0 && is_planar(map_.words()[word])) {
    // foliage and edges, which beams pass, end where they end
    const double solid = early > 0.0 ? right / (right + early) : 1.0;
    leaks += fit_.expected_leaks * solid * solid;
  }
  const double change = -fit_.step * (early - leaks) / (early + leaks + right + fit_.doubt);
  return std::min(fit_.growth_max, math::exp(change));
}

double SurfelBlame::shift(std::size_t word, std::size_t axis) const {
  if (axis == 0 && is_planar(map_.words()[word])) return 0.0;
  const double full =
      fit_.shift_step * sums_.sum(word, pull(axis)) / (sums_.sum(word, hold(axis)) + fit_.doubt);
  return std::clamp(full, -fit_.shift_max, fit_.shift_max);
}

std::optional<Reshaping> SurfelBlame::verdict(std::size_t word) const {
  double early = 0.0;
  double all = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    early += sums_.sum(word, by_size(axis, Fate::kEarly));
    all += sums_.sum(word, by_size(axis, Fate::kEarly)) +
           sums_.sum(word, by_size(axis, Fate::kLeak)) +
           sums_.sum(word, by_size(axis, Fate::kRight));
  }
  Reshaping change;
  if (all <= 0.0) return change;
  if (sums_.sum(word, kEarlyRays) >= 3.0 && early >= fit_.blame_share * all) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    change.factors[axis] = size_factor(word, axis);
    change.shifts[axis] = shift(word, axis);
  }
  return change;
}

}  // namespace pointflight
