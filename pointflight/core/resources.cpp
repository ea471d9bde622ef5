#include "pointflight/core/resources.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"

namespace pointflight {
namespace fs = std::filesystem;

namespace {

/// A function's, for it is used before main.
std::vector<std::string>& added_folders() {
  static std::vector<std::string> folders;
  return folders;
}

}  // namespace

bool add_data_folder(const std::string& folder) {
  added_folders().push_back(folder);
  return true;
}

std::string data_folder() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing in the program calls setenv
  if (const char* set = std::getenv("POINTFLIGHT_DATA")) return set;
  std::vector<std::string> places;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    places.push_back((program.parent_path().parent_path() / "share" / "pointflight").string());
  }
  places.insert(places.end(), added_folders().begin(), added_folders().end());
  places.emplace_back(POINTFLIGHT_INSTALLED_DATA);
  for (const std::string& place : places) {
    if (fs::is_directory(fs::path(place) / "lidars", error)) return place;
  }
  return POINTFLIGHT_SOURCE_DATA;
}

namespace {

/// Names of the files of a folder with an extension, without it, sorted.
std::vector<std::string> names_in(const fs::path& folder, const char* extension) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == extension) names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

}  // namespace

std::vector<std::string> model_names(const std::string& kind) {
  const fs::path folder = fs::path(data_folder()) / kind;
  auto names = names_in(folder, ".yaml");
  if (!names.empty()) return names;
  throw InputError(fmt::format(
      "{}: no {} here: the program's data are not found; set POINTFLIGHT_DATA to the "
      "folder that holds lidars/ and vehicles/ (<prefix>/share/pointflight, or data/ of "
      "the source tree)",
      folder.string(),
      kind));
}

std::string resolve_path(const std::string& path, const std::string& base) {
  if (base.empty() || fs::path(path).is_absolute()) return path;
  return (fs::path(base) / path).lexically_normal().string();
}

bool is_model_path(const std::string& name_or_path) {
  const auto ends = [&](std::string_view extension) {
    return name_or_path.size() > extension.size() && name_or_path.ends_with(extension);
  };
  return name_or_path.find('/') != std::string::npos || ends(".yaml") || ends(".json") ||
         ends(".csv");
}

std::string find_model(const std::string& kind,
                       const std::string& name_or_path,
                       const std::string& base) {
  if (is_model_path(name_or_path)) return resolve_path(name_or_path, base);
  const std::string path = (fs::path(data_folder()) / kind / (name_or_path + ".yaml")).string();
  if (is_file(path)) return path;
  const auto known = model_names(kind);
  const std::string guess = closest_word(name_or_path, known);
  throw InputError(
      fmt::format("'{}' is not among the shipped {} ({}){}; give one of them or the "
                  "path of a .yaml file",
                  name_or_path,
                  kind,
                  fmt::join(known, ", "),
                  guess.empty() ? "" : fmt::format(", did you mean '{}'?", guess)));
}

std::string find_table(const std::string& kind,
                       const std::string& name_or_path,
                       const std::string& base) {
  const fs::path beside = resolve_path(name_or_path, base);
  if (fs::path(name_or_path).is_absolute()) return beside.string();
  const fs::path shipped = fs::path(data_folder()) / kind;
  const bool is_name = name_or_path.find('/') == std::string::npos;
  const std::string file =
      is_name && !name_or_path.ends_with(".csv") ? name_or_path + ".csv" : name_or_path;
  const fs::path among_tables = (is_name ? shipped / "tables" : shipped) / file;
  for (const fs::path& path : {beside, among_tables}) {
    if (is_file(path)) return path.string();
  }
  throw InputError(
      fmt::format("'{}' is neither {} nor {}; give a path from this file's folder, or "
                  "one of the shipped tables: {}",
                  name_or_path,
                  beside.string(),
                  among_tables.string(),
                  fmt::join(names_in(shipped / "tables", ".csv"), ", ")));
}

}  // namespace pointflight
