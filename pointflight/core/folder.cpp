#include "pointflight/core/folder.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"

namespace pointflight {
namespace {

constexpr int kOpenFolder = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

std::string reason_of(int error) {
  return std::generic_category().message(error);
}

/// A mount: of the same file system, too, if the kernel tells them apart (5.8 and later).
struct Mount {
  std::uint64_t device = 0;
  std::uint64_t number = 0;
  bool operator==(const Mount&) const = default;
};

std::optional<Mount> mount_of(int folder, const char* name, int flags) {
  struct statx status {};
  if (::statx(folder, name, flags, STATX_BASIC_STATS | STATX_MNT_ID, &status) != 0) {
    return std::nullopt;
  }
  Mount mount;
  mount.device = (std::uint64_t{status.stx_dev_major} << 32u) | status.stx_dev_minor;
  if ((status.stx_mask & STATX_MNT_ID) != 0) mount.number = status.stx_mnt_id;
  return mount;
}

/// An entry of a folder, not one below it.
Entry entry_at(int folder, const char* name) {
  struct stat status {};
  if (::fstatat(folder, name, &status, AT_SYMLINK_NOFOLLOW) != 0) {
    return errno == ENOENT ? Entry::kNothing : Entry::kOther;
  }
  if (S_ISLNK(status.st_mode)) return Entry::kLink;
  if (!S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) return Entry::kOther;
  const auto here = mount_of(folder, "", AT_EMPTY_PATH);
  const auto there = mount_of(folder, name, AT_SYMLINK_NOFOLLOW | AT_NO_AUTOMOUNT);
  if (!here || !there || *here != *there) return Entry::kOther;
  return S_ISDIR(status.st_mode) ? Entry::kFolder : Entry::kFile;
}

/// -1 unless it is a folder on the same mount.
int open_below(int folder, const char* name) {
  const int below = ::openat(folder, name, kOpenFolder);
  if (below < 0) return -1;
  const auto here = mount_of(folder, "", AT_EMPTY_PATH);
  const auto there = mount_of(below, "", AT_EMPTY_PATH);
  if (here && there && *here == *there) return below;
  ::close(below);
  return -1;
}

int rename_to_new_at(int from_folder, const char* from, int to_folder, const char* to) {
  if (::renameat2(from_folder, from, to_folder, to, RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  // a file system that knows no such rename: as near to it as can be
  struct stat status {};
  if (::fstatat(to_folder, to, &status, AT_SYMLINK_NOFOLLOW) == 0) return EEXIST;
  return ::renameat(from_folder, from, to_folder, to) == 0 ? 0 : errno;
}

}  // namespace

struct Folder::Place {
  int folder = -1;
  bool owned = false;  ///< The descriptor is to be closed.
  std::string last;

  Place() = default;
  Place(Place&& other) noexcept
      : folder(std::exchange(other.folder, -1)),
        owned(std::exchange(other.owned, false)),
        last(std::move(other.last)) {}
  Place& operator=(Place&&) = delete;
  ~Place() { close(); }

  /// Another folder takes the place of the one that it lies in.
  void move_to(int next) {
    close();
    folder = next;
    owned = next >= 0;
  }
  void close() {
    if (owned) ::close(folder);
    owned = false;
  }
};

Folder::Place Folder::find(std::string_view name, bool make) const {
  Place place;
  if (name.empty() || name.front() == '/' || name.find('\0') != std::string_view::npos) {
    return place;
  }
  place.folder = descriptor_;
  for (;;) {
    const std::size_t slash = name.find('/');
    place.last = std::string(name.substr(0, slash));
    if (place.last.empty() || place.last == "." || place.last == "..") {
      place.move_to(-1);
      return place;
    }
    if (slash == std::string_view::npos) return place;
    if (make) ::mkdirat(place.folder, place.last.c_str(), 0777);
    place.move_to(open_below(place.folder, place.last.c_str()));
    if (place.folder < 0) return place;
    name.remove_prefix(slash + 1);
  }
}

Folder::Folder(const std::string& path)
    : descriptor_(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)), path_(path) {
  if (descriptor_ < 0) {
    throw InputError(fmt::format("{}: cannot open the folder: {}", path, reason_of(errno)));
  }
}

Folder::Folder(int descriptor, std::string path)
    : descriptor_(descriptor), path_(std::move(path)) {}

Folder::~Folder() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Folder::Folder(Folder&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)) {}

Folder& Folder::operator=(Folder&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  return *this;
}

Entry Folder::entry(std::string_view name) const {
  // a part that is missing is no entry; one that is not a folder leads nowhere
  for (std::size_t slash = name.find('/'); slash != std::string_view::npos;
       slash = name.find('/', slash + 1)) {
    const Place part = find(name.substr(0, slash), false);
    if (part.folder < 0) return Entry::kOther;
    const Entry found = entry_at(part.folder, part.last.c_str());
    if (found != Entry::kFolder) return found == Entry::kNothing ? found : Entry::kOther;
  }
  const Place place = find(name, false);
  return place.folder < 0 ? Entry::kOther : entry_at(place.folder, place.last.c_str());
}

std::vector<std::string> Folder::names() const {
  std::vector<std::string> names;
  // a stream of its own: it closes its descriptor and moves its position
  const int own = ::openat(descriptor_, ".", kOpenFolder);
  const auto close = [](DIR* stream) { ::closedir(stream); };
  const std::unique_ptr<DIR, decltype(close)> stream(own < 0 ? nullptr : ::fdopendir(own), close);
  if (!stream) {
    if (own >= 0) ::close(own);
    throw InputError(fmt::format("{}: cannot be listed: {}", path_, reason_of(errno)));
  }
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the stream is this call's own
  while (const dirent* entry = ::readdir(stream.get())) {
    const std::string_view name = entry->d_name;
    if (name != "." && name != "..") names.emplace_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<Folder> Folder::below(std::string_view name) const {
  const Place place = find(name, false);
  if (place.folder < 0) return std::nullopt;
  const int opened = open_below(place.folder, place.last.c_str());
  if (opened < 0) return std::nullopt;
  return Folder(opened, fmt::format("{}/{}", path_, name));
}

std::optional<Folder> Folder::make(std::string_view name) const {
  const Place place = find(name, true);
  if (place.folder < 0) return std::nullopt;
  ::mkdirat(place.folder, place.last.c_str(), 0777);
  return below(name);
}

std::optional<std::string> Folder::read(std::string_view name, std::size_t most) const {
  const Place place = find(name, false);
  if (place.folder < 0) return std::nullopt;
  // without waiting, should it be a pipe
  const int file =
      ::openat(place.folder, place.last.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::optional<std::string> text;
  struct stat status {};
  if (::fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
      static_cast<std::uint64_t>(status.st_size) <= most) {
    text.emplace();
    std::array<char, 1 << 16> part{};
    ssize_t got = 0;
    while ((got = ::read(file, part.data(), part.size())) > 0 && text->size() <= most) {
      text->append(part.data(), static_cast<std::size_t>(got));
    }
    if (got != 0) text.reset();
  }
  ::close(file);
  return text;
}

std::string Folder::temporary_name(std::string_view name) {
  return fmt::format(".{}.pointflight", name);
}

void Folder::write(std::string_view name, std::string_view text) const {
  const auto fail = [&](int error) {
    throw InputError(fmt::format("{}/{}: cannot write: {}", path_, name, write_error_text(error)));
  };
  const Place place = find(name, true);
  if (place.folder < 0) fail(ENOTDIR);
  const std::string partial = temporary_name(place.last);
  ::unlinkat(place.folder, partial.c_str(), 0);  // left by a process that was killed in here
  const int file = ::openat(
      place.folder, partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0) fail(errno);
  int error = 0;
  while (!text.empty() && error == 0) {
    const ssize_t wrote = ::write(file, text.data(), text.size());
    if (wrote < 0 && errno != EINTR) error = errno;
    if (wrote > 0) text.remove_prefix(static_cast<std::size_t>(wrote));
  }
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 &&
      ::renameat(place.folder, partial.c_str(), place.folder, place.last.c_str()) != 0) {
    error = errno;
  }
  if (error == 0) return;
  ::unlinkat(place.folder, partial.c_str(), 0);
  fail(error);
}

bool Folder::remove_file(std::string_view name) const {
  const Place place = find(name, false);
  if (place.folder < 0) return false;
  const Entry entry = entry_at(place.folder, place.last.c_str());
  if (entry != Entry::kFile && entry != Entry::kLink) return false;
  return ::unlinkat(place.folder, place.last.c_str(), 0) == 0;
}

bool Folder::remove_empty_folder(std::string_view name) const {
  const Place place = find(name, false);
  if (place.folder < 0 || entry_at(place.folder, place.last.c_str()) != Entry::kFolder)
    return false;
  return ::unlinkat(place.folder, place.last.c_str(), AT_REMOVEDIR) == 0;
}

int Folder::rename(std::string_view from, const Folder& to, std::string_view name) const {
  const Place source = find(from, false);
  const Place target = to.find(name, true);
  if (source.folder < 0 || target.folder < 0) return ENOTDIR;
  return rename_to_new_at(source.folder, source.last.c_str(), target.folder, target.last.c_str());
}

int rename_to_new(const std::string& from, const std::string& to) {
  return rename_to_new_at(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str());
}

}  // namespace pointflight
