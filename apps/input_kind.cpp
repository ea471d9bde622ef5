#include "apps/input_kind.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/shell_words.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/map_file.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

struct Beginning {
  std::string_view bytes;
  InputKind kind;
};
constexpr Beginning kBeginnings[] = {
    {{kMapMagic, sizeof kMapMagic}, InputKind::kMap},
    {"\x89MCAP0", InputKind::kRecording},
    {"#ROSBAG", InputKind::kRecording},
    {"SQLite format 3", InputKind::kSqlite},
};

InputKind kind_of_folder(const fs::path& folder) {
  std::error_code error;
  const auto has = [&](const char* name) {
    std::error_code ignored;
    return fs::is_regular_file(folder / name, ignored);
  };
  if (has("summary.json") || has("files.txt") || has("scenario.yaml")) return InputKind::kRun;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
       at.increment(error)) {
    const auto extension = at->path().extension();
    if (extension == ".mcap" || extension == ".db3") return InputKind::kRecordingFolder;
  }
  return InputKind::kOther;
}

std::string lower_extension(const std::string& path) {
  return lower_case(fs::path(path).extension().string());
}

/// What it is, and what to do with it.
std::string about(const std::string& path, InputKind kind) {
  const std::string name = shell_word(path);
  const std::string map = shell_word(fs::path(path).stem().string() + ".pfmap");
  switch (kind) {
    case InputKind::kMap:
      return fmt::format("a map: pointflight fly {0} -o run, pointflight view {0}", name);
    case InputKind::kCloud:
    case InputKind::kMesh:
      return fmt::format("a {}; import it first: pointflight map import {} -o {}",
                         kind == InputKind::kCloud ? "point cloud" : "mesh",
                         name,
                         map);
    case InputKind::kRecording:
      return fmt::format(
          "a recording: pointflight map import --scans {0} -o {1}, pointflight bag info {0}",
          name,
          map);
    case InputKind::kSqlite:
      return fmt::format(
          "a recording in SQLite: pointflight map import --scans {0} -o {1}, pointflight bag info "
          "{0}; for all else convert it to MCAP: ros2 bag convert",
          name,
          map);
    case InputKind::kRecordingFolder:
      return fmt::format(
          "a folder of a recording: pointflight map import --scans {0} -o {1}, "
          "pointflight view {0}",
          name,
          map);
    case InputKind::kRun:
      return fmt::format("the folder of a run: pointflight view {0}, pointflight picture {0}",
                         name);
    case InputKind::kYaml:
      return fmt::format("a YAML file; if it is a scenario: pointflight fly {} -o run", name);
    case InputKind::kOther:
      break;
  }
  return {};
}

}  // namespace

InputKind kind_of_input(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return kind_of_folder(path);
  if (!fs::is_regular_file(path, ignored)) return InputKind::kOther;
  std::array<char, 16> bytes{};
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), bytes.size());
  const std::string_view begin(bytes.data(), static_cast<std::size_t>(file.gcount()));
  for (const Beginning& known : kBeginnings) {
    if (begin.starts_with(known.bytes)) return known.kind;
  }
  const std::string extension = lower_extension(path);
  if (extension == ".yaml" || extension == ".yml") return InputKind::kYaml;
  if (extension == ".pfmap") return InputKind::kMap;
  if (extension == ".mcap" || extension == ".bag") return InputKind::kRecording;
  try {
    if (is_mesh(path)) return InputKind::kMesh;
  } catch (const std::exception&) {
    return InputKind::kOther;
  }
  return has_cloud_extension(path) ? InputKind::kCloud : InputKind::kOther;
}

void require_kind(const std::string& path,
                  std::initializer_list<InputKind> kinds,
                  std::string_view wanted) {
  const InputKind kind = kind_of_input(path);
  if (kind == InputKind::kOther || std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) {
    return;
  }
  throw InputError(
      fmt::format("{}: {} is wanted here, and this is {}", path, wanted, about(path, kind)));
}

void check_map_name(const std::string& path) {
  const std::string extension = lower_extension(path);
  const std::string others = known_cloud_formats() + " .yaml .mcap .bag .png ";
  if (extension.empty() || others.find(extension + " ") == std::string::npos) return;
  throw InputError(
      fmt::format("{}: a map is written, which is no {}; give it another name, such as {}",
                  path,
                  extension,
                  fs::path(path).replace_extension(".pfmap").string()));
}

}  // namespace pointflight::apps
