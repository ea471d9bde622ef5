#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "pointflight/core/child_process.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"

#ifdef POINTFLIGHT_HAS_ASSIMP
#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#endif

namespace pointflight {

#ifdef POINTFLIGHT_HAS_ASSIMP

namespace {

using Corners = std::array<float, 9>;  ///< Of a triangle, in the mesh's unit.

/// A mesh may name others (materials, buffers): only what is a file, never a pipe or a device.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* path) const override {  // the default opens it
    struct stat status {};
    return ::stat(path, &status) == 0 && S_ISREG(status.st_mode);
  }
  Assimp::IOStream* Open(const char* path, const char* mode) override {
    return Exists(path) ? DefaultIOSystem::Open(path, mode) : nullptr;
  }
};

std::string cannot_read(const std::string& path, const std::string& why) {
  constexpr std::size_t kLongest = 160;
  return fmt::format("{}: cannot read as a mesh: {}; open it in a mesh editor and export it again",
                     path,
                     excerpt(why, kLongest));
}

Corners corners_of(const aiMesh& mesh, const aiFace& face, const std::string& path) {
  Corners corners{};
  for (unsigned i = 0; i < 3; ++i) {
    if (face.mIndices[i] >= mesh.mNumVertices) {
      throw InputError(cannot_read(
          path,
          fmt::format(
              "a face names vertex {}, the mesh has {}", face.mIndices[i], mesh.mNumVertices)));
    }
    const aiVector3D& p = mesh.mVertices[face.mIndices[i]];
    corners[3 * i] = p.x;
    corners[3 * i + 1] = p.y;
    corners[3 * i + 2] = p.z;
  }
  return corners;
}

/// Reads a mesh by assimp and writes its triangles; to be run in a child process, for damaged files
/// make assimp crash.
void import_triangles(const std::string& path, ChildOutput& output) {
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // the importer's from now on
  // the file's own axes, whatever its header says of them: --up is the user's word
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene =
      importer.ReadFile(path,
                        aiProcess_ValidateDataStructure | aiProcess_Triangulate |
                            aiProcess_PreTransformVertices | aiProcess_SortByPType);
  if (scene == nullptr) throw InputError(cannot_read(path, importer.GetErrorString()));
  constexpr std::size_t kBatch = 4096;
  std::vector<Corners> batch;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      // points and lines have no area
      if (mesh.mFaces[f].mNumIndices != 3) continue;
      batch.push_back(corners_of(mesh, mesh.mFaces[f], path));
      if (batch.size() < kBatch) continue;
      output.write(std::as_bytes(std::span(batch)));
      batch.clear();
    }
  }
  output.write(std::as_bytes(std::span(batch)));
}

/// The bytes of the triangles of a mesh, each of type Corners.
std::vector<std::byte> read_triangles(const std::string& path,
                                      const MeshLimits& limits,
                                      const Progress& progress) {
  ChildResult result = run_in_child([&](ChildOutput& output) { import_triangles(path, output); },
                                    {limits.cpu_seconds, limits.memory_bytes},
                                    [&] { report(progress, "reading the mesh", 0.0); });
  if (result.failure.rfind(path, 0) == 0) throw InputError(result.failure);
  if (!result.failure.empty()) {
    throw InputError(cannot_read(path, fmt::format("the importer failed: {}", result.failure)));
  }
  if (result.bytes.empty()) {
    throw InputError(fmt::format("{}: the mesh has no faces; is it a cloud?", path));
  }
  return std::move(result.bytes);
}

/// The unit in the first comments of an OBJ; what other formats say, assimp has heeded.
std::optional<FileUnit> unit_of_mesh(const std::string& path) {
  constexpr std::size_t kMostLines = 100;
  if (!path.ends_with(".obj")) return std::nullopt;
  const MappedFile file(path);
  LineCursor lines(as_text(file.bytes()));
  std::string_view line;
  while (lines.number() < kMostLines && lines.next(line)) {
    if (line.empty() || line.front() != '#') continue;
    if (auto unit = unit_in_comment(line)) return unit;
  }
  return std::nullopt;
}

/// Points drawn evenly by area from triangles, in a fixed order.
class MeshReader : public CloudReader {
 public:
  MeshReader(const std::string& path,
             const MeshSampling& sampling,
             const MeshLimits& limits,
             const Progress& progress)
      : sampling_(sampling),
        bytes_(read_triangles(path, limits, progress)),
        faces_(bytes_.size() / sizeof(Corners)),
        unit_(unit_of_mesh(path)) {
    check_size(path);
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.size() < kBatch && face_ < faces_) {
      if (pending_ == 0) next_face();
      const RandomStream random(0, StreamId::kCloudSampling, static_cast<std::uint32_t>(face_));
      while (pending_ > 0 && batch.size() < kBatch) {
        const auto [u, v] = random.uniform2(--pending_);
        batch.push_back({point_on(triangle_, u, v) / sampling_.unit, 0.0f});
      }
      if (pending_ == 0) ++face_;
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return unit_; }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(face_) / static_cast<double>(faces_);
  }

 private:
  /// What a wrong unit or single precision would spoil is said before hours of sampling.
  void check_size(const std::string& path) const {
    constexpr double kMostPoints = 2e9;
    constexpr double kCoarsestStep = 0.01;  // m
    double points = 0.0;
    double farthest = 0.0;
    for (std::size_t face = 0; face < faces_; ++face) {
      const double wanted = area(triangle(face)) * sampling_.points_per_square_metre;
      points += std::isfinite(wanted) ? wanted : 0.0;
      for (const float c : corners(face)) {
        if (std::isfinite(c)) farthest = std::max(farthest, std::abs(static_cast<double>(c)));
      }
    }
    if (points > kMostPoints) {
      throw InputError(fmt::format(
          "{}: {:.2g} m^2 of surface would take {:.2g} points; check --scale (0.001 for "
          "millimetres) or give a coarser --resolution",
          path,
          points / sampling_.points_per_square_metre,
          points));
    }
    const double step = farthest * sampling_.unit * std::numeric_limits<float>::epsilon();
    if (step > kCoarsestStep) {
      throw InputError(
          fmt::format("{}: coordinates up to {:.3g} are read in steps of {:.2g} m (single "
                      "precision); move the mesh near its origin first",
                      path,
                      farthest,
                      step));
    }
  }

  [[nodiscard]] Corners corners(std::size_t face) const {
    return load<Corners>(bytes_.data() + face * sizeof(Corners));
  }

  /// In metres.
  [[nodiscard]] Triangle triangle(std::size_t face) const {
    const Corners c = corners(face);
    const auto corner = [&](std::size_t i) -> Vector3d {
      return sampling_.unit * Vector3f(c.data() + 3 * i).cast<double>();
    };
    return {corner(0), corner(1), corner(2)};
  }

  void next_face() {
    triangle_ = triangle(face_);
    const double wanted = area(triangle_) * sampling_.points_per_square_metre;
    if (!std::isfinite(wanted)) return;
    owed_ += wanted;
    pending_ = static_cast<std::uint64_t>(owed_);
    owed_ -= static_cast<double>(pending_);
  }

  MeshSampling sampling_;
  std::vector<std::byte> bytes_;
  std::size_t faces_;
  std::optional<FileUnit> unit_;
  std::size_t face_ = 0;
  Triangle triangle_{};
  std::uint64_t pending_ = 0;
  double owed_ = 0.0;
};

}  // namespace

std::unique_ptr<CloudReader> open_mesh(const std::string& path,
                                       const MeshSampling& sampling,
                                       const MeshLimits& limits,
                                       const Progress& progress) {
  return std::make_unique<MeshReader>(path, sampling, limits, progress);
}

#else

std::unique_ptr<CloudReader> open_mesh(const std::string& path,
                                       const MeshSampling& /*sampling*/,
                                       const MeshLimits& /*limits*/,
                                       const Progress& /*progress*/) {
  throw InputError(fmt::format(
      "{}: meshes need assimp, which this program was built without; install libassimp-dev and "
      "build again",
      path));
}

#endif

MeshLimits mesh_limits(std::size_t file_bytes) {
  const double megabytes = 1e-6 * static_cast<double>(file_bytes);
  return {20.0 + 4.0 * megabytes, (std::size_t{2} << 30) + 100 * file_bytes};
}

}  // namespace pointflight
