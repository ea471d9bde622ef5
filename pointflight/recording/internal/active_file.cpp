#include "pointflight/recording/internal/active_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {

ActiveFile::ActiveFile(std::string path)
    : name_(std::move(path)), active_path_(name_.path() + ".active") {
  file_ = ::fdopen(open_locked(active_path_, active_path_), "wb");
  if (file_ == nullptr) {
    throw InputError(fmt::format(
        "{}: cannot be written: {}", active_path_, std::generic_category().message(errno)));
  }
}

ActiveFile::~ActiveFile() {
  if (file_ != nullptr) std::fclose(file_);
}

void ActiveFile::discard() {
  if (file_ == nullptr) return;
  remove_locked(::fileno(file_), active_path_);
  std::fclose(std::exchange(file_, nullptr));
}

void ActiveFile::fail(int error) {
  if (file_ != nullptr) std::fclose(file_);
  file_ = nullptr;
  throw InputError(fmt::format("{}: writing failed: {}; what was recorded until then is in it",
                               active_path_,
                               std::generic_category().message(error)));
}

void ActiveFile::write(std::span<const std::byte> bytes) {
  if (file_ == nullptr) return;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(errno);
  size_ += bytes.size();
}

void ActiveFile::flush() {
  if (file_ != nullptr && std::fflush(file_) != 0) fail(errno);
}

void ActiveFile::commit() {
  if (file_ == nullptr) return;
  flush();
  // some file systems say only here that they have no room; the lock stays with `file_`
  if (::close(::dup(::fileno(file_))) != 0) fail(errno);
  name_.take(active_path_, ::fileno(file_));
  std::fclose(std::exchange(file_, nullptr));
}

}  // namespace pointflight
