#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace pointflight {

/// Throws InputError if the path is missing, or is a folder, a pipe, a socket or a device: these
/// have no beginning to come back to, and opening a pipe waits for whoever writes into it. What
/// reads a user's file by other means than MappedFile asks this first.
void require_regular_file(const std::string& path);

/// A file mapped read-only: pages come from the page cache and are shared between processes.
class MappedFile {
 public:
  /// Throws InputError if the file is missing, unreadable or not a regular file.
  explicit MappedFile(const std::string& path);

  /// Maps an open file, which stays open; `name` stands for its path in messages.
  MappedFile(int descriptor, std::string name);
  ~MappedFile();
  /// The other one is empty then; its views stay valid here.
  MappedFile(MappedFile&& other) noexcept;
  /// Changes places with `other`, which closes this one's file later.
  MappedFile& operator=(MappedFile&& other) noexcept;

  /// The whole file; valid as long as this one lives. Zeros if it was cut (`survive_cut_files`).
  [[nodiscard]] std::span<const std::byte> bytes() const { return {data_, size_}; }
  /// The same as characters.
  [[nodiscard]] std::string_view text() const {
    return {reinterpret_cast<const char*>(data_), size_};
  }
  /// As given to the constructor.
  [[nodiscard]] const std::string& path() const { return path_; }

  /// Tells the kernel that the file will be read once from front to back.
  void will_read_sequentially() const;

  /// Gives back the pages before `offset`: a streamed file does not grow the process.
  void release_before(std::size_t offset) const;

 private:
  void map(int descriptor);

  std::string path_;
  const std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

/// From now on a mapped file that another program cuts short does not end the process (SIGBUS): its
/// missing bytes read as zeros, and `throw_if_mapped_file_was_cut` says so. For a program's
/// `main`: the handler of SIGBUS is the process's.
void survive_cut_files();

/// Throws InputError if a mapped file of this process was cut short while it was read, as long
/// as that is open, and once after that if nobody was told. Loops and
/// outputs ask (`Executor::parallel_for`, `OutputFile::commit`), so that nothing is kept of what
/// was made from zeros.
void throw_if_mapped_file_was_cut();

}  // namespace pointflight
