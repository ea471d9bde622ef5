#include "pointflight/campaign/study.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMostValues = 1'000'000;

/// Reads nodes and says where something is wrong.
class StudyReader {
 public:
  explicit StudyReader(const std::string& path) : path_(path) {}

  [[noreturn]] void fail(const YAML::Node& node, const std::string& words) const {
    throw InputError(fmt::format("{}:{}: {}", path_, line_of(node), words));
  }

  static int line_of(const YAML::Node& node) { return node.Mark().line + 1; }

  /// Refuses keys that nobody knows.
  void check_keys(const YAML::Node& map,
                  const std::string& name,
                  const std::vector<std::string>& known) const {
    if (!map.IsMap()) fail(map, fmt::format("{}: is to be keys with values", name));
    std::set<std::string> seen;
    for (const auto& entry : map) {
      const auto key = entry.first.as<std::string>();
      if (!seen.insert(key).second) fail(entry.first, fmt::format("{}: is there twice", key));
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      const std::string near = closest_word(key, known);
      fail(entry.first,
           fmt::format("{}: unknown key{}",
                       key,
                       near.empty() ? fmt::format("; known here: {}", fmt::join(known, ", "))
                                    : fmt::format("; did you mean '{}'?", near)));
    }
  }

  [[nodiscard]] double number(const YAML::Node& node,
                              const std::string& name,
                              double low,
                              double high) const {
    double value = 0.0;
    const bool is_number = node.IsScalar() && parse_number(node.Scalar(), value);
    if (!is_number || !(value >= low && value <= high)) {
      fail(node, fmt::format("{}: is to be a number from {} to {}", name, low, high));
    }
    return value;
  }

  [[nodiscard]] std::int64_t whole(const YAML::Node& node,
                                   const std::string& name,
                                   std::int64_t low,
                                   std::int64_t high) const {
    const double value = number(node, name, static_cast<double>(low), static_cast<double>(high));
    if (value != std::floor(value)) fail(node, fmt::format("{}: is to be a whole number", name));
    return static_cast<std::int64_t>(value);
  }

  [[nodiscard]] std::string word(const YAML::Node& node, const std::string& name) const {
    if (!node.IsScalar()) fail(node, fmt::format("{}: is to be one value", name));
    return node.Scalar();
  }

 private:
  const std::string& path_;
};

/// A node as YAML in one line.
std::string flow_text(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetMapFormat(YAML::Flow);
  emitter.SetSeqFormat(YAML::Flow);
  emitter << node;
  std::string text = emitter.c_str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// 1 .. 100 as `100`, `[3, 5]` or `{from: 1, to: 100}`.
std::vector<std::int64_t> seeds_of(const StudyReader& reader, const YAML::Node& node) {
  constexpr std::int64_t kLargest = std::int64_t{1} << 53;
  std::vector<std::int64_t> seeds;
  if (node.IsSequence()) {
    for (const auto& item : node) seeds.push_back(reader.whole(item, "seeds", 0, kLargest));
  } else {
    std::int64_t from = 1;
    std::int64_t to = 0;
    if (node.IsMap()) {
      reader.check_keys(node, "seeds", {"from", "to"});
      if (!node["from"] || !node["to"]) reader.fail(node, "seeds: wants `from` and `to`");
      from = reader.whole(node["from"], "seeds.from", 0, kLargest);
      to = reader.whole(node["to"], "seeds.to", 0, kLargest);
    } else {
      to = reader.whole(node, "seeds", 1, static_cast<std::int64_t>(kMostRuns));
    }
    if (to < from || to - from >= static_cast<std::int64_t>(kMostRuns)) {
      reader.fail(node, fmt::format("seeds: from {} to {} are none, or too many", from, to));
    }
    for (std::int64_t seed = from; seed <= to; ++seed) seeds.push_back(seed);
  }
  if (seeds.empty()) reader.fail(node, "seeds: is empty");
  if (std::set(seeds.begin(), seeds.end()).size() != seeds.size()) {
    reader.fail(node, "seeds: has one twice");
  }
  return seeds;
}

/// `[1, 2, 4]` or `{from: 0, to: 100, n: 6}`.
StudyAxis axis_of(const StudyReader& reader, const std::string& key, const YAML::Node& node) {
  StudyAxis axis;
  axis.key = key;
  axis.line = StudyReader::line_of(node);
  if (node.IsSequence()) {
    for (const auto& item : node) axis.values.push_back(flow_text(item));
  } else if (node.IsMap()) {
    reader.check_keys(node, key, {"from", "to", "n"});
    if (!node["from"] || !node["to"] || !node["n"]) {
      reader.fail(node, fmt::format("{}: wants `from`, `to` and `n`", key));
    }
    const double from = reader.number(node["from"], key + ".from", -1e12, 1e12);
    const double to = reader.number(node["to"], key + ".to", -1e12, 1e12);
    const auto n = reader.whole(node["n"], key + ".n", 2, static_cast<std::int64_t>(kMostValues));
    for (std::int64_t i = 0; i < n; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(n - 1);
      axis.values.push_back(fmt::format("{:.12g}", from + share * (to - from)));
    }
  } else {
    reader.fail(node, fmt::format("{}: is to be a list, or {{from, to, n}}", key));
  }
  if (axis.values.empty()) reader.fail(node, fmt::format("{}: has no value", key));
  return axis;
}

/// `{uniform: [0, 5]}`, `{log_uniform: ...}`, `{integer: ...}` or `{choice: [a, b]}`.
StudyDraw draw_of(const StudyReader& reader, const std::string& key, const YAML::Node& node) {
  reader.check_keys(node, key, {"uniform", "log_uniform", "integer", "choice"});
  if (node.size() != 1) reader.fail(node, fmt::format("{}: wants one way to draw it", key));
  StudyDraw draw;
  draw.key = key;
  draw.line = StudyReader::line_of(node);
  const auto how = node.begin()->first.as<std::string>();
  const YAML::Node what = node.begin()->second;  // the iterator lends no reference
  if (!what.IsSequence()) reader.fail(what, fmt::format("{}.{}: is to be a list", key, how));
  if (how == "choice") {
    for (const auto& item : what) draw.choices.push_back(flow_text(item));
    if (draw.choices.empty()) reader.fail(what, fmt::format("{}.choice: is empty", key));
    return draw;
  }
  if (what.size() != 2) reader.fail(what, fmt::format("{}.{}: wants two numbers", key, how));
  draw.is_logarithmic = how == "log_uniform";
  draw.is_whole = how == "integer";
  draw.low = reader.number(what[0], key, -1e12, 1e12);
  draw.high = reader.number(what[1], key, draw.low, 1e12);
  if (draw.is_logarithmic && !(draw.low > 0.0)) {
    reader.fail(what, fmt::format("{}.log_uniform: begins above 0", key));
  }
  return draw;
}

void read_draws(const StudyReader& reader, const YAML::Node& node, Study& study) {
  if (!node.IsMap()) reader.fail(node, "draws: is to be `count`, `seed` and keys to draw");
  study.draw_count = 0;
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    if (key == "count") {
      study.draw_count = static_cast<std::size_t>(
          reader.whole(entry.second, "draws.count", 1, static_cast<std::int64_t>(kMostRuns)));
    } else if (key == "seed") {
      study.draw_seed = reader.whole(entry.second, "draws.seed", 0, std::int64_t{1} << 53);
    } else {
      study.draws.push_back(draw_of(reader, key, entry.second));
    }
  }
  if (study.draw_count == 0) reader.fail(node, "draws: wants `count`, how often");
  if (study.draws.empty()) reader.fail(node, "draws: names no key to draw");
}

void read_limits(const StudyReader& reader, const YAML::Node& node, Study& study) {
  reader.check_keys(node, "limits", {"time", "memory"});
  if (node["time"]) study.time_limit = reader.number(node["time"], "limits.time", 0.0, 1e8);
  if (node["memory"]) {
    study.memory_limit = reader.number(node["memory"], "limits.memory", 0.0, 1e15);
  }
}

void read_command(const StudyReader& reader, const YAML::Node& node, Study& study) {
  if (!node.IsSequence() || node.size() == 0) {
    reader.fail(node, "command: is to be a list of words: [./planner, --scenario, '{scenario}']");
  }
  std::string all;
  for (const auto& word : node) {
    study.command.push_back(reader.word(word, "command"));
    all += study.command.back();
  }
  if (all.find("{scenario}") == std::string::npos) {
    reader.fail(node,
                "command: has to name {scenario} somewhere, and may name {seed} and {output}");
  }
}

Study read_study(const YAML::Node& root, const StudyReader& reader, const std::string& path) {
  reader.check_keys(root,
                    "a study",
                    {"scenario", "seeds", "grid", "draws", "command", "limits", "figures", "keep"});
  Study study;
  study.path = path;
  if (!root["scenario"]) reader.fail(root, "scenario: is missing: the file to fly");
  study.scenario = reader.word(root["scenario"], "scenario");
  study.seeds = root["seeds"] ? seeds_of(reader, root["seeds"]) : std::vector<std::int64_t>{1};
  if (const YAML::Node grid = root["grid"]) {
    if (!grid.IsMap()) reader.fail(grid, "grid: is to be keys of the scenario with values");
    for (const auto& entry : grid) {
      study.grid.push_back(axis_of(reader, entry.first.as<std::string>(), entry.second));
    }
  }
  if (root["draws"]) read_draws(reader, root["draws"], study);
  std::set<std::string> keys = {"seed"};
  const auto check_once = [&](const std::string& key, int line) {
    if (keys.insert(key).second) return;
    throw InputError(fmt::format("{}:{}: {}: {}",
                                 path,
                                 line,
                                 key,
                                 key == "seed" ? "is given by `seeds`" : "is there twice"));
  };
  for (const StudyAxis& axis : study.grid) check_once(axis.key, axis.line);
  for (const StudyDraw& draw : study.draws) check_once(draw.key, draw.line);
  if (root["command"]) read_command(reader, root["command"], study);
  if (root["limits"]) read_limits(reader, root["limits"], study);
  if (root["figures"]) study.figures = reader.word(root["figures"], "figures");
  // what is not ours is removed if the user says so, and never otherwise
  if (!study.command.empty()) study.kept = KeptFiles::kAll;
  if (root["keep"]) {
    const std::string keep = reader.word(root["keep"], "keep");
    if (keep != "results" && keep != "all") {
      reader.fail(root["keep"], "keep: is to be `results` or `all`");
    }
    study.kept = keep == "all" ? KeptFiles::kAll : KeptFiles::kResults;
  }
  return study;
}

}  // namespace

Study parse_study(std::string_view text, const std::string& path) {
  const StudyReader reader(path);
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap()) throw InputError(fmt::format("{}: is no study: it has no keys", path));
    return read_study(root, reader, path);
  } catch (const YAML::Exception& error) {
    throw InputError(fmt::format("{}:{}: {}", path, error.mark.line + 1, error.msg));
  }
}

Study load_study(const std::string& path) {
  return parse_study(MappedFile(path).text(), path);
}

}  // namespace pointflight
