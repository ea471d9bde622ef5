#include "pointflight/io/internal/column_names.hpp"

#include <algorithm>
#include <string_view>

#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

struct KnownName {
  std::string_view name;
  ColumnRole role;
};

// of one role the first that a file has
constexpr KnownName kKnownNames[] = {
    {"x", ColumnRole::kX},
    {"y", ColumnRole::kY},
    {"z", ColumnRole::kZ},
    {"intensity", ColumnRole::kIntensity},
    {"intensities", ColumnRole::kIntensity},
    {"reflectivity", ColumnRole::kIntensity},
    {"reflectance", ColumnRole::kIntensity},
    {"i", ColumnRole::kIntensity},
    {"amplitude", ColumnRole::kIntensity},
    {"time", ColumnRole::kTime},
    {"t", ColumnRole::kTime},
    {"timestamp", ColumnRole::kTime},
    {"time_stamp", ColumnRole::kTime},
    {"offset_time", ColumnRole::kTime},
    {"ring", ColumnRole::kRing},
    {"line", ColumnRole::kRing},
    {"channel", ColumnRole::kRing},
    {"red", ColumnRole::kRed},
    {"r", ColumnRole::kRed},
    {"diffuse_red", ColumnRole::kRed},
    {"green", ColumnRole::kGreen},
    {"g", ColumnRole::kGreen},
    {"diffuse_green", ColumnRole::kGreen},
    {"blue", ColumnRole::kBlue},
    {"b", ColumnRole::kBlue},
    {"diffuse_blue", ColumnRole::kBlue},
    {"rgb", ColumnRole::kPackedColor},
    {"rgba", ColumnRole::kPackedColor},
};

constexpr std::string_view kScalar = "scalar_";

// scalar fields that are surely something else
constexpr std::string_view kNoIntensities[] = {
    "gpstime", "gps_time",  "gps",         "return",     "number", "class",     "label",
    "normal",  "nx",        "ny",          "nz",         "scan",   "angle",     "distance",
    "source",  "index",     "id",          "user",       "edge",   "curvature", "roughness",
    "density", "planarity", "verticality", "height",     "coord",  "range",     "segment",
    "error",   "c2c",       "c2m",         "confidence", "echo",   "row",       "column"};

bool may_be_intensity(std::string_view scalar) {
  return std::none_of(std::begin(kNoIntensities),
                      std::end(kNoIntensities),
                      [&](std::string_view word) { return scalar.find(word) != scalar.npos; });
}

/// Padding in PCD files.
bool is_padding(const std::string& name) {
  return name.empty() || name == "_";
}

}  // namespace

NamedColumns::NamedColumns(const std::vector<std::string>& names) {
  std::vector<std::string> plain;
  for (const std::string& name : names) {
    const std::string lower = lower_case(name);
    plain.push_back(lower.starts_with(kScalar) ? lower.substr(kScalar.size()) : lower);
  }
  std::vector<bool> is_used(names.size(), false);
  for (const KnownName& known : kKnownNames) {
    auto& column = columns_[static_cast<std::size_t>(known.role)];
    const auto found = std::find(plain.begin(), plain.end(), known.name);
    if (column || found == plain.end()) continue;
    column = static_cast<std::size_t>(found - plain.begin());
    is_used[*column] = true;
  }
  auto& intensity = columns_[static_cast<std::size_t>(ColumnRole::kIntensity)];
  if (!intensity) {
    std::vector<std::size_t> scalars;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const bool is_scalar = lower_case(names[i]).starts_with(kScalar);
      if (!is_used[i] && is_scalar && may_be_intensity(plain[i])) scalars.push_back(i);
    }
    if (scalars.size() == 1) {
      intensity = scalars.front();
      is_used[*intensity] = true;
    }
  }
  if (intensity) about_.intensity = names[*intensity];
  for (const ColumnRole role : {ColumnRole::kTime, ColumnRole::kRing}) {
    if (const auto column = find(role)) about_.of_scans.push_back(names[*column]);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!is_used[i] && !is_padding(names[i])) about_.left_out.push_back(names[i]);
  }
}

}  // namespace pointflight
