#include "pointflight/io/npz_arrays.hpp"

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/internal/npy_header.hpp"
#include "pointflight/io/internal/npz_archive.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMost = 1'000'000;  // numbers of one array

NumberArray array_in(const MappedFile& file) {
  const NpyHeader header(file, "save arrays of floats or whole numbers, as numpy.savez does");
  std::string_view type = header.type();
  const auto name = type.starts_with("[") ? std::nullopt : NpyHeader::next_quoted(type);
  if (!name) header.fail("it has no plain numbers");
  const NpyNumber number = header.number_of(*name);
  std::size_t count = 1;
  for (const std::size_t length : header.shape()) count *= length;
  if (header.fortran() && header.shape().size() > 1) header.fail("it lies in Fortran's order");
  if (count > kMost || count > (file.bytes().size() - header.data()) / number.size) {
    header.fail("it has fewer numbers than its header promises, or over a million");
  }
  NumberArray array{header.shape(), {}};
  array.values.reserve(count);
  const std::byte* p = file.bytes().data() + header.data();
  for (std::size_t i = 0; i < count; ++i, p += number.size) {
    array.values.push_back(static_cast<float>(npy_number(p, number)));
  }
  return array;
}

}  // namespace

std::map<std::string, NumberArray> read_npz_arrays(const std::string& path) {
  const MappedFile file(path);
  const NpzArchive archive(file);
  std::map<std::string, NumberArray> arrays;
  for (const std::string& name : archive.arrays()) {
    arrays.emplace(name.substr(0, name.size() - 4), array_in(archive.unpack(name)));
  }
  return arrays;
}

}  // namespace pointflight
