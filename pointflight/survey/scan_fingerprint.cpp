#include "pointflight/survey/scan_fingerprint.hpp"

#include <algorithm>
#include <iterator>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/hash.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kSamples = 16;  // of a scan's ranges
constexpr double kStep = 0.05;        // m

}  // namespace

std::uint64_t scan_fingerprint(std::span<const SurveyRay> rays) {
  std::vector<float> ranges;
  for (const SurveyRay& ray : rays) {
    if (ray.is_return) ranges.push_back(ray.range);
  }
  std::vector<std::int64_t> seen = {static_cast<std::int64_t>(ranges.size())};
  for (std::size_t k = 0; k < std::min(kSamples, ranges.size()); ++k) {
    const float range = ranges[k * ranges.size() / std::min(kSamples, ranges.size())];
    seen.push_back(floor_to_integer(static_cast<double>(range) / kStep));
  }
  return hash64(std::as_bytes(std::span(seen)));
}

std::vector<std::uint64_t> scan_fingerprints(const SurveyOpener& survey) {
  std::vector<std::uint64_t> fingerprints;
  std::vector<SurveyRay> batch;
  std::vector<SurveyRay> rays;  // of one scan
  const auto reader = survey();
  std::size_t scan = 0;
  const auto close = [&] {
    if (!rays.empty()) fingerprints.push_back(scan_fingerprint(rays));
    rays.clear();
  };
  while (reader->read(batch)) {
    if (reader->scan() != scan) close();
    scan = reader->scan();
    std::copy_if(batch.begin(), batch.end(), std::back_inserter(rays), [](const SurveyRay& ray) {
      return ray.is_return;
    });
  }
  close();
  std::sort(fingerprints.begin(), fingerprints.end());
  return fingerprints;
}

}  // namespace pointflight
