#include "apps/flags.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"
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

std::vector<double> parse_numbers(const std::string& text, const std::string& flag) {
  std::vector<double> numbers;
  std::string_view rest = text;
  for (auto word = take_word(rest); !word.empty(); word = take_word(rest)) {
    double value = 0.0;
    if (!parse_number(word, value) || !(std::abs(value) <= 1e9)) {
      throw InputError(fmt::format("{}: '{}' is no number up to 1e9", flag, excerpt(word)));
    }
    numbers.push_back(value);
  }
  return numbers;
}

namespace {

void require_count(const std::vector<double>& numbers,
                   std::size_t count,
                   const std::string& flag,
                   const std::string& form) {
  if (numbers.size() == count) return;
  throw InputError(fmt::format("{}: {} number{} where {} are wanted: {}",
                               flag,
                               numbers.size(),
                               numbers.size() == 1 ? "" : "s",
                               count,
                               form));
}

}  // namespace

std::vector<double> parse_numbers(const std::string& text,
                                  std::size_t count,
                                  const std::string& flag,
                                  const std::string& form) {
  std::vector<double> numbers = parse_numbers(text, flag);
  require_count(numbers, count, flag, form);
  return numbers;
}

Pose parse_pose(const std::string& text, const std::string& flag) {
  std::vector<double> n = parse_numbers(text, flag);
  if (n.size() == 3) n.resize(6, 0.0);
  require_count(n, 6, flag, "x,y,z,roll,pitch,yaw in metres and degrees (or x,y,z)");
  return {quaternion_from_rpy(n[3] * kDegree, n[4] * kDegree, n[5] * kDegree), {n[0], n[1], n[2]}};
}

std::vector<std::string> renderer_names() {
  const auto names = RendererKind::table().names();
  return {names.begin(), names.end()};
}

void add_force_flag(CLI::App& app, bool& force) {
  app.add_flag("--force", force, "Replace outputs that are there already");
}

namespace {

namespace fs = std::filesystem;

/// What a command may read of a folder: a file in it or below, but no map and no picture.
bool is_read_from(const std::string& file, const std::string& folder) {
  std::error_code ignored;
  if (file.ends_with(".pfmap") || file.ends_with(".png")) return false;
  if (!fs::is_directory(folder, ignored)) return false;
  const fs::path relative = fs::weakly_canonical(fs::absolute(file, ignored), ignored)
                                .lexically_relative(fs::canonical(folder, ignored));
  return !relative.empty() && *relative.begin() != "..";
}

/// True if a killed program has left it, or it is somebody's: not if it is being written.
bool is_left_over(const std::string& partial) {
  const int file = ::open(partial.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return false;
  struct stat status {};
  const bool is_left = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
                       status.st_size > 0 && ::flock(file, LOCK_EX | LOCK_NB) == 0;
  ::close(file);
  return is_left;
}

/// Returns true if there is a file that the output will replace.
bool check_output(const std::string& output, bool force) {
  const OutputName name(output);  // refuses links, folders, devices
  std::error_code ignored;
  const bool is_there = fs::exists(output, ignored);
  if (is_there && !force) {
    throw InputError(fmt::format("{}: is there already; give another name or --force", output));
  }
  if (!force && is_left_over(output + ".partial")) {
    throw InputError(fmt::format(
        "{0}.partial: is there already, left by a program that was killed or yours; move it away, "
        "give another name, or --force",
        output));
  }
  return is_there;
}

[[noreturn]] void refuse_twice(const std::string& output) {
  throw InputError(
      fmt::format("{}: this command reads or writes that file already; give another name", output));
}

}  // namespace

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  const auto full = [&](const std::string& path) {
    return fs::weakly_canonical(fs::absolute(path, ignored), ignored);
  };
  return fs::equivalent(a, b, ignored) || full(a) == full(b);
}

std::string path_in_file(const std::string& file, const std::string& other) {
  const fs::path folder = fs::weakly_canonical(fs::absolute(file).parent_path());
  const fs::path path = fs::weakly_canonical(fs::absolute(other));
  const fs::path relative = path.lexically_relative(folder);
  return relative.empty() ? path.string() : relative.string();
}

void check_outputs(const std::vector<std::string>& outputs,
                   const std::vector<std::string>& inputs,
                   bool force) {
  std::vector<std::string> others;
  for (const std::string& output : outputs) {
    if (output.empty()) continue;
    for (const std::string& input : inputs) {
      if (!input.empty() && is_same_file(output, input)) refuse_twice(output);
    }
    for (const std::string& other : others) {
      if (is_same_file(output, other) || is_same_file(output, other + ".partial") ||
          is_same_file(output + ".partial", other)) {
        refuse_twice(output);
      }
    }
    if (check_output(output, force)) {
      for (const std::string& input : inputs) {
        if (!input.empty() && is_read_from(output, input)) refuse_twice(output);
      }
    }
    others.push_back(output);
  }
}

PictureFolder::PictureFolder(const std::string& folder, bool force) {
  if (folder.empty()) return;
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<fs::path> missing;
  for (fs::path at = fs::absolute(folder).lexically_normal(); !fs::exists(at, error);
       at = at.parent_path()) {
    if (at.has_filename()) missing.push_back(at);
  }
  fs::create_directories(folder, error);
  if (std::error_code ignored; !fs::is_directory(folder, ignored)) {
    throw InputError(fmt::format(
        "{}: cannot make the folder: {}", folder, error ? error.message() : "is a file"));
  }
  if (!force && !fs::is_empty(folder, error)) {
    throw InputError(
        fmt::format("{}: is not empty; choose another folder or give --force", folder));
  }
  made_ = std::move(missing);
}

PictureFolder::~PictureFolder() {
  // one that holds something stays
  for (const auto& folder : made_) ::rmdir(folder.c_str());
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
