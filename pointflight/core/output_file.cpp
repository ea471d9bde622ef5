#include "pointflight/core/output_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"

namespace pointflight {
namespace {

/// What this thread's files wait in.
thread_local OutputSet* current_set = nullptr;

}  // namespace

OutputFile::OutputFile(std::string path)
    : name_(std::move(path)), partial_path_(name_.path() + ".partial"), buffer_(1 << 18) {
  file_ = ::fdopen(open_locked(partial_path_, name_.path()), "wb");
  if (file_ == nullptr) fail(errno);
  std::setvbuf(file_, buffer_.data(), _IOFBF, buffer_.size());
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  // while it is still ours
  remove_locked(::fileno(file_), partial_path_);
  std::fclose(file_);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : name_(std::move(other.name_)),
      partial_path_(std::move(other.partial_path_)),
      buffer_(std::move(other.buffer_)),
      file_(std::exchange(other.file_, nullptr)) {}

void OutputFile::require_open() const {
  if (file_ == nullptr) throw std::logic_error("OutputFile: used after commit()");
}

void OutputFile::write(std::span<const std::byte> bytes) {
  require_open();
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(errno);
}

void OutputFile::write(std::string_view text) {
  write(std::as_bytes(std::span<const char>(text.data(), text.size())));
}

void OutputFile::write_at(std::size_t offset, std::span<const std::byte> bytes) {
  require_open();
  if (::fseeko(file_, static_cast<off_t>(offset), SEEK_SET) != 0) fail(errno);
  write(bytes);
  if (::fseeko(file_, 0, SEEK_END) != 0) fail(errno);
}

void OutputFile::flush() {
  require_open();
  if (std::fflush(file_) != 0) fail(errno);
}

void OutputFile::commit() {
  require_open();
  throw_if_mapped_file_was_cut();
  if (std::fflush(file_) != 0) fail(errno);
  // some file systems say only here that they have no room; the lock stays with `file_`
  if (::close(::dup(::fileno(file_))) != 0) fail(errno);
  if (current_set != nullptr) {
    current_set->complete_.push_back(std::move(*this));
  } else {
    appear();
  }
}

void OutputFile::appear() {
  name_.take(partial_path_, ::fileno(file_));
  std::fclose(std::exchange(file_, nullptr));
}

OutputSet::OutputSet() : outer_(std::exchange(current_set, this)) {}

OutputSet::~OutputSet() {
  current_set = outer_;
}

void OutputSet::commit() {
  for (OutputFile& file : complete_) {
    if (outer_ != nullptr) {
      outer_->complete_.push_back(std::move(file));
    } else {
      file.appear();
    }
  }
  complete_.clear();
}

void OutputFile::fail(int error) const {
  throw InputError(fmt::format("{}: cannot write: {}", path(), write_error_text(error)));
}

}  // namespace pointflight
