#pragma once

#include <string>

namespace pointflight {

/// Opens a file for writing: made if it is not there, locked, then emptied. While somebody has
/// it open, no other program gets it, nor a second output of this one. Returns the descriptor, to
/// be closed by the caller. Throws InputError that calls the file `name`, also if `path` is a link,
/// a device, a pipe or a file that has a second name: emptying it would destroy somebody's data.
int open_locked(const std::string& path, const std::string& name);

/// Removes a file that `open_locked` opened, unless its name stands for another one by now.
void remove_locked(int descriptor, const std::string& path);

/// The name that an output gets when it is complete.
class OutputName {
 public:
  /// Throws InputError if the path is empty, or if a link, a folder or a device is there.
  explicit OutputName(std::string path);
  /// As given to the constructor.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Gives the name to the complete file, which is open as `descriptor`. A file that was there
  /// before is replaced; what has appeared there since stays. Throws InputError.
  void take(const std::string& complete, int descriptor) const;

 private:
  std::string path_;
  bool was_there_ = false;  ///< A file had the name before.
};

/// Keeps a folder to this program as long as it lives; others that ask are refused. Where the file
/// system knows no locks on folders, nothing is kept.
class FolderLock {
 public:
  /// Throws InputError if another holds it.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

/// "File too large; choose another place": what a failed write means to the user.
std::string write_error_text(int error);

}  // namespace pointflight
