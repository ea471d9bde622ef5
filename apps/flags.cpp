#include "apps/flags.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight::apps {

CLI::Validator within(double min, double max) {
  const auto check = [min, max](const std::string& text) {
    double value = 0.0;
    // NaN is within nothing
    if (parse_number(text, value) && value >= min && value <= max) return std::string();
    return fmt::format("'{}' is not a number from {} to {}", excerpt(text), min, max);
  };
  return {check, fmt::format("in [{} - {}]", min, max)};
}

std::vector<double> parse_numbers(const std::string& text,
                                  std::size_t count,
                                  const std::string& flag) {
  std::vector<double> numbers;
  std::string_view rest = text;
  for (auto word = take_word(rest); !word.empty(); word = take_word(rest)) {
    double value = 0.0;
    if (!parse_number(word, value) || !(std::abs(value) <= 1e9)) {
      throw InputError(fmt::format("{}: '{}' is no number up to 1e9", flag, excerpt(word)));
    }
    numbers.push_back(value);
  }
  if (count > 0 && numbers.size() != count) {
    throw InputError(fmt::format("{}: {} numbers; {} are wanted", flag, numbers.size(), count));
  }
  return numbers;
}

Pose parse_pose(const std::string& text, const std::string& flag) {
  const std::vector<double> n =
      parse_numbers(text, 6, flag + " (x,y,z,roll,pitch,yaw: metres, degrees)");
  return {quaternion_from_rpy(n[3] * kDegree, n[4] * kDegree, n[5] * kDegree), {n[0], n[1], n[2]}};
}

std::vector<std::string> renderer_names() {
  const auto names = RendererKind::table().names();
  return {names.begin(), names.end()};
}

void add_force_flag(CLI::App& app, bool& force) {
  app.add_flag("--force", force, "Replace outputs that are there already");
}

void refuse_to_overwrite(const std::string& output, bool force) {
  if (output.empty()) return;
  std::error_code ignored;
  const auto status = std::filesystem::status(output, ignored);
  if (!std::filesystem::exists(status)) return;
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(
        fmt::format("{}: is there and is not a regular file; give the path of a file", output));
  }
  if (!force) {
    throw InputError(fmt::format("{}: is there already; give another name or --force", output));
  }
}

void make_picture_folder(const std::string& folder, bool force) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (std::error_code ignored; !std::filesystem::is_directory(folder, ignored)) {
    throw InputError(fmt::format(
        "{}: cannot make the folder: {}", folder, error ? error.message() : "is a file"));
  }
  if (!force && !std::filesystem::is_empty(folder, error)) {
    throw InputError(
        fmt::format("{}: is not empty; choose another folder or give --force", folder));
  }
}

void refuse_same_file(const std::string& output, const std::string& input) {
  std::error_code ignored;
  if (output == input || std::filesystem::equivalent(output, input, ignored)) {
    throw InputError(fmt::format(
        "{}: this command reads or writes that file already; give another name", output));
  }
}

std::vector<CloudSource> cloud_sources(const std::vector<std::string>& inputs,
                                       const std::string& format,
                                       const std::string& scratch,
                                       const Progress& progress) {
  if (std::count(inputs.begin(), inputs.end(), "-") > 1) {
    throw InputError("-: standard input can be read once; give it once");
  }
  std::vector<CloudSource> sources;
  for (const std::string& input : inputs) {
    if (input == "-") {
      sources.push_back(CloudSource::from_stream(STDIN_FILENO, format, scratch, progress));
    } else {
      sources.emplace_back(input, format);
    }
  }
  return sources;
}

void add_start_in_flag(CLI::App& app, std::vector<double>& numbers) {
  app.add_option("--start-in",
                 numbers,
                 "x,y,z,x,y,z of a box, m: a start is looked for in it; a scenario's is warned of "
                 "outside. What a planner's grid covers")
      ->delimiter(',')
      ->expected(6)
      ->check(within(-1e7, 1e7));
}

Aabb box_from(const std::vector<double>& numbers, const std::string& flag) {
  const Aabb box{Vector3d(numbers.data()), Vector3d(numbers.data() + 3)};
  if (box.size().minCoeff() > 0.0) return box;
  throw InputError(
      fmt::format("{}: is empty; give x,y,z of the lower corner, then of the upper", flag));
}

}  // namespace pointflight::apps
