#include "pointflight/core/mapped_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

std::string error_text(int error) {
  return std::generic_category().message(error);
}

}  // namespace

MappedFile::MappedFile(const std::string& path) : path_(path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0)
    throw InputError(fmt::format("{}: cannot open: {}; check the path", path, error_text(errno)));
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    throw InputError(fmt::format("{}: not a regular file; give the path of a file", path));
  }
  size_ = static_cast<std::size_t>(status.st_size);
  if (size_ > 0) {
    void* address = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED, file, 0);
    const int error = errno;
    ::close(file);
    if (address == MAP_FAILED) {
      throw InputError(fmt::format("{}: cannot map into memory: {}", path, error_text(error)));
    }
    data_ = static_cast<const std::byte*>(address);
  } else {
    ::close(file);
  }
}

MappedFile::~MappedFile() {
  if (data_ != nullptr) ::munmap(const_cast<std::byte*>(data_), size_);
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
  constexpr std::size_t kPage = 4096;
  const std::size_t length = offset / kPage * kPage;
  if (data_ != nullptr && length > 0 && length <= size_) {
    ::madvise(const_cast<std::byte*>(data_), length, MADV_DONTNEED);
  }
}

}  // namespace pointflight
