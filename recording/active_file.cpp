#include "recording/active_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"

namespace pointflight {

ActiveFile::ActiveFile(std::string path) : path_(std::move(path)), active_path_(path_ + ".active") {
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
  std::remove(active_path_.c_str());
  if (file_ != nullptr) std::fclose(file_);
  file_ = nullptr;
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
  std::error_code error;
  std::filesystem::rename(active_path_, path_, error);
  std::fclose(std::exchange(file_, nullptr));
  if (error) {
    throw InputError(
        fmt::format("{}: cannot be renamed to {}: {}", active_path_, path_, error.message()));
  }
}

}  // namespace pointflight
