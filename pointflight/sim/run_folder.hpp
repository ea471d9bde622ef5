#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/locked_file.hpp"
#include "pointflight/core/owned_files.hpp"

namespace pointflight {

/// What to do if an output is there already.
enum class Existing { kRefuse, kReplace };

/// Where the files of a run are until it is whole: a folder within the run's.
std::string staging_of(const std::string& folder);

/// Where the files are of a run that was killed, if one was.
std::string killed_run_in(const std::string& folder);

/// The path of a file that a table of a run names, such as a scan. Throws InputError, which names
/// the table, unless it is a file in the run's folder itself: not elsewhere, not behind a link.
std::string file_of_run(const Folder& folder, const std::string& name, const std::string& table);

/// Removes a run from a folder below `parent`, finished or killed, by its lists. Returns true if
/// the folder is gone: nothing else was in it.
bool remove_run(const Folder& parent, const std::string& name);

/// The folder of a run while it is written: locked, and filled beside what lies there.
///
/// Files go to a folder within, `.partial`, and are listed there before they are made
/// (core/owned_files.hpp). `commit()` removes what an earlier run left (its `files.txt` says what
/// that is), moves the new files in, summary.json last. Without `commit()` the new files go and the
/// earlier run stays. What others have put there is never touched: a file of the run that would
/// take the name of one that no run wrote is an error.
///
/// What a killed run left (its staging folder) is set aside, as `.killed`, until `forget_killed`
/// or `commit`: a process that is to go on from it may end before it has begun.
class RunFolder : public OutputFolder {
 public:
  /// Makes the folder. Throws InputError if it cannot be written, where another run is being
  /// written there, with `kRefuse` if it holds anything, and where `.partial`, `.killed` or
  /// `files.txt` in it are not ours.
  explicit RunFolder(std::string path, Existing existing = Existing::kRefuse);
  ~RunFolder() override;
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// As it was given: where the files lie after `commit()`.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// The path to write a file of the run to until `commit()`. Throws InputError, also if a file
  /// that no run wrote has its name.
  std::string file(const std::string& name) override;
  std::string link(const std::string& name) override;

  /// Removes a file that is not to be part of the run after all.
  void drop(const std::string& name) const { staging_->folder().remove_file(name); }

  /// Removes what a killed run left.
  void forget_killed();
  /// Throws InputError if a file cannot be moved.
  void commit();

 private:
  void check_free(const std::string& name) const;
  void move_in(const std::string& name);

  std::string path_;
  bool made_ = false;  ///< The folder was not there.
  bool open_ = true;
  bool has_killed_ = false;  ///< Something is set aside.
  std::optional<FolderLock> lock_;
  std::optional<Folder> folder_;
  std::vector<ListedFile> earlier_;  ///< Files of the run that lies there, by name.
  std::optional<OwnedFolder> staging_;
};

}  // namespace pointflight
