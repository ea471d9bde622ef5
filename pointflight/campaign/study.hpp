// A study: many flights of one scenario with other seeds and other values of its keys.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight {

/// Flights of a study at most.
inline constexpr std::size_t kMostRuns = 10'000'000;

/// A key of the scenario that takes several values: one axis of the grid.
struct StudyAxis {
  std::string key;                  ///< "mission.speed", "obstacles[0].count"
  std::vector<std::string> values;  ///< Each as YAML in one line: "2", "[0, 0, 2]", "crash".
  int line = 0;                     ///< In the study's file.
};

/// A key of the scenario that is drawn at random, once for each draw.
struct StudyDraw {
  std::string key;  ///< As in `StudyAxis`.
  /// Uniform from one to the other, in the key's unit.
  ///@{
  double low = 0.0, high = 1.0;
  ///@}
  bool is_logarithmic = false;       ///< Uniform in the logarithm.
  bool is_whole = false;             ///< Whole numbers, both ends included.
  std::vector<std::string> choices;  ///< Not empty: one of these instead, each as likely.
  int line = 0;                      ///< In the study's file.
};

/// What is kept of a run beside its row.
enum class KeptFiles {
  kResults,  ///< Scenario, log, summary, events and the user's figures; the rest of what a run's
             ///< list (`files.txt`) has is removed.
  kAll,      ///< All that it wrote.
};

/// What a study's file says.
struct Study {
  std::string path;                  ///< Of the file; relative paths are taken from its folder.
  std::string scenario;              ///< Path, as the file has it.
  std::vector<std::int64_t> seeds;   ///< At least one.
  std::vector<StudyAxis> grid;       ///< All combinations are flown.
  std::vector<StudyDraw> draws;      ///< For each point of the grid `draw_count` times.
  std::size_t draw_count = 1;        ///< 1 without `draws`.
  std::int64_t draw_seed = 1;        ///< Of the draws.
  std::vector<std::string> command;  ///< With {scenario}, {seed}, {output}; empty: our own `fly`.
  double time_limit = 0.0;           ///< s of the wall clock for each run; 0: none.
  double memory_limit = 0.0;         ///< Bytes that a run may take beside mapped files; 0: any.
  std::string figures;               ///< JSON that a run leaves in {output}; empty: none.
  KeptFiles kept = KeptFiles::kResults;  ///< Of each run; all of a user's command unless told.
};

/// Reads a study's file. Throws InputError with file and line.
Study load_study(const std::string& path);

/// From text, for tests and fuzzers.
Study parse_study(std::string_view text, const std::string& path);

/// Rows of a Markdown table of all keys.
std::string study_reference();

/// A commented study of ten seeds of a scenario (its path as the file shall have it).
std::string study_template(const std::string& scenario);

}  // namespace pointflight
