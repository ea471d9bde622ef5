#include "pointflight/gpu/internal/device_batch.hpp"

#include <algorithm>
#include <cstring>

#include "pointflight/core/cpu_account.hpp"
#include "pointflight/gpu/internal/wide_tables.hpp"
#include "pointflight/render/internal/body_renderer.hpp"
#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPackChunk = 4096;  // rays
constexpr std::size_t kMost = RayTracer::kMostRays;

/// Rays of parts one after the other: calls `action(part, from, to, at)` for each part's share of
/// [begin, end); `at`: of the first, in all.
template <class Parts, class SizeOf, class Action>
void for_shares(const Parts& parts,
                std::size_t begin,
                std::size_t end,
                const SizeOf& size_of,
                const Action& action) {
  std::size_t first = 0;
  for (const auto& part : parts) {
    const std::size_t size = size_of(part);
    const std::size_t from = std::max(begin, first);
    const std::size_t to = std::min(end, first + size);
    if (from < to) action(part, from - first, to - first, from);
    first += size;
    if (first >= end) return;
  }
}

constexpr auto size_of_part = [](const auto& part) { return part.order.size(); };

/// Whoever is charged with a job.
CpuAccount* account_of(const RenderJob& job) {
  return job.account != nullptr ? job.account : ChargeTo::current();
}

}  // namespace

DeviceBatch::DeviceBatch(std::span<const RenderJob> jobs,
                         const BeamRenderer& beam,
                         const AtOnce& at_once,
                         const Executor& executor)
    : beam_(beam), at_once_(at_once), executor_(executor) {
  lines_.reserve(jobs.size());  // parts refer to them
  for (const RenderJob& job : jobs) {
    if (!takes(job) || job.batch.size() == 0) continue;
    if (job.wide) {
      add_wide(job);
      continue;
    }
    lines_.push_back(job);
    if (!job.batch.bodies.empty()) {
      const ChargeTo charge(account_of(job));
      among_bodies_.push_back(std::make_unique<ExpandedJob>(job, executor));
      lines_.back().hits = among_bodies_.back()->job().hits;
      lines_.back().ranges = {};
    }
    if (job.batch.aimed != nullptr && job.batch.size() <= kMost) {
      add_aims(lines_.back());
    } else {
      add_rays(lines_.back());
    }
  }
}

bool DeviceBatch::takes(const RenderJob& job) {
  return !job.wide || (job.batch.aimed != nullptr && BeamRenderer::are_cones(*job.wide) &&
                       job.batch.size() <= kMost);
}

void DeviceBatch::add_wide(const RenderJob& job) {
  wide_.push_back(std::make_unique<WideJob>(job));
  WideJob* const own = wide_.back().get();
  const WideBeams& wide = *own->job.wide;
  const AimedBeams& aim = *own->job.batch.aimed;
  const Reflectances r = wide.receiver->reflectances();
  auto* last = parts_.empty() ? nullptr : std::get_if<WideAimPart>(&parts_.back());
  const auto fits = [&](const WidePart& part) {
    const Reflectances& q = part.reflectances;
    return part.aimed.beams == aim.beams && part.sigma_across == wide.sigma_across &&
           part.sigma_up == wide.sigma_up && q.per_intensity == r.per_intensity &&
           q.same == r.same && q.usual == r.usual && q.least == r.least &&
           (last->jobs.size() + 1) * job.batch.size() <= at_once_.wide;
  };
  if (last == nullptr || !fits(last->wide)) {
    WidePart part{{aim.beams, {}, false},
                  wide.sigma_across,
                  wide.sigma_up,
                  r,
                  wide_tables(*beam_.scene().map, r)};
    parts_.emplace_back(WideAimPart{std::move(part), {}});
    last = &std::get<WideAimPart>(parts_.back());
  }
  last->wide.aimed.aims.push_back(&aim);
  last->jobs.push_back(own);
}

void DeviceBatch::add_aims(const RenderJob& job) {
  const AimedBeams& aim = *job.batch.aimed;
  const bool wants_ranges = !job.ranges.empty();
  auto* last = parts_.empty() ? nullptr : std::get_if<AimPart>(&parts_.back());
  const bool fits = last != nullptr && last->aimed.beams == aim.beams &&
                    last->aimed.wants_ranges == wants_ranges &&
                    (last->jobs.size() + 1) * job.batch.size() <= at_once_.lines;
  if (!fits) {
    parts_.emplace_back(AimPart{{aim.beams, {}, wants_ranges}, {}});
    last = &std::get<AimPart>(parts_.back());
  }
  last->aimed.aims.push_back(&aim);
  last->jobs.push_back(&job);
}

void DeviceBatch::add_rays(const RenderJob& job) {
  std::span<const std::uint32_t> order = job.batch.order;
  if (order.empty()) {
    const std::vector<MapRay> rays = map_rays(beam_.kernel_map(), job.batch, executor_);
    orders_.push_back(direction_order(std::span<const MapRay>(rays), executor_));
    order = orders_.back();
  }
  const auto size_of = [](const std::vector<RayPart>& part) {
    std::size_t size = 0;
    for (const RayPart& rays : part) size += rays.order.size();
    return size;
  };
  while (!order.empty()) {
    auto* last = parts_.empty() ? nullptr : std::get_if<std::vector<RayPart>>(&parts_.back());
    if (last == nullptr || size_of(*last) == kMost) {
      parts_.emplace_back(std::vector<RayPart>{});
      last = &std::get<std::vector<RayPart>>(parts_.back());
    }
    const std::size_t some = std::min(order.size(), kMost - size_of(*last));
    last->push_back({&job, order.first(some)});
    order = order.subspan(some);
  }
}

const SensorBeams* DeviceBatch::beams_of(std::size_t part) const {
  if (const auto* aims = std::get_if<AimPart>(&parts_[part])) return aims->aimed.beams.get();
  const auto* wide = std::get_if<WideAimPart>(&parts_[part]);
  return wide != nullptr ? wide->wide.aimed.beams.get() : nullptr;
}

void DeviceBatch::finish() {
  executor_.parallel_for(wide_.size(), 1, [&](std::size_t k, std::size_t) {
    const ChargeTo charge(account_of(wide_[k]->job));
    std::vector<std::uint32_t>& left = wide_[k]->left;
    std::sort(left.begin(), left.end());  // whichever thread noted them first
    beam_.finish_cones(wide_[k]->job, left, executor_);
  });
  for (const auto& job : among_bodies_) {
    const ChargeTo charge(account_of(job->job()));
    render_bodies(job->job().batch, job->job().hits, executor_);
    job->finish();
  }
}

void DeviceBatch::send(std::size_t part, std::size_t slot, RayTracer& tracer) const {
  if (const auto* aims = std::get_if<AimPart>(&parts_[part])) {
    tracer.submit(slot, beam_.kernel_map(), aims->aimed);
    return;
  }
  if (const auto* wide = std::get_if<WideAimPart>(&parts_[part])) {
    tracer.submit(slot, beam_.kernel_map(), wide->wide);
    return;
  }
  const auto& rays = std::get<std::vector<RayPart>>(parts_[part]);
  std::size_t count = 0;
  for (const RayPart& some : rays) count += some.order.size();
  const std::span packed = tracer.rays(slot, count);
  executor_.parallel_for_under_lock(count, kPackChunk, [&](std::size_t begin, std::size_t end) {
    const auto pack = [&](const RayPart& some, std::size_t from, std::size_t to, std::size_t at) {
      const ChargeTo charge(account_of(*some.job));
      for (std::size_t i = from; i < to; ++i) {
        packed[at + i - from] = map_ray(beam_.kernel_map(), some.job->batch, some.order[i]);
      }
    };
    for_shares(rays, begin, end, size_of_part, pack);
  });
  tracer.submit(slot, count);
}

void DeviceBatch::write(const RenderJob& job, std::size_t ray, const device::DeviceHit& hit) const {
  const bool is_too_much = hit.range == device::kTooMany;
  const Hit made = is_too_much ? beam_.trace(map_ray(beam_.kernel_map(), job.batch, ray))
                               : beam_.hit_of({hit.range, hit.cosine, hit.surfel});
  if (job.ranges.empty()) {
    job.hits[ray] = made;
  } else {
    job.ranges[ray] = made.range;
  }
}

void DeviceBatch::take(std::size_t part, std::size_t slot, const RayTracer& tracer) {
  std::visit([&](const auto& own) { take(own, slot, tracer); }, parts_[part]);
}

void DeviceBatch::take(const std::vector<RayPart>& part,
                       std::size_t slot,
                       const RayTracer& tracer) const {
  const std::span hits = tracer.hits(slot);
  executor_.parallel_for_under_lock(
      hits.size(), kPackChunk, [&](std::size_t begin, std::size_t end) {
        const auto write_some =
            [&](const RayPart& some, std::size_t from, std::size_t to, std::size_t at) {
              const ChargeTo charge(account_of(*some.job));
              for (std::size_t i = from; i < to; ++i) {
                write(*some.job, some.order[i], hits[at + i - from]);
              }
            };
        for_shares(part, begin, end, size_of_part, write_some);
      });
}

void DeviceBatch::take(const AimPart& part, std::size_t slot, const RayTracer& tracer) const {
  const std::size_t beams = part.aimed.beams->beams.size();
  const std::size_t count = beams * part.jobs.size();
  executor_.parallel_for_under_lock(count, kPackChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end;) {
      const RenderJob& job = *part.jobs[at / beams];
      const ChargeTo charge(account_of(job));
      const std::size_t from = at % beams;
      const std::size_t some = std::min(end - at, beams - from);
      if (part.aimed.wants_ranges) {
        const std::span<const float> ranges = tracer.ranges(slot).subspan(at, some);
        std::memcpy(&job.ranges[from], ranges.data(), ranges.size_bytes());
        for (std::size_t i = 0; i < some; ++i) {
          if (ranges[i] == device::kTooMany) write(job, from + i, {device::kTooMany, 0.0f, 0u});
        }
      } else {
        const std::span<const device::DeviceHit> hits = tracer.hits(slot).subspan(at, some);
        for (std::size_t i = 0; i < some; ++i) write(job, from + i, hits[i]);
      }
      at += some;
    }
  });
}

void DeviceBatch::take(const WideAimPart& part, std::size_t slot, const RayTracer& tracer) const {
  const std::size_t beams = part.wide.aimed.beams->beams.size();
  const std::span results = tracer.wide_results(slot);
  const std::size_t count = beams * part.jobs.size();
  executor_.parallel_for_under_lock(count, kPackChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end;) {
      WideJob& own = *part.jobs[at / beams];
      const ChargeTo charge(account_of(own.job));
      const std::size_t first = at - at % beams;
      const std::size_t until = std::min(end, first + beams);
      std::vector<std::uint32_t> left;
      for (; at < until; ++at) {
        if (write_wide(own.job, at - first, results[at], slot, tracer)) continue;
        left.push_back(static_cast<std::uint32_t>(at - first));
      }
      const std::lock_guard lock(own.mutex);
      own.left.insert(own.left.end(), left.begin(), left.end());
    }
  });
}

/// False if the processor is to trace the beam.
bool DeviceBatch::write_wide(const RenderJob& job,
                             std::size_t beam,
                             const device::WideResult& result,
                             std::size_t slot,
                             const RayTracer& tracer) const {
  const WideBeams& wide = *job.wide;
  Echoes& echoes = wide.echoes[beam];
  switch (result.kind) {
    case device::kNoEcho:
      echoes.count = 0;
      echoes.all_hit = false;
      return true;
    case device::kOneEchoOfAll:
      echoes.count = 1;
      echoes.all_hit = true;
      echoes.all[0] = {
          .range = result.range,
          .reflectivity = result.reflectivity,
          .intensity = result.intensity,
          .label = kMapLabel,
          .parts = 8,
          .depth = result.depth,
          .origin = {result.cosine, result.surfel, static_cast<std::uint16_t>(result.sub_ray)}};
      return is_sure_of(wide, echoes.all[0]);
    case device::kMoreSubRays:
      if (!tracer.has_second_level(slot, result)) return false;
      return find_second_level_echoes(
          *beam_.scene().map, wide, tracer.second_level(slot, result), echoes);
    default:
      return false;
  }
}

}  // namespace pointflight
