#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight {

/// What a name in a folder stands for.
enum class Entry {
  kNothing,  ///< No such name.
  kFile,     ///< A regular file.
  kLink,     ///< A symbolic link, wherever it points.
  kFolder,   ///< A folder on the same file system.
  kOther,    ///< A device, a pipe, a mount point, or a name that only a link or a mount leads to.
};

/// A folder held open by its descriptor.
///
/// Names are relative to it ("scans/0_000001.pcd") and are looked up part by part: never through a
/// symbolic link, never into another mount, never upwards. Another process that swaps a name for a
/// link meanwhile can make an operation fail but cannot lead it elsewhere. Everything in the
/// product that removes files or replaces folders does it here.
class Folder {
 public:
  /// Opens a folder that the user named: links in `path` itself are followed. Throws InputError.
  explicit Folder(const std::string& path);
  ~Folder();
  /// The other one may only be destroyed or assigned to.
  Folder(Folder&& other) noexcept;
  /// Changes places with `other`.
  Folder& operator=(Folder&& other) noexcept;

  /// As given to the constructor, or the parent's path and the name; for messages.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// What a name stands for.
  [[nodiscard]] Entry entry(std::string_view name) const;
  /// Names directly in this folder, sorted.
  [[nodiscard]] std::vector<std::string> names() const;

  /// A folder below; nullopt unless `entry` says that it is one.
  [[nodiscard]] std::optional<Folder> below(std::string_view name) const;
  /// The same, made if parts of it are missing.
  [[nodiscard]] std::optional<Folder> make(std::string_view name) const;
  /// A regular file's text; nullopt if there is none or it is larger than `most` bytes.
  [[nodiscard]] std::optional<std::string> read(std::string_view name, std::size_t most) const;
  /// Puts a text file in place of one that is there, by way of `temporary_name`. Throws InputError.
  void write(std::string_view name, std::string_view text) const;

  /// What `write` calls a file while it is incomplete; a name that nobody else would use.
  static std::string temporary_name(std::string_view name);

  /// Removes a file, or a link itself; false if there is neither, or it cannot be removed.
  bool remove_file(std::string_view name) const;
  /// Removes a folder that is empty; false if it is not one.
  bool remove_empty_folder(std::string_view name) const;
  /// Gives an entry another name, in `to`, if nothing has it yet. Returns 0 or errno (EEXIST).
  [[nodiscard]] int rename(std::string_view from, const Folder& to, std::string_view name) const;

 private:
  Folder(int descriptor, std::string path);
  /// The folder that the last part of a name lies in, and that part; the descriptor is this one's
  /// own for a single part. -1: it cannot be reached.
  struct Place;
  [[nodiscard]] Place find(std::string_view name, bool make) const;

  int descriptor_ = -1;
  std::string path_;
};

/// Gives a file another name if nothing has it yet; both names are paths of the user. Returns 0
/// or errno.
[[nodiscard]] int rename_to_new(const std::string& from, const std::string& to);

}  // namespace pointflight
