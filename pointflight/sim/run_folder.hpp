#pragma once

#include <optional>
#include <string>

#include "pointflight/core/locked_file.hpp"

namespace pointflight {

/// What to do where an output is there already.
enum class Existing { kRefuse, kReplace };

/// Where the files of a run are until it is whole: a folder within the run's.
std::string staging_of(const std::string& folder);

/// Where the files are of a run that was killed, if one was.
std::string killed_run_in(const std::string& folder);

/// The folder of a run while it is written: locked, and filled beside what lies there.
///
/// Files go to `staging()`, a folder within. `commit()` takes away what an earlier run left (its
/// `files.txt` says what that is), moves the new files in, summary.json last, and writes files.txt.
/// Without `commit()` the new files go and the earlier run stays. What others have put there is
/// never touched, unless a file of the run has its name.
///
/// What a killed run left (its staging folder) is set aside, as `.killed`, until `forget_killed`
/// or `commit`: a process that is to go on from it may end before it has begun.
class RunFolder {
 public:
  /// Makes the folder. Throws InputError where it cannot be written, where another run is being
  /// written there, and, with `kRefuse`, where it holds anything.
  explicit RunFolder(std::string path, Existing existing = Existing::kRefuse);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// As it was given: where the files lie after `commit()`.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Where to write until `commit()`.
  [[nodiscard]] const std::string& staging() const { return staging_; }

  /// Takes away what a killed run left.
  void forget_killed();
  /// Throws InputError where a file cannot be moved.
  void commit();

 private:
  std::string path_;
  std::string staging_;
  bool made_ = false;  ///< The folder was not there.
  bool open_ = true;
  bool has_killed_ = false;  ///< Something is set aside.
  std::optional<FolderLock> lock_;
};

}  // namespace pointflight
