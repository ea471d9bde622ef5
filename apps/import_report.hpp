#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/survey/resolution_search.hpp"

namespace pointflight::apps {

/// How far the points lie apart, and whether the resolution is finer.
std::string about_spacing(double spacing, double resolution, double supported);

/// The resolutions that were tried, on stderr; `judged_by`: "what left out scans saw".
void print_tried(const std::vector<TriedResolution>& tried, std::string_view judged_by);

/// How noisy flat surfaces were, and what became of it.
std::string about_noise(double noise, std::uint64_t projected, std::uint64_t too_thick);

/// What an import found and did, on stderr.
void print_report(const ImportReport& report, const ImportOptions& options);

}  // namespace pointflight::apps
