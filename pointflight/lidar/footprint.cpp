#include "pointflight/lidar/footprint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/render/direction_order.hpp"

namespace pointflight {
namespace {

constexpr double kRadius = 2.0;  // of the cross-section, sigmas
// of the first sub-rays' circle: a heptagon around the cross-section, so that no edge across it
// lies between them
constexpr double kRim = 2.22;
constexpr double kFwhmPerSigma = 2.3548;   // 2 sqrt(2 ln 2)
constexpr double kGolden = 0.61803398875;  // turns of beams one after the other
constexpr std::size_t kRaysAtOnce = 16384;
constexpr std::size_t kBeamsPerChunk = 256;
constexpr std::size_t kMore[] = {32, 96, 288};  // sub-rays after the first eight
constexpr std::size_t kFew = 8;
constexpr std::size_t kEnough = 32;
constexpr float kOffPlane = 0.2f;  // m
constexpr float kDeep = 0.4f;      // m: of such an echo eight sub-rays give no mean range
constexpr float kBefore = 0.3f;    // m, nearer than what sub-rays met

float nearest_of(std::span<const BeamPart> parts) {
  float nearest = std::numeric_limits<float>::infinity();
  for (const BeamPart& part : parts) {
    if (part.is_return()) nearest = std::min(nearest, part.range);
  }
  return nearest;
}

/// What one sub-ray gives back.
BeamPart part_of(const Hit& hit, float share, std::size_t sub_ray, const ReturnModel& returns) {
  if (!hit.is_return()) return {.share = share};
  return {.range = hit.range,
          .share = share,
          .reflectivity = static_cast<float>(returns.reflectivity(hit)),
          .intensity = hit.intensity,
          .label = hit.label,
          .origin = {hit.cos_incidence, hit.surfel, static_cast<std::uint16_t>(sub_ray)}};
}

/// Parts that met one plane: there the inverse of the range is linear across the beam.
template <class SubRays>
bool lie_in_plane(std::span<const BeamPart> parts, const SubRays& sub_rays) {
  float mean = 0.0f;
  float along_x = 0.0f;
  float along_y = 0.0f;
  float xx = 0.0f;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i].is_return() || parts[i].label != parts[0].label) return false;
    const float inverse = 1.0f / std::max(parts[i].range, 0.01f);
    mean += inverse / static_cast<float>(parts.size());
    along_x += inverse * sub_rays[i].x;
    along_y += inverse * sub_rays[i].y;
    xx += sub_rays[i].x * sub_rays[i].x;  // the same in y, and none in x y: places on a circle
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const float inverse = mean + (along_x * sub_rays[i].x + along_y * sub_rays[i].y) / xx;
    if (!(inverse > 0.0f) || std::abs(1.0f / inverse - parts[i].range) > kOffPlane) return false;
  }
  return true;
}

/// By how much the share of light of an echo may be off, as a part of itself: two sub-rays more or
/// less are chance.
double uncertainty_of(const Echo& echo) {
  return 2.0 / static_cast<double>(echo.parts);
}

double most_energy(const Echo& echo) {
  return (1.0 + uncertainty_of(echo)) * energy_of(echo);
}

double least_energy(const Echo& echo) {
  return std::max(0.0, 1.0 - uncertainty_of(echo)) * energy_of(echo);
}

/// True if whether an echo is detected hangs on how many of the sub-rays are its own.
bool depends_on_sub_rays(const Echo& echo, const ReturnModel& returns) {
  const double chance = uncertainty_of(echo);
  return returns.may_go_either_way(echo, std::max(0.0, 1.0 - chance), 1.0 + chance);
}

/// The energy below which an echo is not reported, whatever its sub-rays: where one counts, the
/// strongest.
double energy_that_counts(const Echoes& echoes, const ReturnModel& returns) {
  double least = 0.0;
  if (returns.mode() != ReturnMode::kStrongest) return least;
  for (const Echo& echo : echoes.span()) least = std::max(least, least_energy(echo));
  return least;
}

/// True if what the sensor reports of these echoes hangs on the shares of light, of which eight
/// sub-rays give only a guess.
bool is_in_doubt(const Echoes& echoes, const ReturnModel& returns) {
  const double counts = energy_that_counts(echoes, returns);
  std::size_t candidates = 0;
  for (const Echo& echo : echoes.span()) {
    if (most_energy(echo) < counts) continue;
    ++candidates;
    if (echo.depth > kDeep || depends_on_sub_rays(echo, returns)) return true;
  }
  return candidates > 1;
}

/// True if more sub-rays may find another number of echoes that are reported: few met one of them,
/// or what fewer had met between them is gone.
bool may_lack(const Echoes& before, const Echoes& echoes, const ReturnModel& returns) {
  constexpr double kLeft = 0.2;  // of the light that one sub-ray of few stood for
  const double counts = energy_that_counts(echoes, returns);
  for (const Echo& echo : echoes.span()) {
    if (echo.parts <= kFew && most_energy(echo) >= counts && depends_on_sub_rays(echo, returns)) {
      return true;
    }
  }
  if (before.count <= echoes.count) return false;
  const auto is_missed = [&](const Echo& echo) {
    const double left = kLeft / static_cast<double>(echo.parts);
    return left * energy_of(echo) >= counts && returns.may_go_either_way(echo, 0.0, left);
  };
  return std::any_of(before.span().begin(), before.span().end(), is_missed);
}

/// True if a surface at a range may be reported that no sub-ray met.
bool may_count(float range, const Echoes& echoes, const ReturnModel& returns) {
  constexpr double kUnmet = 0.3;  // of the light at most, of a white surface
  const auto r = static_cast<double>(range);
  return kUnmet / (r * r) >= energy_that_counts(echoes, returns);
}

}  // namespace

/// What all sub-rays of a scan are traced with.
struct Footprint::Task {
  const WideBeams& beams;
  const Renderer& renderer;
  const ReturnModel& returns;
  std::span<Echoes> echoes;
  const Executor& executor;
};

Footprint::Footprint(const OpticsSettings& optics)
    : sub_rays_(optics.sub_rays),
      sigma_across_(static_cast<float>(optics.divergence_horizontal_deg * kDegree / kFwhmPerSigma)),
      sigma_up_(static_cast<float>(optics.divergence_vertical_deg * kDegree / kFwhmPerSigma)),
      merge_(static_cast<float>(0.5 * kLightSpeed * 1e-9 * optics.pulse_ns)),
      turns_() {
  if (sigma_across_ <= 0.0f && sigma_up_ <= 0.0f) sub_rays_ = 1;
  if (is_line()) return;
  if (sub_rays_ <= static_cast<std::int64_t>(kSubRays)) levels_.push_back(rim());
  if (sub_rays_ == 0) {
    for (const std::size_t count : kMore) levels_.push_back(spread(count));
  } else if (sub_rays_ > static_cast<std::int64_t>(kSubRays)) {
    const auto wanted = static_cast<std::size_t>(sub_rays_);
    levels_.push_back(spread((wanted + kSubRays - 1) / kSubRays * kSubRays));
  }
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const double angle = 2.0 * kPi * kGolden * static_cast<double>(i);
    turns_[i] = {static_cast<float>(math::cos(angle)), static_cast<float>(math::sin(angle))};
  }
}

/// The middle and seven on the rim, with the shares that give the cross-section's second moment:
/// 1.374 sigma^2 of distance squared.
std::vector<Footprint::SubRay> Footprint::rim() {
  constexpr double kAround = kSubRays - 1;
  const double end = 0.5 * kRadius * kRadius;
  const double left = math::exp(-end);
  const double moment = 2.0 * (1.0 - left * (1.0 + end)) / (1.0 - left);
  const double on_rim = moment / (kRim * kRim);
  std::vector<SubRay> sub_rays = {{0.0f, 0.0f, static_cast<float>(1.0 - on_rim)}};
  for (std::size_t i = 1; i < kSubRays; ++i) {
    const double angle = 2.0 * kPi * static_cast<double>(i - 1) / kAround;
    sub_rays.push_back({static_cast<float>(kRim * math::cos(angle)),
                        static_cast<float>(kRim * math::sin(angle)),
                        static_cast<float>(on_rim / kAround)});
  }
  return sub_rays;
}

/// So many, evenly over the cross-section (a sunflower's seeds), with the Gaussian's shares: what
/// is on the rim is met as surely as what is in the middle. Eight that follow each other lie in one
/// sector, as far as possible.
std::vector<Footprint::SubRay> Footprint::spread(std::size_t count) {
  struct Seed {
    double x, y, share, angle;
  };
  std::vector<Seed> seeds(count);
  double all = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double r =
        kRadius * std::sqrt((static_cast<double>(i) + 0.5) / static_cast<double>(count));
    const double turns = kGolden * static_cast<double>(i);
    const double angle = 2.0 * kPi * (turns - std::floor(turns));
    seeds[i] = {r * math::cos(angle), r * math::sin(angle), math::exp(-0.5 * r * r), angle};
    all += seeds[i].share;
  }
  std::sort(
      seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) { return a.angle < b.angle; });
  std::vector<SubRay> sub_rays;
  sub_rays.reserve(count);
  for (const Seed& seed : seeds) {
    sub_rays.push_back({static_cast<float>(seed.x),
                        static_cast<float>(seed.y),
                        static_cast<float>(seed.share / all)});
  }
  return sub_rays;
}

/// The sub-rays of one beam in the world.
void Footprint::aim(const WideBeams& beams,
                    std::size_t beam,
                    std::span<const SubRay> sub_rays,
                    std::span<Ray> rays) const {
  const Ray& middle = beams.middles.rays[beam];
  const Vector3f across = beams.across[beam];
  const Vector3f up = middle.direction_world.cross(across);
  const auto [c, s] = turns_[beam % turns_.size()];
  for (std::size_t i = 0; i < sub_rays.size(); ++i) {
    const float x = sigma_across_ * (c * sub_rays[i].x - s * sub_rays[i].y);
    const float y = sigma_up_ * (s * sub_rays[i].x + c * sub_rays[i].y);
    rays[i] = middle;
    rays[i].direction_world = (middle.direction_world + x * across + y * up).normalized();
  }
}

/// Makes one beam's echoes of what its sub-rays met. `known`: the nearest that reaches between
/// them, m. True if the beam needs more of them.
bool Footprint::judge(std::size_t level,
                      std::span<BeamPart> parts,
                      float known,
                      float range_max,
                      const ReturnModel& returns,
                      Echoes& echoes) const {
  const float met = std::min(nearest_of(parts), range_max);
  bool in_doubt = false;
  if (level == 0 && lie_in_plane(parts, levels_[level])) {
    echoes = {};
    echoes.count = 1;
    echoes.all[0] = merged(parts);
  } else {
    const Echoes before = echoes;
    echoes = echoes_of(parts, merge_);
    in_doubt = level == 0 ? is_in_doubt(echoes, returns) : may_lack(before, echoes, returns);
  }
  // what so many have not met by then is no surface, only surfels
  const bool has_more = parts.size() <= kEnough && known < met - kBefore;
  return in_doubt || (has_more && may_count(known, echoes, returns));
}

/// Finds the echoes of these beams; returns those that need more sub-rays.
std::vector<std::uint32_t> Footprint::trace_with(const Task& task,
                                                 std::size_t level,
                                                 std::span<const std::uint32_t> beams) const {
  const RayBatch& middles = task.beams.middles;
  const std::span<const SubRay> sub_rays = levels_[level];
  const std::size_t n = sub_rays.size();
  const std::size_t groups = n / kSubRays;
  const std::size_t at_once = std::max<std::size_t>(1, kRaysAtOnce / n);
  std::vector<Ray> rays;
  std::vector<Duration> offsets;
  std::vector<Hit> hits;
  std::vector<float> nearest;
  std::vector<std::uint8_t> wants_more;
  std::vector<std::uint32_t> more;
  for (std::size_t from = 0; from < beams.size(); from += at_once) {
    const std::span now = beams.subspan(from, std::min(at_once, beams.size() - from));
    rays.resize(now.size() * n);
    hits.resize(rays.size());
    nearest.resize(now.size() * groups);
    wants_more.assign(now.size(), 0);
    offsets.resize(middles.time_offsets.empty() ? 0 : rays.size());
    task.executor.parallel_for(now.size(), kBeamsPerChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        aim(task.beams, now[b], sub_rays, std::span(rays).subspan(b * n, n));
        if (offsets.empty()) continue;
        std::fill_n(&offsets[b * n], n, middles.time_offsets[now[b]]);
      }
    });
    RayBatch batch = middles;
    batch.rays = rays;
    batch.order = {};
    batch.time_offsets = offsets;
    task.renderer.render_footprints(batch, hits, nearest, task.executor);

    task.executor.parallel_for(now.size(), kBeamsPerChunk, [&](std::size_t begin, std::size_t end) {
      std::vector<BeamPart> parts(n);
      for (std::size_t b = begin; b < end; ++b) {
        for (std::size_t i = 0; i < n; ++i) {
          parts[i] = part_of(hits[b * n + i], sub_rays[i].share, i, task.returns);
        }
        const float known = *std::min_element(&nearest[b * groups], &nearest[b * groups] + groups);
        const float range_max = middles.rays[now[b]].range_max;
        wants_more[b] =
            judge(level, parts, known, range_max, task.returns, task.echoes[now[b]]) ? 1 : 0;
      }
    });
    for (std::size_t b = 0; b < now.size(); ++b) {
      if (wants_more[b] != 0) more.push_back(now[b]);
    }
  }
  return more;
}

void Footprint::trace(const WideBeams& beams,
                      const Renderer& renderer,
                      const ReturnModel& returns,
                      std::span<Echoes> echoes,
                      const Executor& executor) const {
  std::vector<std::uint32_t> own_order;
  std::span<const std::uint32_t> order = beams.middles.order;
  if (order.size() != beams.middles.rays.size()) {
    own_order = direction_order(beams.middles.rays, executor);
    order = own_order;
  }
  const Task task{beams, renderer, returns, echoes, executor};
  std::vector<std::uint32_t> more(order.begin(), order.end());
  for (std::size_t level = 0; level < levels_.size() && !more.empty(); ++level) {
    more = trace_with(task, level, more);
  }
}

}  // namespace pointflight
