#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace pointflight {

/// A file without a name in `folder` (empty: that of temporary files), open for reading and
/// writing: it vanishes with its last descriptor, which is the caller's. Throws InputError.
int open_nameless_file(const std::string& folder);

/// Room for large arrays: in memory until together they reach a limit, beyond that in files without
/// a name in a folder, mapped, which the kernel can write out whenever memory is short. The files
/// vanish with the process, however it ends.
///
/// Arrays may be made from any thread and may outlive it.
class Scratch {
 public:
  static constexpr std::size_t kDefaultMemory = std::size_t{3} << 29;  ///< Bytes: 1.5 GiB.

  /// `folder` empty: that of temporary files. `memory_bytes` 0: every array is a file.
  explicit Scratch(std::string folder = {}, std::size_t memory_bytes = kDefaultMemory);

  /// Of all arrays that are alive and lie in memory.
  [[nodiscard]] std::size_t bytes_in_memory() const { return state_->in_memory; }
  /// The same for those that are files.
  [[nodiscard]] std::size_t bytes_in_files() const { return state_->in_files; }

 private:
  friend class ScratchBlock;
  struct State {
    std::string folder;
    std::size_t limit = 0;
    std::atomic<std::size_t> in_memory{0};
    std::atomic<std::size_t> in_files{0};
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

/// Zeroed bytes of a Scratch.
class ScratchBlock {
 public:
  ScratchBlock() = default;
  /// Throws InputError if the folder has no room.
  ScratchBlock(Scratch& scratch, std::size_t bytes);
  ~ScratchBlock();
  /// The other one is empty then.
  ScratchBlock(ScratchBlock&& other) noexcept;
  /// Changes places with `other`, which frees later what was here.
  ScratchBlock& operator=(ScratchBlock&& other) noexcept;

  /// Aligned to a page; null for no bytes.
  [[nodiscard]] std::byte* data() const { return data_; }

  /// These bytes will not be touched for a while: a block in a file stops counting as the process's
  /// memory. They stay what they are.
  void release(std::size_t begin, std::size_t end) const;

 private:
  std::shared_ptr<Scratch::State> scratch_;
  std::byte* data_ = nullptr;
  std::size_t bytes_ = 0;
  bool in_file_ = false;
};

/// A fixed number of values in a Scratch, zeroed at first.
template <class T>
class ScratchArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  ScratchArray() = default;
  /// Throws InputError if the folder has no room.
  ScratchArray(Scratch& scratch, std::size_t size)
      : block_(scratch, size * sizeof(T)), size_(size) {}
  /// The other one is empty then.
  ScratchArray(ScratchArray&& other) noexcept
      : block_(std::move(other.block_)), size_(std::exchange(other.size_, 0)) {}
  /// The other one is empty then, and frees later what was here.
  ScratchArray& operator=(ScratchArray&& other) noexcept {
    block_ = std::move(other.block_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }

  /// Values, not bytes.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Null if empty. Constness is the array's, not the values'.
  [[nodiscard]] T* data() const { return reinterpret_cast<T*>(block_.data()); }
  /// Not checked.
  [[nodiscard]] T& operator[](std::size_t i) const { return data()[i]; }
  /// The first value.
  [[nodiscard]] T* begin() const { return data(); }
  /// One past the last.
  [[nodiscard]] T* end() const { return data() + size_; }
  /// All of them.
  [[nodiscard]] std::span<T> span() const { return {data(), size_}; }

  /// Truncates to `size` values; the capacity is kept.
  void shrink(std::size_t size) { size_ = std::min(size, size_); }

  /// See ScratchBlock.
  void release(std::size_t begin, std::size_t end) const {
    block_.release(begin * sizeof(T), end * sizeof(T));
  }

 private:
  ScratchBlock block_;
  std::size_t size_ = 0;
};

}  // namespace pointflight
