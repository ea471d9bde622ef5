#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"

struct zip;

namespace pointflight {

/// NumPy's .npz: a zip archive of .npy files, one for each array (numpy.lib.format).
class NpzArchive {
 public:
  /// The file must outlive it. Throws InputError.
  explicit NpzArchive(const MappedFile& file);

  /// Names of its arrays with their .npy, as they lie in it, 10,000 at most.
  [[nodiscard]] std::vector<std::string> arrays() const;

  /// An array unpacked into a file without a name. Throws InputError.
  [[nodiscard]] MappedFile unpack(const std::string& array) const;

 private:
  struct Close {
    void operator()(zip* archive) const;
  };
  std::string name_;
  std::unique_ptr<zip, Close> archive_;
};

}  // namespace pointflight
