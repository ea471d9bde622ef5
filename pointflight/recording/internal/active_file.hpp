#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>

#include "pointflight/core/locked_file.hpp"

namespace pointflight {

/// A recording that grows: `NAME.active`, locked, until it is complete, then `NAME`. What was
/// flushed stays readable whatever happens to the program. A failed write throws InputError with
/// the path and the system's reason.
class ActiveFile {
 public:
  explicit ActiveFile(std::string path);
  ~ActiveFile();
  ActiveFile(const ActiveFile&) = delete;
  ActiveFile& operator=(const ActiveFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void flush();
  /// Closes it and gives it its name.
  void commit();
  /// Takes it away: nothing of worth is in it yet.
  void discard();

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::string& path() const { return name_.path(); }

 private:
  [[noreturn]] void fail(int error);

  OutputName name_;
  std::string active_path_;
  std::FILE* file_ = nullptr;
  std::uint64_t size_ = 0;
};

}  // namespace pointflight
