#include "pointflight/core/mapped_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <mutex>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMemoryPage = 4096;

std::string error_text(int error) {
  return std::generic_category().message(error);
}

[[noreturn]] void refuse(const std::string& path, const struct stat& status) {
  const bool streams = S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode);
  throw InputError(fmt::format("{}: {}not a regular file; give the path of a file",
                               path,
                               streams ? "a pipe or socket, " : ""));
}

/// A mapping as a signal handler can look it up.
struct Mapping {
  std::atomic<std::uintptr_t> begin{0};  ///< 0: free
  std::atomic<std::uintptr_t> end{0};
  std::atomic<bool> cut{false};
  bool told = false;  ///< That it was cut; under the mutex, as is the path.
  std::string path;
};

struct Mappings {
  std::array<Mapping, 1024> list;
  std::mutex mutex;
  std::atomic<bool> any_cut{false};
  std::string untold_path;  ///< Of one that is closed already.
};

Mappings& mappings() {
  static auto& all = *new Mappings;  // files may be unmapped after static objects are gone
  return all;
}

void register_mapping(const std::byte* data, std::size_t size, const std::string& path) {
  Mappings& all = mappings();
  const std::lock_guard lock(all.mutex);
  for (Mapping& mapping : all.list) {
    if (mapping.begin != 0) continue;
    mapping.path = path;
    mapping.cut = false;
    mapping.told = false;
    mapping.end = reinterpret_cast<std::uintptr_t>(data) + size;
    mapping.begin = reinterpret_cast<std::uintptr_t>(data);
    return;
  }
  // more than anybody opens: the rest is not guarded
}

void forget_mapping(const std::byte* data) {
  Mappings& all = mappings();
  const std::lock_guard lock(all.mutex);
  bool any_cut = false;
  for (Mapping& mapping : all.list) {
    if (mapping.begin == reinterpret_cast<std::uintptr_t>(data)) {
      if (mapping.cut && !mapping.told) all.untold_path = mapping.path;
      mapping.begin = 0;
    }
    any_cut = any_cut || (mapping.begin != 0 && mapping.cut);
  }
  all.any_cut = any_cut || !all.untold_path.empty();
}

/// Puts zeros if the file has ended, so that the reader goes on until somebody looks; its
/// offsets are bounded, whatever the bytes say.
void on_bus_error(int signal, siginfo_t* info, void* /*context*/) {
  const auto address = reinterpret_cast<std::uintptr_t>(info->si_addr);
  for (Mapping& mapping : mappings().list) {
    const std::uintptr_t begin = mapping.begin;
    if (begin == 0 || address < begin || address >= mapping.end) continue;
    const std::uintptr_t page = address / kMemoryPage * kMemoryPage;
    if (::mmap(reinterpret_cast<void*>(page),
               kMemoryPage,
               PROT_READ,
               MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED,
               -1,
               0) == MAP_FAILED) {
      break;
    }
    mapping.cut = true;
    mappings().any_cut = true;
    return;
  }
  // not ours: as if there were no handler
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

void survive_cut_files() {
  mappings();  // made here and not in a handler
  struct sigaction action {};
  action.sa_sigaction = on_bus_error;
  action.sa_flags = SA_SIGINFO;
  ::sigaction(SIGBUS, &action, nullptr);
}

void throw_if_mapped_file_was_cut() {
  Mappings& all = mappings();
  if (!all.any_cut.load(std::memory_order_relaxed)) return;
  const std::lock_guard lock(all.mutex);
  std::string path = std::exchange(all.untold_path, {});
  all.any_cut = false;
  for (Mapping& mapping : all.list) {
    if (mapping.begin == 0 || !mapping.cut) continue;
    mapping.told = true;
    all.any_cut = true;  // as long as it is open
    path = mapping.path;
  }
  if (path.empty()) return;
  throw InputError(fmt::format(
      "{}: was cut short by another program while it was read; write such files beside and rename "
      "them, then start again",
      path));
}

void require_regular_file(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    throw InputError(fmt::format("{}: cannot open: {}; check the path", path, error_text(errno)));
  }
  if (!S_ISREG(status.st_mode)) refuse(path, status);
}

MappedFile::MappedFile(const std::string& path) : path_(path) {
  require_regular_file(path);
  // without waiting, should a pipe have taken the file's place meanwhile
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0)
    throw InputError(fmt::format("{}: cannot open: {}; check the path", path, error_text(errno)));
  try {
    map(file);
  } catch (...) {
    ::close(file);
    throw;
  }
  ::close(file);
}

MappedFile::MappedFile(int descriptor, std::string name) : path_(std::move(name)) {
  map(descriptor);
}

void MappedFile::map(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) refuse(path_, status);
  size_ = static_cast<std::size_t>(status.st_size);
  if (size_ == 0) return;
  void* address = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED, descriptor, 0);
  if (address == MAP_FAILED) {
    size_ = 0;
    throw InputError(fmt::format("{}: cannot map into memory: {}", path_, error_text(errno)));
  }
  data_ = static_cast<const std::byte*>(address);
  register_mapping(data_, size_, path_);
}

MappedFile::~MappedFile() {
  if (data_ == nullptr) return;
  forget_mapping(data_);
  ::munmap(const_cast<std::byte*>(data_), size_);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : path_(std::move(other.path_)),
      data_(std::exchange(other.data_, nullptr)),
      size_(std::exchange(other.size_, 0)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

void MappedFile::will_read_sequentially() const {
  if (data_ != nullptr) ::madvise(const_cast<std::byte*>(data_), size_, MADV_SEQUENTIAL);
}

void MappedFile::release_before(std::size_t offset) const {
  const std::size_t length = offset / kMemoryPage * kMemoryPage;
  if (data_ != nullptr && length > 0 && length <= size_) {
    ::madvise(const_cast<std::byte*>(data_), length, MADV_DONTNEED);
  }
}

}  // namespace pointflight
