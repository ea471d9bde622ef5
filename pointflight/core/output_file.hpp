#pragma once

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight {

/// A file that appears under its name only when it is complete.
///
/// Bytes go to `<path>.partial`, which is locked and which `commit()` renames. Without `commit()`
/// (an exception, an interrupt) the partial file is removed. Every failed write throws InputError
/// with the path and the system's reason (disk full, no permission, ...), and so does `commit()`
/// where a file that was read has been cut short meanwhile (core/mapped_file.hpp).
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);
  /// Replaces bytes written before: a header that counts what came after it.
  void write_at(std::size_t offset, std::span<const std::byte> bytes);
  void commit();

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  [[noreturn]] void fail(int error) const;

  std::string path_;
  std::string partial_path_;
  std::vector<char> buffer_;
  std::FILE* file_ = nullptr;
};

/// Bytes of a trivially copyable array, for `OutputFile::write`.
template <class T>
std::span<const std::byte> as_bytes(const std::vector<T>& values) {
  return std::as_bytes(std::span<const T>(values));
}

}  // namespace pointflight
