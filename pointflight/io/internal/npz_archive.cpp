#include "pointflight/io/internal/npz_archive.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/spool.hpp"

namespace pointflight {
namespace {

struct EntryDeleter {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

}  // namespace

void NpzArchive::Close::operator()(zip* archive) const {
  zip_discard(archive);
}

NpzArchive::NpzArchive(const MappedFile& file) : name_(file.path()) {
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

std::vector<std::string> NpzArchive::arrays() const {
  constexpr zip_int64_t kMost = 10'000;
  std::vector<std::string> names;
  for (zip_int64_t i = 0; i < std::min(kMost, zip_get_num_entries(archive_.get(), 0)); ++i) {
    const char* name = zip_get_name(archive_.get(), static_cast<zip_uint64_t>(i), 0);
    if (name != nullptr && std::string_view(name).ends_with(".npy")) names.emplace_back(name);
  }
  return names;
}

MappedFile NpzArchive::unpack(const std::string& array) const {
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

}  // namespace pointflight
