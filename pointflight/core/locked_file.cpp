#include "pointflight/core/locked_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

/// Whoever held the lock before may have renamed the file: is this still the one of that name?
bool is_at(int descriptor, const std::string& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

}  // namespace

std::string write_error_text(int error) {
  const std::string text = std::generic_category().message(error);
  if (error == EMFILE || error == ENFILE) {
    return text + "; allow more (ulimit -n) or fly fewer vehicles";
  }
  return text + "; choose another place";
}

int open_locked(const std::string& path, const std::string& name) {
  for (;;) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0) {
      throw InputError(fmt::format("{}: cannot write: {}", name, write_error_text(errno)));
    }
    const int refused = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
    if (refused == EWOULDBLOCK) {
      ::close(descriptor);
      throw InputError(fmt::format(
          "{}: is being written at this moment, by another program or as another output of this "
          "one; give another name",
          name));
    }
    // a file system without locks: as before there were any
    if (refused != 0 || is_at(descriptor, path)) {
      // devices have no length
      if (::ftruncate(descriptor, 0) == 0 || errno == EINVAL) return descriptor;
      const int error = errno;
      ::close(descriptor);
      throw InputError(fmt::format("{}: cannot write: {}", name, write_error_text(error)));
    }
    ::close(descriptor);
  }
}

FolderLock::FolderLock(const std::string& folder)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    throw InputError(fmt::format(
        "{}: cannot open the folder: {}", folder, std::generic_category().message(errno)));
  }
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor_);
    throw InputError(fmt::format(
        "{}: another run is being written there at this moment; give another folder", folder));
  }
}

FolderLock::~FolderLock() {
  ::close(descriptor_);
}

}  // namespace pointflight
