#include "pointflight/sim/run_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/output_file.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStaging = ".partial";
constexpr const char* kKilled = ".killed";
constexpr const char* kManifest = "files.txt";
constexpr const char* kLast = "summary.json";

/// Makes a folder; true where it was not there.
bool make_folder(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw InputError(fmt::format("{}: is a file; give a folder", folder));
  }
  const bool made = fs::create_directories(folder, error);
  if (error) {
    throw InputError(
        fmt::format("{}: cannot make the folder: {}; choose another", folder, error.message()));
  }
  return made;
}

/// Files below a folder, by name, relative to it. Links count as files.
std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory() && !entry.is_symlink()) continue;
    files.push_back(entry.path().lexically_relative(folder));
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// A manifest may say anything: only what lies below the folder is taken.
bool is_below(const fs::path& relative) {
  return !relative.empty() && relative.is_relative() &&
         std::none_of(relative.begin(), relative.end(), [](const fs::path& part) {
           return part == ".." || part == ".";
         });
}

/// Takes away the files that an earlier run says it wrote, and folders that are empty then.
void remove_earlier_run(const fs::path& folder) {
  std::vector<fs::path> files = {kManifest};
  std::ifstream manifest(folder / kManifest);
  for (std::string line; std::getline(manifest, line);) {
    if (is_below(line)) files.emplace_back(line);
  }
  std::error_code ignored;
  fs::remove(folder / kLast, ignored);  // first: what is not whole has none
  for (const fs::path& file : files) {
    if (!fs::is_directory(fs::symlink_status(folder / file, ignored))) {
      fs::remove(folder / file, ignored);
    }
    // refuses where anything is left
    for (fs::path up = file.parent_path(); !up.empty(); up = up.parent_path()) {
      if (fs::is_empty(folder / up, ignored)) fs::remove(folder / up, ignored);
    }
  }
}

}  // namespace

std::string staging_of(const std::string& folder) {
  return (fs::path(folder) / kStaging).string();
}

std::string killed_run_in(const std::string& folder) {
  const fs::path aside = fs::path(folder) / kKilled;
  std::error_code ignored;
  return fs::exists(aside, ignored) ? aside.string() : staging_of(folder);
}

RunFolder::RunFolder(std::string path, Existing existing)
    : path_(std::move(path)), staging_(staging_of(path_)) {
  made_ = make_folder(path_);
  lock_.emplace(path_);
  std::error_code error;
  if (existing == Existing::kRefuse && !fs::is_empty(path_, error)) {
    throw InputError(fmt::format("{}: is not empty; choose another folder or give --force", path_));
  }
  // where something is set aside already, the run that did it had no time to begin
  const fs::path aside = fs::path(path_) / kKilled;
  if (!fs::exists(aside, error)) fs::rename(staging_, aside, error);
  has_killed_ = fs::exists(aside, error);
  fs::remove_all(staging_, error);
  make_folder(staging_);
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  if (open_) fs::remove_all(staging_, ignored);
  if (open_ && made_) fs::remove(path_, ignored);
}

void RunFolder::forget_killed() {
  if (!std::exchange(has_killed_, false)) return;
  std::error_code ignored;
  fs::remove_all(fs::path(path_) / kKilled, ignored);
}

void RunFolder::commit() {
  forget_killed();
  const fs::path from = staging_;
  const fs::path to = path_;
  std::vector<fs::path> files = files_below(from);
  {
    OutputFile manifest((from / kManifest).string());
    for (const fs::path& file : files) manifest.write(file.generic_string() + "\n");
    manifest.commit();
  }
  files.emplace_back(kManifest);
  // a run that has a summary is whole
  std::stable_partition(
      files.begin(), files.end(), [](const fs::path& file) { return file != kLast; });
  open_ = false;
  remove_earlier_run(to);
  for (const fs::path& file : files) {
    std::error_code error;
    fs::create_directories((to / file).parent_path(), error);
    fs::rename(from / file, to / file, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be moved there: {}; the run's files are in {}",
                                   (to / file).string(),
                                   error.message(),
                                   staging_));
    }
  }
  std::error_code ignored;
  fs::remove_all(from, ignored);
}

}  // namespace pointflight
