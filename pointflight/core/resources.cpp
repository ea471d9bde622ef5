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

std::vector<std::string> model_names(const std::string& kind) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(fs::path(data_folder()) / kind, error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string resolve_path(const std::string& path, const std::string& base) {
  if (base.empty() || fs::path(path).is_absolute()) return path;
  return (fs::path(base) / path).lexically_normal().string();
}

bool is_model_path(const std::string& name_or_path) {
  return name_or_path.find('/') != std::string::npos ||
         (name_or_path.size() > 5 && name_or_path.ends_with(".yaml"));
}

std::string find_model(const std::string& kind,
                       const std::string& name_or_path,
                       const std::string& base) {
  if (is_model_path(name_or_path)) return resolve_path(name_or_path, base);
  const std::string path = (fs::path(data_folder()) / kind / (name_or_path + ".yaml")).string();
  std::error_code error;
  if (fs::is_regular_file(path, error)) return path;
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

}  // namespace pointflight
