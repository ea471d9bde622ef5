#pragma once

#include <string>

namespace pointflight {

/// Opens a file for writing: made where it is not there, locked, then emptied. While somebody has
/// it open, no other program gets it, nor a second output of this one. Returns the descriptor, to
/// be closed by the caller. Throws InputError that calls the file `name`.
int open_locked(const std::string& path, const std::string& name);

/// Keeps a folder to this program as long as it lives; others that ask are refused. Where the file
/// system knows no locks on folders, nothing is kept.
class FolderLock {
 public:
  /// Throws InputError where another holds it.
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
