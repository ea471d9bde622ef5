// Which files are ours: a program removes what it wrote itself, by a list, and nothing else.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/folder.hpp"

namespace pointflight {

/// In a folder, the list of the files there that one of our programs wrote.
inline constexpr const char* kFileList = "files.txt";

/// One line of such a list.
struct ListedFile {
  std::string name;                                    ///< Relative to the folder.
  bool is_link = false;                                ///< We made a symbolic link, not a file.
  bool operator==(const ListedFile&) const = default;  ///< Both are the same.
};

/// The list as text: a header by which it is known again, then a name per line, `\n` and `\\` for
/// what would break lines, an `@` behind the names of links.
std::string file_list_text(const std::vector<ListedFile>& files);

/// What such a text lists, sorted by name, each name once; nullopt unless it begins as our lists
/// do. Lines that cannot be names in the folder are left out.
std::optional<std::vector<ListedFile>> parse_file_list(std::string_view text);

/// The list of a folder; nullopt if it has none, or one that is not ours.
std::optional<std::vector<ListedFile>> read_file_list(const Folder& folder);

/// A folder that files are put into.
class OutputFolder {
 public:
  virtual ~OutputFolder() = default;
  /// Lists a file and makes the folders that it lies in; returns the path to write it to. Throws
  /// InputError.
  virtual std::string file(const std::string& name) = 0;
  /// The same for a symbolic link.
  virtual std::string link(const std::string& name) = 0;
};

/// A folder that is being filled: each file is listed before it is made, so that whatever ends the
/// process, what is ours can be told from what is not. Its list is locked meanwhile.
class OwnedFolder : public OutputFolder {
 public:
  /// Makes `name` in `parent` and begins its list. Throws InputError, also if it is there already.
  OwnedFolder(const Folder& parent, const std::string& name);
  ~OwnedFolder() override;
  OwnedFolder(const OwnedFolder&) = delete;
  OwnedFolder& operator=(const OwnedFolder&) = delete;

  std::string file(const std::string& name) override;
  std::string link(const std::string& name) override;

  /// The parent's path and the name.
  [[nodiscard]] const std::string& path() const { return folder_.path(); }
  /// The folder itself.
  [[nodiscard]] const Folder& folder() const { return folder_; }
  /// What is listed so far, sorted by name.
  [[nodiscard]] std::vector<ListedFile> files() const;

 private:
  std::string add(const ListedFile& file);

  Folder folder_;
  int list_ = -1;                      ///< Descriptor that appends to the list.
  std::map<std::string, bool> files_;  ///< By name: it is a link.
};

/// True while some process' `OwnedFolder` fills the folder `name`; false where the file system
/// knows no locks.
bool is_being_filled(const Folder& parent, const std::string& name);

/// Removes files of a list and the folders of their names that are empty then. What is no longer
/// what we wrote (a link for a file, a folder) stays. `keeps`: names that stay as well.
void remove_listed(const Folder& folder,
                   const std::vector<ListedFile>& files,
                   const std::function<bool(const std::string&)>& keeps = {});

/// Removes what the list of the folder `name` says (and the `NAME.partial` of each, in which
/// OutputFile writes), then the list, then the folder if nothing else is in it. Returns true if the
/// folder is gone or was not there. A folder without a list stays, unless it is empty.
bool remove_owned(const Folder& parent, const std::string& name);

/// True if `name` is nothing, or a folder that `remove_owned` may be asked to remove: one that has
/// a list of ours or nothing at all in it.
bool is_owned(const Folder& parent, const std::string& name);

}  // namespace pointflight
