#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/npz_archive.hpp"

namespace pointflight {
namespace {

/// Arrays of these names are tried before the others.
constexpr std::string_view kUsualNames[] = {"points", "xyz", "pointcloud", "cloud", "positions"};

/// The usual ones first.
void put_usual_first(std::vector<std::string>& names) {
  const auto place = [](const std::string& name) {
    const std::string stem = lower_case(name.substr(0, name.size() - 4));
    return std::find(std::begin(kUsualNames), std::end(kUsualNames), stem);
  };
  std::stable_sort(names.begin(), names.end(), [&](const auto& a, const auto& b) {
    return place(a) < place(b);
  });
}

/// The cloud in one of the arrays, which says what the others are.
class NpzReader : public CloudReader {
 public:
  NpzReader(std::unique_ptr<CloudReader> array, std::string note)
      : array_(std::move(array)), note_(std::move(note)) {}

  bool read(std::vector<CloudPoint>& batch) override { return array_->read(batch); }
  [[nodiscard]] bool has_intensity() const override { return array_->has_intensity(); }
  [[nodiscard]] FileColumns columns() const override {
    FileColumns columns = array_->columns();
    if (!note_.empty()) columns.notes.push_back(note_);
    return columns;
  }
  [[nodiscard]] double share_read() const override { return array_->share_read(); }

 private:
  std::unique_ptr<CloudReader> array_;
  std::string note_;
};

}  // namespace

std::unique_ptr<CloudReader> open_npz(MappedFile file) {
  const NpzArchive archive(file);
  std::vector<std::string> names = archive.arrays();
  put_usual_first(names);
  std::string first_fault;
  for (const std::string& name : names) {
    try {
      auto array = open_npy(archive.unpack(name));
      const std::string taken = name;
      std::erase(names, taken);
      const std::string note =
          names.empty() ? std::string()
                        : fmt::format("its array {} is taken; left out: {}",
                                      excerpt(taken),
                                      excerpt(fmt::format("{}", fmt::join(names, ", ")), 100));
      return std::make_unique<NpzReader>(std::move(array), note);
    } catch (const InputError& error) {
      if (first_fault.empty()) first_fault = error.what();
    }
  }
  throw InputError(first_fault.empty() ? fmt::format("{}: has no array (.npy) in it", file.path())
                                       : first_fault);
}

}  // namespace pointflight
