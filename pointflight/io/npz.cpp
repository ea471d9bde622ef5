#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zip.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/spool.hpp"

// NumPy's .npz: a zip archive of .npy files, one for each array (numpy.lib.format).
namespace pointflight {
namespace {

/// Arrays of these names are tried before the others.
constexpr std::string_view kUsualNames[] = {"points", "xyz", "pointcloud", "cloud", "positions"};

struct ArchiveDeleter {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct EntryDeleter {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

class Archive {
 public:
  explicit Archive(const MappedFile& file) : name_(file.path()) {
    zip_error_t error;
    zip_error_init(&error);
    const auto bytes = file.bytes();
    zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
    if (source != nullptr) archive_.reset(zip_open_from_source(source, ZIP_RDONLY, &error));
    const std::string words = zip_error_strerror(&error);
    zip_error_fini(&error);
    if (archive_) return;
    if (source != nullptr) zip_source_free(source);
    throw InputError(fmt::format("{}: is no zip archive of arrays (.npz): {}", name_, words));
  }

  /// Names of its arrays, the usual ones first.
  [[nodiscard]] std::vector<std::string> arrays() const {
    constexpr zip_int64_t kMost = 10'000;
    std::vector<std::string> names;
    for (zip_int64_t i = 0; i < std::min(kMost, zip_get_num_entries(archive_.get(), 0)); ++i) {
      const char* name = zip_get_name(archive_.get(), static_cast<zip_uint64_t>(i), 0);
      if (name != nullptr && std::string_view(name).ends_with(".npy")) names.emplace_back(name);
    }
    const auto place = [](const std::string& name) {
      const std::string stem = lower_case(name.substr(0, name.size() - 4));
      return std::find(std::begin(kUsualNames), std::end(kUsualNames), stem);
    };
    std::stable_sort(names.begin(), names.end(), [&](const auto& a, const auto& b) {
      return place(a) < place(b);
    });
    return names;
  }

  /// An array unpacked into a file without a name.
  [[nodiscard]] MappedFile unpack(const std::string& array) const {
    const std::string name = fmt::format("{}: {}", name_, excerpt(array));
    const std::unique_ptr<zip_file_t, EntryDeleter> entry(
        zip_fopen(archive_.get(), array.c_str(), 0));
    if (!entry) throw InputError(fmt::format("{}: {}", name, zip_strerror(archive_.get())));
    const auto read = [&](std::span<std::byte> block) -> std::optional<std::size_t> {
      const zip_int64_t size = zip_fread(entry.get(), block.data(), block.size());
      if (size >= 0) return static_cast<std::size_t>(size);
      throw InputError(fmt::format(
          "{}: does not unpack: {}", name, zip_error_strerror(zip_file_get_error(entry.get()))));
    };
    return {*spool(read, name, {}, {}), name};
  }

 private:
  std::string name_;
  std::unique_ptr<zip_t, ArchiveDeleter> archive_;
};

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
  const Archive archive(file);
  std::vector<std::string> names = archive.arrays();
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
