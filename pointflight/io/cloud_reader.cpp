#include "pointflight/io/cloud_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/spool.hpp"

namespace pointflight {
namespace {

struct Format {
  std::string_view extension;
  std::unique_ptr<CloudReader> (*open)(MappedFile file);  ///< Of points; null: always a mesh.
  bool (*is_mesh)(const MappedFile& file) = nullptr;      ///< Null: if it is not read as points.

  [[nodiscard]] bool has_faces(const MappedFile& file) const {
    return is_mesh != nullptr ? is_mesh(file) : open == nullptr;
  }
};

// every format that `map import` reads
constexpr Format kFormats[] = {
    {".pcd", open_pcd},       {".ply", open_ply, ply_has_faces},
    {".xyz", open_xyz},       {".txt", open_xyz},
    {".csv", open_xyz},       {".asc", open_xyz},
    {".pts", open_pts},       {".ptx", open_ptx},
    {".las", open_las},       {".e57", open_e57},
    {".bin", open_kitti_bin}, {".npy", open_npy},
    {".npz", open_npz},       {".obj", open_obj_points, obj_has_faces},
    {".stl", nullptr},        {".off", nullptr},
    {".dae", nullptr},        {".gltf", nullptr},
    {".glb", nullptr},
};

/// What is well known and not read, and how it becomes something that is.
struct Refusal {
  std::string_view extension;
  std::string_view begin;  ///< The first bytes of such a file.
  std::string_view words;  ///< {0}: the path.
};
constexpr Refusal kRefusals[] = {
    {".laz",
     "",
     "LAZ is compressed; unpack it first: laszip -i {0} -o cloud.las (LAStools), or "
     "pdal translate {0} cloud.las"},
};

[[noreturn]] void refuse(const Refusal& refusal, const std::string& name) {
  throw InputError(name + ": " + fmt::format(fmt::runtime(refusal.words), name));
}

/// ".las" of "las", ".las" or ".LAS".
std::string as_extension(const std::string& format) {
  if (format.empty()) return {};
  return lower_case(format.front() == '.' ? format : "." + format);
}

std::string extension_of(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

const Format* find_format(const std::string& extension) {
  const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& f) {
    return f.extension == extension;
  });
  return found == std::end(kFormats) ? nullptr : found;
}

const Refusal* find_refusal(const std::string& extension) {
  const auto* found = std::find_if(std::begin(kRefusals),
                                   std::end(kRefusals),
                                   [&](const Refusal& r) { return r.extension == extension; });
  return found == std::end(kRefusals) ? nullptr : found;
}

/// The format of bytes that came without a name; throws InputError if they are none that is
/// read.
std::string format_by_content(const MappedFile& file) {
  const std::string_view text = as_text(file.bytes());
  const auto begins_with = [&](std::string_view word) {
    return text.substr(0, word.size()) == word;
  };
  for (const Refusal& refusal : kRefusals) {
    if (!refusal.begin.empty() && begins_with(refusal.begin)) refuse(refusal, file.path());
  }
  if (begins_with("LASF")) return ".las";
  if (begins_with("ASTM-E57")) return ".e57";
  if (begins_with("\x93NUMPY")) return ".npy";
  if (begins_with("PK\x03\x04")) return ".npz";
  if (begins_with("ply\n") || begins_with("ply\r")) return ".ply";
  for (const char* word : {"# .PCD", "VERSION", "FIELDS", "COLUMNS"}) {
    if (begins_with(word)) return ".pcd";
  }
  constexpr std::size_t kHead = 4096;
  const std::string_view head = text.substr(0, kHead);
  const bool is_text = std::all_of(head.begin(), head.end(), [](char c) {
    return (c >= ' ' && c <= '~') || c == '\n' || c == '\r' || c == '\t' || (c & 0x80) != 0;
  });
  // byte order marks and comments may hold more than ASCII
  if (is_text && head.find_first_of("0123456789") != std::string_view::npos) return ".xyz";
  throw InputError(fmt::format(
      "{}: the first bytes tell no format; give it: --format pcd, ply, las, bin (KITTI) or xyz",
      file.path()));
}

}  // namespace

std::string known_cloud_formats() {
  std::vector<std::string_view> names;
  for (const Format& format : kFormats) names.push_back(format.extension);
  return fmt::format("{}", fmt::join(names, " "));
}

CloudSource::CloudSource(std::string path, const std::string& format)
    : name_(std::move(path)),
      format_(format.empty() ? extension_of(name_) : as_extension(format)) {}

CloudSource CloudSource::from_stream(int descriptor,
                                     const std::string& format,
                                     const std::string& folder,
                                     const Progress& progress) {
  CloudSource source("standard input", format.empty() ? "none" : format);
  // what cannot be read from a pipe is said before it is waited for
  if (const Refusal* refusal = find_refusal(source.format_)) refuse(*refusal, "-");
  const Format* known = find_format(source.format_);
  if (!format.empty() && (known == nullptr || known->open == nullptr || source.format_ == ".obj")) {
    throw InputError(
        fmt::format("--format {}: standard input is read as one of pcd ply xyz txt csv asc pts ptx "
                    "las e57 bin npy",
                    excerpt(format)));
  }
  source.spool_ = spool(descriptor, source.name_, folder, progress);
  const MappedFile file = source.map_file();
  if (file.bytes().empty()) throw InputError("standard input: nothing came");
  if (format.empty()) source.format_ = format_by_content(file);
  if (source.is_mesh()) {
    throw InputError("standard input: this is a mesh; meshes are read from files only");
  }
  return source;
}

MappedFile CloudSource::map_file() const {
  std::error_code ignored;
  if (!spool_ && std::filesystem::is_fifo(name_, ignored)) {
    throw InputError(fmt::format(
        "{}: a pipe, not a regular file; let it feed standard input and give - instead", name_));
  }
  return spool_ ? MappedFile(*spool_, name_) : MappedFile(name_);
}

bool CloudSource::is_mesh() const {
  const Format* format = find_format(format_);
  if (format == nullptr) return false;
  return format->is_mesh != nullptr ? format->is_mesh(map_file()) : format->open == nullptr;
}

std::unique_ptr<CloudReader> CloudSource::open(const MeshSampling& sampling,
                                               const Progress& progress) const {
  require_argument(sampling.points_per_square_metre > 0.0 && sampling.unit > 0.0 &&
                       std::isfinite(sampling.points_per_square_metre) &&
                       std::isfinite(sampling.unit),
                   "open: a density and a unit above 0 are wanted");
  MappedFile file = map_file();  // a missing file is the first thing to say
  if (const Refusal* refusal = find_refusal(format_)) refuse(*refusal, name_);
  const Format* format = find_format(format_);
  if (format == nullptr) {
    throw InputError(fmt::format("{}: the format '{}' is unknown; these are read: {}",
                                 name_,
                                 excerpt(format_),
                                 known_cloud_formats()));
  }
  if (file.bytes().empty()) throw InputError(fmt::format("{}: the file is empty", name_));
  if (format->has_faces(file)) {
    return open_mesh(name_, format_, sampling, mesh_limits(file.bytes().size()), progress);
  }
  return format->open(std::move(file));
}

std::unique_ptr<CloudReader> open_cloud(const std::string& path, const MeshSampling& sampling) {
  return CloudSource(path).open(sampling);
}

bool has_cloud_extension(const std::string& path) {
  const Format* format = find_format(extension_of(path));
  return format != nullptr && format->open != nullptr && format->extension != ".obj";
}

bool is_mesh(const std::string& path) {
  return CloudSource(path).is_mesh();
}

}  // namespace pointflight
