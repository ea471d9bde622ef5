// NumPy's files, as tests write them.
#pragma once

#include <gtest/gtest.h>
#include <zip.h>

#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace pointflight::testing {

/// Of numbers as they lie in memory.
template <class T>
std::string bytes_of(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A .npy: the dictionary of its header, and its numbers.
inline std::string npy(std::string header, const std::string& data) {
  header.resize((header.size() + 10 + 63) / 64 * 64 - 10, ' ');
  std::string bytes = "\x93NUMPY\x01";
  bytes += '\0';
  bytes += static_cast<char>(header.size() & 0xffu);
  bytes += static_cast<char>(header.size() >> 8);
  return bytes + header + data;
}

/// Arrays by their names, with .npy.
inline void write_npz(const std::string& path, const std::map<std::string, std::string>& arrays) {
  int error = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error);
  ASSERT_NE(archive, nullptr);
  for (const auto& [name, bytes] : arrays) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    ASSERT_GE(zip_file_add(archive, name.c_str(), source, 0), 0);
  }
  ASSERT_EQ(zip_close(archive), 0);
}

}  // namespace pointflight::testing
