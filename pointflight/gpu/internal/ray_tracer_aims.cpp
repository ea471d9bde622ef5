// What a device is sent of aims, whose rays it makes itself: lines, and wide beams.
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "pointflight/gpu/internal/device_aim.hpp"
#include "pointflight/gpu/internal/ray_tracer.hpp"
#include "pointflight/render/internal/sub_rays.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kListBytes =
    std::uint64_t{4} * device::kMostTouched * device::kTouchedNumbers;
constexpr std::uint64_t kMoreBytes = std::uint64_t{12} * device::kSecondLevel;
constexpr std::size_t kBeamsPerMore = 16;         // of which one has room for its second level
constexpr std::uint64_t kMostThreads = 1u << 16;  // of wide beams: each has a list
constexpr std::size_t kMostWide = std::size_t{1} << 19;             // beams at a time
constexpr std::size_t kMostWideOfProcessor = std::size_t{1} << 14;  // the same

static_assert(sizeof(MapRay) == sizeof(device::DeviceRay));
static_assert(sizeof(SensorBeam) == sizeof(device::DeviceBeam));
static_assert(SecondLevel::kCount == device::kSecondLevel);
static_assert(sizeof(BeamPose) == 4 * device::kPoseWords);
static_assert(sizeof(device::DeviceAim) == 4 * device::kAimWords);

}  // namespace

/// Puts aims where a slot's upload begins, and behind them tables and the beams if it has not got
/// them. `needs` says the rest of what there must be room for; returns what there is to send.
RayTracer::Needs RayTracer::take_aims(Slot& slot,
                                      const KernelMap& map,
                                      const AimedPart& part,
                                      std::span<const std::uint32_t> tables,
                                      Needs needs) {
  const std::size_t count = part.beams->beams.size();
  std::size_t words = part.aims.size() * device::kAimWords;
  for (const AimedBeams* aim : part.aims) {
    words += aim->poses.size() * device::kPoseWords + 2 * aim->deviations.size();
  }
  needs.given = 4 * words;
  needs.tables = tables.size_bytes();
  needs.beams = count * sizeof(SensorBeam);
  make_room(slot, needs);
  auto* const given = slot.upload.as<std::uint32_t>(words).data();
  auto* const aims = reinterpret_cast<device::DeviceAim*>(given);
  std::size_t at = part.aims.size() * device::kAimWords;
  const auto append = [&](const auto& all) {
    const std::size_t begin = at;
    if (!all.empty()) std::memcpy(given + at, all.data(), all.size() * sizeof all[0]);
    at += all.size() * sizeof all[0] / 4;
    return static_cast<std::uint32_t>(begin);
  };
  for (std::size_t i = 0; i < part.aims.size(); ++i) {
    const AimedBeams& aim = *part.aims[i];
    const std::uint32_t poses = append(aim.poses);
    aims[i] = device_aim(map, aim, poses, append(aim.deviations));
  }
  if (!tables.empty()) std::memcpy(given + words, tables.data(), tables.size_bytes());
  slot.call = {};
  slot.call.count = static_cast<std::uint32_t>(count * part.aims.size());
  slot.call.beams = static_cast<std::uint32_t>(count);
  slot.call.has_origins = part.beams->has_origins ? 1 : 0;
  if (slot.has_beams == part.beams) {
    needs.beams = 0;
    return needs;
  }
  const std::span all(part.beams->beams);
  auto* const beams = reinterpret_cast<SensorBeam*>(given + words + tables.size());
  const bool has_order = part.beams->order.size() == count;
  for (std::size_t i = 0; i < count; ++i) beams[i] = all[has_order ? part.beams->order[i] : i];
  slot.has_beams = part.beams;
  return needs;
}

void RayTracer::submit(std::size_t number, const KernelMap& map, const AimedPart& part) {
  Slot& slot = slots_[number];
  const std::uint64_t per_ray = part.wants_ranges ? sizeof(float) : sizeof(device::DeviceHit);
  const std::size_t rays = part.beams->beams.size() * part.aims.size();
  const Needs needs = take_aims(slot, map, part, {}, {.results = rays * per_ray});
  slot.call.wants_ranges = part.wants_ranges ? 1 : 0;
  send(slot, needs);
}

void RayTracer::submit(std::size_t number, const KernelMap& map, const WidePart& part) {
  Slot& slot = slots_[number];
  const std::size_t beams = part.aimed.beams->beams.size() * part.aimed.aims.size();
  const std::uint32_t threads = wide_threads(beams);
  const std::size_t most_more = std::max<std::size_t>(256, beams / kBeamsPerMore);
  const Needs needs = take_aims(slot,
                                map,
                                part.aimed,
                                part.tables,
                                {.results = beams * sizeof(device::WideResult),
                                 .more = most_more * kMoreBytes,
                                 .lists = std::uint64_t{threads} * kListBytes});
  slot.call.threads = threads;
  slot.call.most_more = static_cast<std::uint32_t>(most_more);
  slot.call.sigma_across = part.sigma_across;
  slot.call.sigma_up = part.sigma_up;
  slot.call.per_intensity = part.reflectances.per_intensity;
  slot.call.same = part.reflectances.same;
  slot.call.least = part.reflectances.least;
  send(slot, needs);
}

/// As many invocations as there is room for lists, or on processors, whose loops must be short, as
/// there are beams.
std::uint32_t RayTracer::wide_threads(std::size_t beams) const {
  const std::uint64_t room =
      std::min(device_.info().largest_buffer, device_.info().memory / 16) / kListBytes;
  const std::uint64_t most = device_.info().is_processor ? kMostWideOfProcessor : kMostThreads;
  const std::uint64_t threads =
      std::min({std::uint64_t{beams}, std::max<std::uint64_t>(room, kGroupSize), most});
  return static_cast<std::uint32_t>((threads + kGroupSize - 1) / kGroupSize * kGroupSize);
}

std::size_t RayTracer::wide_at_once() const {
  return device_.info().is_processor ? kMostWideOfProcessor : kMostWide;
}

std::span<const device::WideResult> RayTracer::wide_results(std::size_t slot) const {
  return slots_[slot].read_back.as<const device::WideResult>(slots_[slot].call.count);
}

bool RayTracer::has_second_level(std::size_t slot, const device::WideResult& result) const {
  return result.surfel < slots_[slot].call.most_more && result.sub_ray / 2 < kStripDirections;
}

SecondLevel RayTracer::second_level(std::size_t slot, const device::WideResult& result) const {
  const Slot& own = slots_[slot];
  const std::span all = own.read_back.as<const std::byte>(own.sent.results + own.sent.more);
  const std::byte* const at = all.data() + own.sent.results + result.surfel * kMoreBytes;
  SecondLevel hits{};
  std::memcpy(hits.ranges.data(), at, sizeof hits.ranges);
  std::memcpy(hits.cosines.data(), at + sizeof hits.ranges, sizeof hits.cosines);
  std::memcpy(hits.words.data(), at + 2 * sizeof hits.ranges, sizeof hits.words);
  hits.direction = result.sub_ray / 2;
  hits.has_before = result.sub_ray % 2 == 1;
  return hits;
}

}  // namespace pointflight
