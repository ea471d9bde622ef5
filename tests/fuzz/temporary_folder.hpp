#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace pointflight {

/// A folder that goes with the process; without what tests/support.hpp takes from GoogleTest.
class FuzzFolder {
 public:
  FuzzFolder() {
    std::string name =
        (std::filesystem::temp_directory_path() / "pointflight_fuzz_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) __builtin_trap();
    path_ = name;
  }
  ~FuzzFolder() { std::filesystem::remove_all(path_); }
  FuzzFolder(const FuzzFolder&) = delete;
  FuzzFolder& operator=(const FuzzFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace pointflight
