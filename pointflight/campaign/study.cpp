#include "pointflight/campaign/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"

namespace pointflight {
namespace {

constexpr double kMostValues = 1e6;
constexpr double kGreatest = 1e12;                   // of a number to draw or to step to
constexpr double kLargestSeed = 9007199254740992.0;  // 2^53: numbers in YAML and JSON are doubles

/// `seeds`: 100, [3, 5] or {from: 1, to: 100}.
struct SeedKeys {
  std::vector<double> values;
  std::int64_t from = 1;
  std::int64_t to = 1;
};

/// An entry of `grid`: [1, 2, 4] or {from: 0, to: 100, n: 6}.
struct AxisKeys {
  std::string key;
  YamlList values;
  double from = 0.0;
  double to = 1.0;
  std::int64_t n = 0;
};

/// An entry of `draws`: one of these.
struct DrawKeys {
  std::string key;
  std::vector<double> uniform;
  std::vector<double> log_uniform;
  std::vector<double> integer;
  YamlList choice;
};

/// A study as its file has it.
struct StudyKeys {
  std::string scenario;
  SeedKeys seeds;
  std::vector<AxisKeys> grid;
  std::int64_t draw_count = 1;
  std::int64_t draw_seed = 1;
  std::vector<DrawKeys> draws;
  std::vector<std::string> command;
  double time_limit = 0.0;
  double memory_limit = 0.0;
  std::string figures;
  KeptFiles keep = KeptFiles::kResults;
};

constexpr Named<KeptFiles> kKeptFiles[] = {{KeptFiles::kResults, "results"},
                                           {KeptFiles::kAll, "all"}};

void describe(SettingsVisitor& v, SeedKeys& seeds) {
  v.value({"values", "", "these; a list in place of the section is short for it", 0, kLargestSeed},
          seeds.values);
  v.value({"from", "", "the first of a range", 0, kLargestSeed}, seeds.from);
  v.value({"to", "", "the last; a number in place of the section is short for it", 0, kLargestSeed},
          seeds.to);
}

void describe(SettingsVisitor& v, AxisKeys& axis) {
  v.value({"values", "", "these; a list in place of the section is short for it"}, axis.values);
  v.value({"from", "", "the first of values at equal steps", -kGreatest, kGreatest}, axis.from);
  v.value({"to", "", "the last", -kGreatest, kGreatest}, axis.to);
  v.value({"n", "", "how many, both ends included; 0: as listed", 0, kMostValues}, axis.n);
}

void describe(SettingsVisitor& v, DrawKeys& draw) {
  v.value({"uniform", "", "[from, to], in the key's unit", -kGreatest, kGreatest}, draw.uniform);
  v.value({"log_uniform", "", "[from, to], uniform in the logarithm", -kGreatest, kGreatest},
          draw.log_uniform);
  v.value({"integer", "", "[from, to], whole numbers, both ends included", -kGreatest, kGreatest},
          draw.integer);
  v.value({"choice", "", "one of these, each as likely"}, draw.choice);
}

void describe(SettingsVisitor& v, StudyKeys& study) {
  constexpr auto kMost = static_cast<double>(kMostRuns);
  v.value({.name = "scenario", .unit = "", .help = "the scenario file to fly", .required = true},
          study.scenario);
  v.section({"seeds", "", "each combination of values is flown with each of them"},
            {.one = "to", .list = "values"},
            [&](SettingsVisitor& w) { describe(w, study.seeds); });
  v.section({"grid", "", "keys of the scenario with several values: all combinations are flown"},
            [&](SettingsVisitor& w) {
              w.others({"", "", ""}, {.list = "values"}, study.grid, [](auto& u, AxisKeys& axis) {
                describe(u, axis);
              });
            });
  v.section(
      {"draws", "", "keys of the scenario that are drawn at random, each in one way"},
      [&](SettingsVisitor& w) {
        w.value({"count", "", "draws at each point of the grid", 1, kMost, true}, study.draw_count);
        w.value({"seed", "", "of the draws", 0, kLargestSeed}, study.draw_seed);
        w.others({"", "", ""}, {}, study.draws, [](auto& u, DrawKeys& draw) { describe(u, draw); });
      });
  v.value({"command",
           "",
           "words of a program that flies instead of `fly`; {scenario}, {seed} and {output} stand "
           "for the flight's"},
          study.command);
  v.section({"limits", "", "of each flight"}, [&](SettingsVisitor& w) {
    w.value({"time", "s", "by the wall clock; 0: none", 0, 1e8}, study.time_limit);
    w.value({"memory", "bytes", "beside mapped files; 0: none", 0, 1e15}, study.memory_limit);
    constexpr double kLeast = 1e6;  // a program's own start takes more
    w.require("memory",
              study.memory_limit == 0.0 || study.memory_limit >= kLeast,
              "is in bytes; no program gets along with less than 1e6");
  });
  v.value({"figures", "", "JSON file that the command leaves in {output}; its numbers are columns"},
          study.figures);
  v.choice({"keep", "", "what stays of a flight's files; with `command`: all, if not given"},
           study.keep,
           kKeptFiles);
}

/// What the keys mean, and whether they make sense together.
class StudyMaker {
 public:
  StudyMaker(const std::string& path, const std::map<std::string, int>& lines)
      : path_(path), lines_(lines) {}

  [[nodiscard]] Study study_of(const StudyKeys& keys) const {
    Study study;
    study.path = path_;
    study.scenario = keys.scenario;
    study.seeds = seeds_of(keys.seeds);
    for (const AxisKeys& axis : keys.grid) study.grid.push_back(axis_of(axis));
    for (const DrawKeys& draw : keys.draws) study.draws.push_back(draw_of(draw));
    check_once(study);
    if (keys.draw_count > 1 && study.draws.empty()) fail("draws", "names no key to draw");
    study.draw_count = static_cast<std::size_t>(keys.draw_count);
    study.draw_seed = keys.draw_seed;
    study.command = keys.command;
    check_command(study.command);
    study.time_limit = keys.time_limit;
    study.memory_limit = keys.memory_limit;
    study.figures = keys.figures;
    study.kept = keys.keep;
    // what is not ours is removed if the user says so, and never otherwise
    if (!study.command.empty() && !is_given("keep")) study.kept = KeptFiles::kAll;
    return study;
  }

 private:
  [[nodiscard]] bool is_given(const std::string& key) const { return lines_.count(key) != 0; }
  [[nodiscard]] int line_of(const std::string& key) const {
    const auto line = lines_.find(key);
    return line == lines_.end() ? 1 : line->second;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& words) const {
    throw InputError(fmt::format("{}:{}: {}: {}", path_, line_of(key), key, words));
  }

  [[nodiscard]] std::vector<std::int64_t> seeds_of(const SeedKeys& keys) const {
    std::vector<std::int64_t> seeds;
    const bool has_range = is_given("seeds.from") || is_given("seeds.to");
    if (!keys.values.empty() && has_range) {
      fail("seeds", "give a list, or `from` and `to`, not both");
    }
    if (is_given("seeds.values") && !has_range) {
      for (const double seed : keys.values) {
        if (seed != std::floor(seed)) fail("seeds", "are to be whole numbers");
        seeds.push_back(static_cast<std::int64_t>(seed));
      }
    } else {
      if (is_given("seeds.from") && !is_given("seeds.to")) fail("seeds", "give `to` as well");
      if (keys.to < keys.from || keys.to - keys.from >= static_cast<std::int64_t>(kMostRuns)) {
        fail("seeds", fmt::format("from {} to {} are none, or too many", keys.from, keys.to));
      }
      seeds.resize(static_cast<std::size_t>(keys.to - keys.from + 1));
      std::iota(seeds.begin(), seeds.end(), keys.from);
    }
    if (seeds.empty()) fail("seeds", "the list is empty");
    if (std::set(seeds.begin(), seeds.end()).size() != seeds.size()) {
      fail("seeds", "one of them is given twice");
    }
    return seeds;
  }

  [[nodiscard]] StudyAxis axis_of(const AxisKeys& keys) const {
    const std::string name = "grid." + keys.key;
    const bool has_steps = keys.n > 0 || is_given(name + ".from") || is_given(name + ".to");
    if (has_steps && !keys.values.items.empty())
      fail(name, "give a list, or `from`, `to` and `n`, not both");
    StudyAxis axis{keys.key, keys.values.items, line_of(name)};
    if (has_steps && (!is_given(name + ".from") || !is_given(name + ".to") || keys.n < 2)) {
      fail(name, "give `from`, `to` and `n`, at least 2");
    }
    for (std::int64_t i = 0; i < keys.n; ++i) {
      const double fraction = static_cast<double>(i) / static_cast<double>(keys.n - 1);
      axis.values.push_back(fmt::format("{:.12g}", keys.from + fraction * (keys.to - keys.from)));
    }
    if (axis.values.empty()) fail(name, "has no values: give a list, or `from`, `to` and `n`");
    return axis;
  }

  [[nodiscard]] StudyDraw draw_of(const DrawKeys& keys) const {
    const std::string name = "draws." + keys.key;
    std::vector<std::string> ways;
    for (const char* way : {"uniform", "log_uniform", "integer", "choice"}) {
      if (is_given(name + "." + way)) ways.emplace_back(way);
    }
    if (ways.size() != 1) {
      fail(name, "give one way to draw it: `uniform`, `log_uniform`, `integer` or `choice`");
    }
    const std::string way = name + "." + ways.front();
    StudyDraw draw;
    draw.key = keys.key;
    draw.line = line_of(name);
    draw.choices = keys.choice.items;
    if (ways.front() == "choice") {
      if (draw.choices.empty()) fail(way, "the list is empty");
      return draw;
    }
    draw.is_logarithmic = ways.front() == "log_uniform";
    draw.is_whole = ways.front() == "integer";
    const std::vector<double>& ends = draw.is_logarithmic ? keys.log_uniform
                                      : draw.is_whole     ? keys.integer
                                                          : keys.uniform;
    if (ends.size() != 2 || ends[1] < ends[0]) {
      fail(way, "give two numbers, the smaller one first");
    }
    draw.low = ends[0];
    draw.high = ends[1];
    if (draw.is_logarithmic && !(draw.low > 0.0)) fail(way, "the first has to be above 0");
    return draw;
  }

  void check_once(const Study& study) const {
    std::set<std::string> keys;
    const auto check = [&](const std::string& where, const std::string& key) {
      if (key == "seed") fail(where + key, "is given by `seeds`");
      if (!keys.insert(key).second) fail(where + key, "is in `grid` as well");
    };
    for (const StudyAxis& axis : study.grid) check("grid.", axis.key);
    for (const StudyDraw& draw : study.draws) check("draws.", draw.key);
  }

  void check_command(const std::vector<std::string>& command) const {
    if (command.empty()) return;
    const auto has_scenario = [](const std::string& word) {
      return word.find("{scenario}") != std::string::npos;
    };
    if (std::none_of(command.begin(), command.end(), has_scenario)) {
      fail("command",
           "one of its words has to have {scenario}: [./planner, --scenario, \"{scenario}\"]; "
           "{seed} and {output} may be there too");
    }
  }

  const std::string& path_;
  const std::map<std::string, int>& lines_;
};

Study read_study(SettingsReader& reader, const std::string& path) {
  StudyKeys keys;
  describe(reader, keys);
  reader.finish();
  return StudyMaker(path, reader.lines()).study_of(keys);
}

}  // namespace

Study parse_study(std::string_view text, const std::string& path) {
  SettingsReader reader(text, path);
  return read_study(reader, path);
}

Study load_study(const std::string& path) {
  SettingsReader reader(path);
  return read_study(reader, path);
}

std::string study_reference() {
  StudyKeys defaults;
  SettingsTable table;
  describe(table, defaults);
  return table.text();
}

std::string study_template(const std::string& scenario) {
  StudyKeys keys;
  keys.scenario = scenario;
  keys.seeds.to = 10;
  SettingsWriter writer;
  describe(writer, keys);
  return writer.text();
}

}  // namespace pointflight
