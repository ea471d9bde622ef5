#include "pointflight/sim/run_folder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStaging = ".partial";
constexpr const char* kKilled = ".killed";
constexpr const char* kLast = "summary.json";

/// Makes a folder; true if it was not there.
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

/// The files of the run that lies there.
std::vector<ListedFile> earlier_run_in(const Folder& folder) {
  if (auto files = read_file_list(folder)) return std::move(*files);
  if (folder.entry(kFileList) == Entry::kNothing) return {};
  throw InputError(
      fmt::format("{}/{}: is not the list of a run's files; move it away or choose another folder",
                  folder.path(),
                  kFileList));
}

void require_owned(const Folder& folder, const char* name) {
  if (is_owned(folder, name)) return;
  throw InputError(fmt::format(
      "{}/{}: was not made by a run; move it away or choose another folder", folder.path(), name));
}

bool lists(const std::vector<ListedFile>& files, const std::string& name) {
  const auto at =
      std::lower_bound(files.begin(), files.end(), name, [](const ListedFile& file, const auto& n) {
        return file.name < n;
      });
  return at != files.end() && at->name == name;
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

std::string file_of_run(const Folder& folder, const std::string& name, const std::string& table) {
  const Entry entry = folder.entry(name);
  if (entry == Entry::kFile) return folder.path() + "/" + name;
  throw InputError(fmt::format("{}: names '{}', which is {} in the run's folder",
                               table,
                               name,
                               entry == Entry::kNothing ? "not there" : "no file"));
}

bool remove_run(const Folder& parent, const std::string& name) {
  if (const auto folder = parent.below(name)) {
    remove_owned(*folder, kStaging);
    remove_owned(*folder, kKilled);
  }
  return remove_owned(parent, name);
}

RunFolder::RunFolder(std::string path, Existing existing) : path_(std::move(path)) {
  made_ = make_folder(path_);
  lock_.emplace(path_);
  folder_.emplace(path_);
  if (existing == Existing::kRefuse && !folder_->names().empty()) {
    throw InputError(fmt::format("{}: is not empty; choose another folder or give --force", path_));
  }
  earlier_ = earlier_run_in(*folder_);
  require_owned(*folder_, kStaging);
  require_owned(*folder_, kKilled);
  // if something is set aside already, the run that did it had no time to begin
  if (folder_->entry(kKilled) == Entry::kNothing) {
    static_cast<void>(folder_->rename(kStaging, *folder_, kKilled));
  }
  has_killed_ = folder_->entry(kKilled) != Entry::kNothing;
  remove_owned(*folder_, kStaging);
  staging_.emplace(*folder_, kStaging);
}

RunFolder::~RunFolder() {
  if (!open_) return;
  remove_owned(*folder_, kStaging);
  if (made_) ::rmdir(path_.c_str());  // if it is empty
}

/// Who has a name of the run's, and is not of an earlier one, is not ours to replace.
void RunFolder::check_free(const std::string& name) const {
  const Entry entry = folder_->entry(name);
  const bool ours = (entry == Entry::kFile || entry == Entry::kLink) && lists(earlier_, name);
  if (entry == Entry::kNothing || ours) return;
  throw InputError(fmt::format(
      "{}/{}: was not written by an earlier run, and this one has a file of that name; move it "
      "away or choose another folder",
      path_,
      name));
}

std::string RunFolder::file(const std::string& name) {
  check_free(name);
  return staging_->file(name);
}

std::string RunFolder::link(const std::string& name) {
  check_free(name);
  return staging_->link(name);
}

void RunFolder::forget_killed() {
  if (std::exchange(has_killed_, false)) remove_owned(*folder_, kKilled);
}

void RunFolder::move_in(const std::string& name) {
  const int error = staging_->folder().rename(name, *folder_, name);
  if (error == 0) return;
  throw InputError(fmt::format("{}/{}: cannot be moved there: {}; the run's files are in {}",
                               path_,
                               name,
                               std::generic_category().message(error),
                               staging_->path()));
}

void RunFolder::commit() {
  forget_killed();
  std::vector<ListedFile> files = staging_->files();
  std::erase_if(files, [&](const ListedFile& file) {  // listed and then not made
    const Entry entry = staging_->folder().entry(file.name);
    return entry != (file.is_link ? Entry::kLink : Entry::kFile);
  });
  for (const ListedFile& file : files) check_free(file.name);
  open_ = false;
  // whatever ends us from here on, the list says of each file there that it is a run's
  std::vector<ListedFile> both = earlier_;
  both.insert(both.end(), files.begin(), files.end());
  folder_->write(kFileList, file_list_text(both));
  if (lists(earlier_, kLast)) folder_->remove_file(kLast);  // first: what is not whole has none
  remove_listed(*folder_, earlier_);
  for (const ListedFile& file : files) {
    if (file.name != kLast) move_in(file.name);
  }
  folder_->write(kFileList, file_list_text(files));
  if (lists(files, kLast)) move_in(kLast);  // a run that has a summary is whole
  remove_owned(*folder_, kStaging);
}

}  // namespace pointflight
