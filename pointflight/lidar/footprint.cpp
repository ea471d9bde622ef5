#include "pointflight/lidar/footprint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/render/internal/direction_order.hpp"

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
constexpr float kBefore = 0.3f;    // m, nearer than what sub-rays hit

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

/// Parts that hit one plane: there the inverse of the range is linear across the beam.
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
    xx += sub_rays[i].x * sub_rays[i].x;  // the same in y, and none in x y: positions on a circle
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
  return returns.is_marginal(echo, std::max(0.0, 1.0 - chance), 1.0 + chance);
}

/// The energy below which an echo is not reported, whatever its sub-rays: if one counts, the
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

/// True if more sub-rays may find another number of echoes that are reported: few hit one of them,
/// or what fewer had hit between them is gone.
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
    return left * energy_of(echo) >= counts && returns.is_marginal(echo, 0.0, left);
  };
  return std::any_of(before.span().begin(), before.span().end(), is_missed);
}

/// True if a surface at a range may be reported that no sub-ray hit.
bool may_count(float range, const Echoes& echoes, const ReturnModel& returns) {
  constexpr double kUnmet = 0.3;  // of the light at most, of a white surface
  const auto r = static_cast<double>(range);
  return kUnmet / (r * r) >= energy_that_counts(echoes, returns);
}

}  // namespace

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
/// is on the rim is hit as surely as what is in the middle. Eight that follow each other lie in one
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

/// Makes one beam's echoes of what its sub-rays hit. `known`: the nearest that reaches between
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
  // what so many have not hit by then is no surface, only surfels
  const bool has_more = parts.size() <= kEnough && known < met - kBefore;
  return in_doubt || (has_more && may_count(known, echoes, returns));
}

FootprintRounds::FootprintRounds(const Footprint& footprint,
                                 const WideBeams& beams,
                                 const ReturnModel& returns,
                                 std::span<Echoes> echoes)
    : footprint_(footprint), beams_(beams), returns_(returns), echoes_(echoes) {}

std::optional<RenderJob> FootprintRounds::next(const Executor& executor) {
  const RayBatch& middles = beams_.middles;
  if (!std::exchange(has_begun_, true)) {
    wanted_.assign(middles.order.begin(), middles.order.end());
    if (wanted_.size() != middles.rays.size()) wanted_ = direction_order(middles.rays, executor);
  }
  if (done_ == wanted_.size()) {
    ++level_;
    done_ = 0;
    wanted_ = std::exchange(more_, {});
  }
  if (wanted_.empty() || level_ == footprint_.levels_.size()) return std::nullopt;
  const std::span<const Footprint::SubRay> sub_rays = footprint_.levels_[level_];
  const std::size_t n = sub_rays.size();
  const std::size_t at_once = std::max<std::size_t>(1, kRaysAtOnce / n);
  now_ = std::span(wanted_).subspan(done_, std::min(at_once, wanted_.size() - done_));
  done_ += now_.size();
  rays_.resize(now_.size() * n);
  hits_.resize(rays_.size());
  nearest_.resize(rays_.size() / kSubRays);
  offsets_.resize(middles.time_offsets.empty() ? 0 : rays_.size());
  executor.parallel_for(now_.size(), kBeamsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      footprint_.aim(beams_, now_[b], sub_rays, std::span(rays_).subspan(b * n, n));
      if (offsets_.empty()) continue;
      std::fill_n(&offsets_[b * n], n, middles.time_offsets[now_[b]]);
    }
  });
  RenderJob job{middles, hits_, nearest_};
  job.batch.rays = rays_;
  job.batch.order = {};
  job.batch.time_offsets = offsets_;
  return job;
}

void FootprintRounds::receive(const Executor& executor) {
  const std::span<const Footprint::SubRay> sub_rays = footprint_.levels_[level_];
  const std::size_t n = sub_rays.size();
  const std::size_t groups = n / kSubRays;
  std::vector<std::uint8_t> wants_more(now_.size(), 0);
  executor.parallel_for(now_.size(), kBeamsPerChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<BeamPart> parts(n);
    for (std::size_t b = begin; b < end; ++b) {
      for (std::size_t i = 0; i < n; ++i) {
        parts[i] = part_of(hits_[b * n + i], sub_rays[i].share, i, returns_);
      }
      const auto nearest = std::span(nearest_).subspan(b * groups, groups);
      const float known = *std::min_element(nearest.begin(), nearest.end());
      const float range_max = beams_.middles.rays[now_[b]].range_max;
      const bool more =
          footprint_.judge(level_, parts, known, range_max, returns_, echoes_[now_[b]]);
      wants_more[b] = more ? 1 : 0;
    }
  });
  for (std::size_t b = 0; b < now_.size(); ++b) {
    if (wants_more[b] != 0) more_.push_back(now_[b]);
  }
}

void Footprint::trace(const WideBeams& beams,
                      const Renderer& renderer,
                      const ReturnModel& returns,
                      std::span<Echoes> echoes,
                      const Executor& executor) const {
  FootprintRounds rounds(*this, beams, returns, echoes);
  while (const std::optional<RenderJob> job = rounds.next(executor)) {
    renderer.render({&*job, 1}, executor);
    rounds.receive(executor);
  }
}

}  // namespace pointflight
