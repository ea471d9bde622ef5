#include "pointflight/io/cloud_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/formats.hpp"

namespace pointflight {
namespace {

struct Format {
  std::string_view extension;
  std::unique_ptr<CloudReader> (*open)(MappedFile file);  ///< Null for meshes.
};

// every format that `map import` reads
constexpr Format kFormats[] = {
    {".pcd", open_pcd},
    {".ply", open_ply},
    {".xyz", open_xyz},
    {".txt", open_xyz},
    {".csv", open_xyz},
    {".asc", open_xyz},
    {".pts", open_xyz},
    {".las", open_las},
    {".obj", nullptr},
    {".stl", nullptr},
    {".dae", nullptr},
    {".gltf", nullptr},
    {".glb", nullptr},
};

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

const Format* find_format(const std::string& extension) {
  const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& f) {
    return f.extension == extension;
  });
  return found == std::end(kFormats) ? nullptr : found;
}

}  // namespace

std::string known_cloud_formats() {
  std::vector<std::string_view> names;
  for (const Format& format : kFormats) names.push_back(format.extension);
  return fmt::format("{}", fmt::join(names, " "));
}

bool is_mesh(const std::string& path) {
  const std::string extension = extension_of(path);
  const Format* format = find_format(extension);
  if (format == nullptr) return false;
  if (extension == ".ply") return ply_has_faces(MappedFile(path));
  return format->open == nullptr;
}

std::unique_ptr<CloudReader> open_cloud(const std::string& path, const MeshSampling& sampling) {
  const std::string extension = extension_of(path);
  if (extension == ".laz") {
    const MappedFile present(path);  // a missing file is the first thing to say
    throw InputError(
        fmt::format("{0}: LAZ is compressed; unpack it first: laszip -i {0} -o cloud.las", path));
  }
  const Format* format = find_format(extension);
  MappedFile file(path);
  if (format == nullptr) {
    throw InputError(fmt::format("{}: extension '{}' is unknown; these are read: {}",
                                 path,
                                 extension,
                                 known_cloud_formats()));
  }
  if (file.bytes().empty()) throw InputError(fmt::format("{}: the file is empty", path));
  if (format->open == nullptr || (extension == ".ply" && ply_has_faces(file))) {
    return open_mesh(path, sampling);
  }
  return format->open(std::move(file));
}

}  // namespace pointflight
