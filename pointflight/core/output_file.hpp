#pragma once

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/locked_file.hpp"

namespace pointflight {

/// A file that appears under its name only when it is complete.
///
/// Bytes go to `<path>.partial`, which is locked and which `commit()` renames. Without `commit()`
/// (an exception, an interrupt) the partial file is removed. Every failed write throws InputError
/// with the path and the system's reason (disk full, no permission, ...), and so does `commit()`
/// if a file that was read has been cut short meanwhile (core/mapped_file.hpp), or if something has
/// appeared at `path` that was not there. Throws std::logic_error if it is used after `commit()`.
class OutputFile {
 public:
  /// Opens and locks the partial file. Throws InputError if it cannot, if another program is
  /// writing it, and if a link, a folder or a device is at `path`.
  explicit OutputFile(std::string path);
  ~OutputFile();
  /// Takes over the open file; the other one may only be destroyed.
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  /// Appends.
  void write(std::span<const std::byte> bytes);
  /// Appends.
  void write(std::string_view text);
  /// Replaces bytes written before: a header that counts what came after it.
  void write_at(std::size_t offset, std::span<const std::byte> bytes);
  /// Flushes to the partial file: what was written survives if the program is killed.
  void flush();
  /// All was written: gives the file its name, in place of one that was there; within an
  /// `OutputSet` once that is committed. Nothing may be written after it.
  void commit();

  /// The name that it will have.
  [[nodiscard]] const std::string& path() const { return name_.path(); }

 private:
  friend class OutputSet;
  [[noreturn]] void fail(int error) const;
  void require_open() const;
  /// Gives the complete file its name.
  void appear();

  OutputName name_;
  std::string partial_path_;
  std::vector<char> buffer_;
  std::FILE* file_ = nullptr;
};

/// Files that appear together or not at all, a cloud and its picture: what is committed on this
/// thread while the set lives waits, complete, for the set's own `commit`.
class OutputSet {
 public:
  OutputSet();
  /// Removes what was not committed.
  ~OutputSet();
  OutputSet(const OutputSet&) = delete;
  OutputSet& operator=(const OutputSet&) = delete;

  /// Gives all files their names. Throws InputError.
  void commit();

 private:
  friend class OutputFile;
  OutputSet* outer_;  ///< That this one lives in: takes its files.
  std::vector<OutputFile> complete_;
};

/// Bytes of a trivially copyable array, for `OutputFile::write`.
template <class T>
std::span<const std::byte> as_bytes(const std::vector<T>& values) {
  return std::as_bytes(std::span<const T>(values));
}

}  // namespace pointflight
