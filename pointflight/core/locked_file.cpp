#include "pointflight/core/locked_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "pointflight/core/folder.hpp"
#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

/// Whoever held the lock before may have renamed the file: is this still the one of that name?
bool is_at(int descriptor, const std::string& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

[[noreturn]] void refuse(const std::string& path) {
  throw InputError(fmt::format(
      "{}: is there and was not left by a program of ours (a link, a pipe, a file with a second "
      "name); move it away or give another name",
      path));
}

/// What lies at an output's name: 0 nothing, S_IFREG, S_IFLNK, ...
mode_t kind_of(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 ? status.st_mode & S_IFMT : 0;
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
    // never through a link: what it points to is not ours to empty
    const int descriptor =
        ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    if (descriptor < 0) {
      if (errno == ELOOP || errno == ENXIO) refuse(path);
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
      struct stat status {};
      if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode) || status.st_nlink > 1) {
        ::close(descriptor);
        refuse(path);
      }
      if (::ftruncate(descriptor, 0) == 0) return descriptor;
      const int error = errno;
      ::close(descriptor);
      throw InputError(fmt::format("{}: cannot write: {}", name, write_error_text(error)));
    }
    ::close(descriptor);
  }
}

void remove_locked(int descriptor, const std::string& path) {
  if (is_at(descriptor, path)) ::unlink(path.c_str());
}

OutputName::OutputName(std::string path) : path_(std::move(path)) {
  if (path_.empty()) throw InputError("no name is given for a file to write");
  // renaming would replace a device, another's folder, or a link that somebody has put there
  const mode_t kind = kind_of(path_);
  if (kind == S_IFLNK) {
    throw InputError(fmt::format(
        "{}: is a symbolic link; give the path of the file that is to be written", path_));
  }
  if (kind != 0 && kind != S_IFREG) {
    throw InputError(
        fmt::format("{}: is there and is not a regular file; give the path of a file", path_));
  }
  was_there_ = kind == S_IFREG;
}

void OutputName::take(const std::string& complete, int descriptor) const {
  const mode_t kind = kind_of(path_);
  const bool is_taken = was_there_ && kind != 0 && kind != S_IFREG;
  int error = 0;
  if (is_taken || !is_at(descriptor, complete)) {
    error = EEXIST;
  } else if (!was_there_) {
    error = rename_to_new(complete, path_);
  } else if (::rename(complete.c_str(), path_.c_str()) != 0) {
    error = errno;
  }
  if (error == 0) return;
  throw InputError(fmt::format(
      "{}: cannot write: {}",
      path_,
      error == EEXIST
          ? "somebody has put something there meanwhile; move it away or give another name"
          : write_error_text(error)));
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
