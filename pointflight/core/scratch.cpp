#include "pointflight/core/scratch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <system_error>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPage = 4096;

[[noreturn]] void fail(const std::string& folder, std::size_t bytes, int error) {
  if (error == ENOMEM) throw std::bad_alloc();  // of addresses, whatever the place
  throw InputError(
      fmt::format("{}: no room for {:.1f} GB of intermediate results: {}; choose "
                  "another place or a coarser --resolution",
                  folder,
                  1e-9 * static_cast<double>(bytes),
                  std::generic_category().message(error)));
}

std::string folder_or_default(std::string folder) {
  return folder.empty() ? std::filesystem::temp_directory_path().string() : std::move(folder);
}

/// -1 if there is none; errno says why.
int open_nameless(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  // some network file systems cannot
  std::string name = folder + "/pointflight-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

int open_nameless_file(const std::string& folder) {
  const std::string place = folder_or_default(folder);
  const int file = open_nameless(place);
  if (file >= 0) return file;
  throw InputError(fmt::format("{}: no file can be made there: {}; choose another place",
                               place,
                               std::generic_category().message(errno)));
}

Scratch::Scratch(std::string folder, std::size_t memory_bytes) {
  state_->folder = folder_or_default(std::move(folder));
  state_->limit = memory_bytes;
}

ScratchBlock::ScratchBlock(Scratch& scratch, std::size_t bytes)
    : scratch_(scratch.state_), bytes_((bytes + kPage - 1) / kPage * kPage) {
  if (bytes_ == 0) return;
  in_file_ = scratch_->in_memory.fetch_add(bytes_) + bytes_ > scratch_->limit;
  int file = -1;
  if (in_file_) {
    scratch_->in_memory -= bytes_;
    file = open_nameless(scratch_->folder);
    if (file < 0) fail(scratch_->folder, bytes_, errno);
    // takes the room now: a full disk is an error here and not a signal later
    const int error = ::posix_fallocate(file, 0, static_cast<off_t>(bytes_));
    if (error != 0) {
      ::close(file);
      fail(scratch_->folder, bytes_, error);
    }
  }
  const int flags = in_file_ ? MAP_SHARED : MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
  void* address = ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, flags, file, 0);
  const int error = errno;
  if (file >= 0) ::close(file);
  if (address == MAP_FAILED) {
    if (!in_file_) scratch_->in_memory -= bytes_;
    fail(scratch_->folder, bytes_, error);
  }
  data_ = static_cast<std::byte*>(address);
  if (in_file_) scratch_->in_files += bytes_;
}

ScratchBlock::~ScratchBlock() {
  if (data_ == nullptr) return;
  ::munmap(data_, bytes_);
  (in_file_ ? scratch_->in_files : scratch_->in_memory) -= bytes_;
}

ScratchBlock::ScratchBlock(ScratchBlock&& other) noexcept
    : scratch_(std::move(other.scratch_)),
      data_(std::exchange(other.data_, nullptr)),
      bytes_(std::exchange(other.bytes_, 0)),
      in_file_(other.in_file_) {}

ScratchBlock& ScratchBlock::operator=(ScratchBlock&& other) noexcept {
  std::swap(scratch_, other.scratch_);
  std::swap(data_, other.data_);
  std::swap(bytes_, other.bytes_);
  std::swap(in_file_, other.in_file_);
  return *this;
}

void ScratchBlock::release(std::size_t begin, std::size_t end) const {
  // pages that are shared with a neighbour too: the file keeps what is in them, and ranges may be
  // smaller than pages
  const std::size_t first = begin / kPage * kPage;
  const std::size_t last = std::min(bytes_, (end + kPage - 1) / kPage * kPage);
  if (in_file_ && data_ != nullptr && begin < end) {
    ::madvise(data_ + first, last - first, MADV_DONTNEED);
  }
}

}  // namespace pointflight
