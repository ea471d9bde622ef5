#include "pointflight/core/owned_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"

namespace pointflight {
namespace {

constexpr std::string_view kHeader =
    "# pointflight: files that a run wrote here; fly --force removes these and no others\n";
constexpr std::size_t kLongest = std::size_t{64} << 20u;  // bytes of a list

/// A name as a line, without its end.
std::string line_of(const ListedFile& file) {
  std::string line;
  for (const char c : file.name) {
    if (c == '\n') {
      line += "\\n";
    } else {
      if (c == '\\' || c == '@' || c == '#') line += '\\';
      line += c;
    }
  }
  return line + (file.is_link ? "@" : "");
}

std::optional<ListedFile> file_in(std::string_view line) {
  ListedFile file;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool is_last = i + 1 == line.size();
    if (line[i] == '\\') {
      if (is_last) return std::nullopt;
      file.name += line[++i] == 'n' ? '\n' : line[i];
    } else if (line[i] == '@' && is_last) {
      file.is_link = true;
    } else {
      file.name += line[i];
    }
  }
  // `Folder` refuses names that lead elsewhere; the list itself is nobody's file
  if (file.name.empty() || file.name == kFileList) return std::nullopt;
  return file;
}

bool by_name(const ListedFile& a, const ListedFile& b) {
  return a.name < b.name;
}

/// "a/b" of "a/b/c"; empty for a name without a folder.
std::string folder_of(const std::string& name) {
  const std::size_t slash = name.rfind('/');
  return slash == std::string::npos ? std::string() : name.substr(0, slash);
}

/// Begun and not finished by a process that was killed, or a whole list.
bool begins_as_a_list(std::string_view text) {
  return text.starts_with(kHeader) || kHeader.starts_with(text);
}

}  // namespace

std::string file_list_text(const std::vector<ListedFile>& files) {
  std::string text(kHeader);
  for (const ListedFile& file : files) text += line_of(file) + "\n";
  return text;
}

std::optional<std::vector<ListedFile>> parse_file_list(std::string_view text) {
  if (!begins_as_a_list(text)) return std::nullopt;
  std::vector<ListedFile> files;
  text.remove_prefix(std::min(text.size(), kHeader.size()));
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) break;  // half a line of one that was killed
    if (auto file = file_in(text.substr(0, end))) files.push_back(std::move(*file));
    text.remove_prefix(end + 1);
  }
  std::stable_sort(files.begin(), files.end(), by_name);
  const auto same = [](const ListedFile& a, const ListedFile& b) { return a.name == b.name; };
  files.erase(std::unique(files.begin(), files.end(), same), files.end());
  return files;
}

std::optional<std::vector<ListedFile>> read_file_list(const Folder& folder) {
  const auto text = folder.read(kFileList, kLongest);
  return text ? parse_file_list(*text) : std::nullopt;
}

OwnedFolder::OwnedFolder(const Folder& parent, const std::string& name)
    : folder_([&] {
        const std::string path = fmt::format("{}/{}", parent.path(), name);
        if (parent.entry(name) != Entry::kNothing) {
          throw InputError(fmt::format("{}: is there already; move it away", path));
        }
        auto made = parent.make(name);
        if (!made) {
          throw InputError(
              fmt::format("{}: cannot make the folder: {}", path, write_error_text(errno)));
        }
        return std::move(*made);
      }()) {
  folder_.write(kFileList, kHeader);
  list_ = ::open((path() + "/" + kFileList).c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
  if (list_ < 0) {
    throw InputError(fmt::format("{}/{}: {}", path(), kFileList, write_error_text(errno)));
  }
  // not the folder: a program of the user's that runs in it may lock that, and would wait for ever
  static_cast<void>(::flock(list_, LOCK_EX | LOCK_NB));
}

OwnedFolder::~OwnedFolder() {
  ::close(list_);
}

bool is_being_filled(const Folder& parent, const std::string& name) {
  const std::string list = fmt::format("{}/{}/{}", parent.path(), name, kFileList);
  const int file = ::open(list.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return false;
  const bool is_locked = ::flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(file);
  return is_locked;
}

std::string OwnedFolder::file(const std::string& name) {
  return add({name, false});
}

std::string OwnedFolder::link(const std::string& name) {
  return add({name, true});
}

std::vector<ListedFile> OwnedFolder::files() const {
  std::vector<ListedFile> files;
  for (const auto& [name, is_link] : files_) files.push_back({name, is_link});
  return files;
}

std::string OwnedFolder::add(const ListedFile& file) {
  const std::string line = line_of(file) + "\n";
  const std::string path = fmt::format("{}/{}", folder_.path(), file.name);
  if (!files_.emplace(file.name, file.is_link).second) return path;
  if (::write(list_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw InputError(fmt::format("{}: cannot write: {}", path, write_error_text(errno)));
  }
  const std::string folder = folder_of(file.name);
  if (!folder.empty() && !folder_.make(folder)) {
    throw InputError(fmt::format("{}: cannot make the folder: {}", path, write_error_text(errno)));
  }
  return path;
}

void remove_listed(const Folder& folder,
                   const std::vector<ListedFile>& files,
                   const std::function<bool(const std::string&)>& keeps) {
  for (const ListedFile& file : files) {
    if (keeps && keeps(file.name)) continue;
    const Entry wanted = file.is_link ? Entry::kLink : Entry::kFile;
    if (folder.entry(file.name) == wanted) folder.remove_file(file.name);
    for (std::string up = folder_of(file.name); !up.empty(); up = folder_of(up)) {
      if (!folder.remove_empty_folder(up)) break;
    }
  }
}

bool remove_owned(const Folder& parent, const std::string& name) {
  const Entry entry = parent.entry(name);
  if (entry != Entry::kFolder) return entry == Entry::kNothing;
  if (const auto folder = parent.below(name)) {
    folder->remove_file(Folder::temporary_name(kFileList));
    if (auto files = read_file_list(*folder)) {
      const std::size_t count = files->size();
      for (std::size_t i = 0; i < count; ++i) {  // what a killed process was writing
        files->push_back({(*files)[i].name + ".partial", false});
      }
      remove_listed(*folder, *files);
      // as long as anything else is there, nobody may take it for a folder of ours
      folder->remove_file(kFileList);
    }
  }
  return parent.remove_empty_folder(name);
}

bool is_owned(const Folder& parent, const std::string& name) {
  const Entry entry = parent.entry(name);
  if (entry != Entry::kFolder) return entry == Entry::kNothing;
  const auto folder = parent.below(name);
  if (!folder) return false;
  if (read_file_list(*folder)) return true;
  // killed before it had a list
  std::vector<std::string> names = folder->names();
  std::erase(names, Folder::temporary_name(kFileList));
  return names.empty();
}

}  // namespace pointflight
