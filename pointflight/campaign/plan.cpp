#include "pointflight/campaign/plan.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/internal/yaml_document-inl.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

std::string drawn_text(const StudyDraw& draw, double share) {
  if (!draw.choices.empty()) {
    const auto count = static_cast<double>(draw.choices.size());
    const auto at = static_cast<std::size_t>(share * count);
    return draw.choices[std::min(at, draw.choices.size() - 1)];
  }
  if (draw.is_whole) {
    const double value = std::ceil(draw.low) +
                         std::floor(share * (std::floor(draw.high) - std::ceil(draw.low) + 1.0));
    return fmt::format("{:.0f}", std::min(value, draw.high));
  }
  if (draw.is_logarithmic) {
    return fmt::format("{:.9g}", draw.low * math::exp(share * math::log(draw.high / draw.low)));
  }
  return fmt::format("{:.9g}", draw.low + share * (draw.high - draw.low));
}

/// A key's parts: "obstacles[0].count" is "obstacles", 0, "count".
struct Part {
  std::string name;
  std::optional<std::size_t> index;  ///< Of a list's entry, instead of a name.
};

std::vector<Part> parts_of(const std::string& key) {
  std::vector<Part> parts;
  const auto fail = [&] {
    throw InputError(
        fmt::format("{}: is no key of a scenario: write it like obstacles[0].count", key));
  };
  std::istringstream dotted(key);
  std::string piece;
  while (std::getline(dotted, piece, '.')) {
    const std::size_t bracket = std::min(piece.find('['), piece.size());
    if (bracket == 0) fail();
    parts.push_back({piece.substr(0, bracket), std::nullopt});
    std::string rest = piece.substr(bracket);
    while (!rest.empty()) {
      const std::size_t end = rest.find(']');
      double index = 0.0;
      if (rest[0] != '[' || end == std::string::npos ||
          !parse_number(rest.substr(1, end - 1), index) || !(index >= 0.0 && index < 1e6) ||
          index != std::floor(index)) {
        fail();
      }
      parts.push_back({"", static_cast<std::size_t>(index)});
      rest = rest.substr(end + 1);
    }
  }
  if (parts.empty() || key.ends_with('.')) fail();
  return parts;
}

void set_value(const YAML::Node& root, const std::string& key, const std::string& value) {
  YAML::Node node = root;
  for (const Part& part : parts_of(key)) {
    if (part.index) {
      if (!node.IsSequence() || *part.index >= node.size()) {
        throw InputError(fmt::format(
            "{}: the scenario has {} of these", key, node.IsSequence() ? node.size() : 0));
      }
      node.reset(node[*part.index]);
    } else {
      if (node.IsDefined() && !node.IsNull() && !node.IsMap()) {
        throw InputError(fmt::format("{}: {} is in a value that has no keys", key, part.name));
      }
      node.reset(node[part.name]);
    }
  }
  node = YAML::Load(value);
}

}  // namespace

Plan plan_of(const Study& study) {
  Plan plan;
  for (const StudyAxis& axis : study.grid) plan.keys.push_back(axis.key);
  plan.grid_keys = plan.keys.size();
  for (const StudyDraw& draw : study.draws) plan.keys.push_back(draw.key);
  double points = 1.0;
  for (const StudyAxis& axis : study.grid) points *= static_cast<double>(axis.values.size());
  const double count =
      points * static_cast<double>(study.draw_count) * static_cast<double>(study.seeds.size());
  if (count > static_cast<double>(kMostRuns)) {
    throw InputError(
        fmt::format("{}: are {:.3g} flights; {} at most", study.path, count, kMostRuns));
  }
  for (std::size_t point = 0; point < static_cast<std::size_t>(points); ++point) {
    std::vector<std::string> values(study.grid.size());
    std::size_t rest = point;
    for (std::size_t i = study.grid.size(); i-- > 0;) {
      const StudyAxis& axis = study.grid[i];
      values[i] = axis.values[rest % axis.values.size()];
      rest /= axis.values.size();
    }
    plan.point_values.push_back(values);
    for (std::size_t draw = 0; draw < study.draw_count; ++draw) {
      std::vector<std::string> all = values;
      for (std::size_t k = 0; k < study.draws.size(); ++k) {
        const RandomStream stream(static_cast<std::uint64_t>(study.draw_seed),
                                  StreamId::kStudy,
                                  static_cast<std::uint32_t>(k));
        all.push_back(drawn_text(study.draws[k], stream.uniform(draw)));
      }
      for (const std::int64_t seed : study.seeds) {
        plan.runs.push_back({plan.runs.size(), point, seed, all});
      }
    }
  }
  return plan;
}

std::vector<std::string> extremes_of(const StudyDraw& draw) {
  if (!draw.choices.empty()) return draw.choices;
  constexpr double kNearlyOne = 1.0 - 1e-12;
  return {drawn_text(draw, 0.0), drawn_text(draw, kNearlyOne)};
}

std::string edited_scenario(std::string_view yaml,
                            const std::vector<std::string>& keys,
                            const std::vector<std::string>& values) {
  try {
    const YAML::Node root = internal::one_yaml_document(std::string(yaml), "the scenario");
    for (std::size_t i = 0; i < keys.size(); ++i) set_value(root, keys[i], values[i]);
    YAML::Emitter emitter;
    emitter << root;
    return std::string(emitter.c_str()) + "\n";
  } catch (const YAML::Exception& error) {
    throw InputError(fmt::format("the scenario cannot be edited: {}", error.msg));
  }
}

}  // namespace pointflight
