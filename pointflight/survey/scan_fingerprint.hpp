// What tells scans apart, so that a comparison can say which of them a map was fitted to.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// Tells scans apart, wherever they lie: by the number of their returns and some of their ranges,
/// to 5 cm. Of a scan's returns in their order; other rays do not count.
std::uint64_t scan_fingerprint(std::span<const SurveyRay> rays);

/// Of all scans of a survey that have returns, in ascending order.
std::vector<std::uint64_t> scan_fingerprints(const SurveyOpener& survey);

}  // namespace pointflight
