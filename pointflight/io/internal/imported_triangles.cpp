#include <fmt/format.h>
#include <sys/stat.h>

#include <array>
#include <cstring>
#include <new>
#include <string_view>
#include <utility>

#include "pointflight/core/child_process.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/internal/mesh_triangles.hpp"

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

/// The importer's own words are for its authors.
std::string cannot_read(const std::string& path, const std::string& why) {
  return fmt::format(
      "{}: cannot read this mesh: {}; open it in a mesh editor and export it again, as PLY or OBJ",
      path,
      why);
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
  if (scene == nullptr) {
    const std::string_view said = importer.GetErrorString();
    if (said.find("bad_alloc") != said.npos || said.find("memory") != said.npos) {
      throw std::bad_alloc();
    }
    throw InputError(cannot_read(path, "it is damaged, or of a kind that is not known"));
  }
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
  if (result.failure == kTooMuchMemory) {
    throw InputError(fmt::format(
        "{}: this mesh takes more memory than there is for it; raise the limit (ulimit -d, -v, a "
        "container's) or split it; a small one is damaged",
        path));
  }
  if (!result.failure.empty()) {
    throw InputError(cannot_read(path, fmt::format("its reader failed ({})", result.failure)));
  }
  if (result.bytes.empty()) {
    throw InputError(fmt::format("{}: the mesh has no faces; is it a cloud?", path));
  }
  return std::move(result.bytes);
}

class ImportedTriangles : public MeshTriangles {
 public:
  ImportedTriangles(const std::string& path, const MeshLimits& limits, const Progress& progress)
      : bytes_(read_triangles(path, limits, progress)), count_(bytes_.size() / sizeof(Corners)) {}

  bool next(Triangle& triangle) override {
    if (next_ == count_) return false;
    const auto c = load<Corners>(bytes_.data() + next_++ * sizeof(Corners));
    const auto corner = [&](std::size_t i) -> Vector3d {
      return Vector3f(c.data() + 3 * i).cast<double>();
    };
    triangle = {corner(0), corner(1), corner(2)};
    return true;
  }
  void restart() override { next_ = 0; }
  [[nodiscard]] double share_read() const override {
    return count_ == 0 ? 1.0 : static_cast<double>(next_) / static_cast<double>(count_);
  }
  [[nodiscard]] bool is_single_precision() const override { return true; }

 private:
  std::vector<std::byte> bytes_;
  std::size_t count_;
  std::size_t next_ = 0;
};

}  // namespace

std::unique_ptr<MeshTriangles> imported_triangles(const std::string& path,
                                                  const MeshLimits& limits,
                                                  const Progress& progress) {
  return std::make_unique<ImportedTriangles>(path, limits, progress);
}

#else

std::unique_ptr<MeshTriangles> imported_triangles(const std::string& path,
                                                  const MeshLimits& /*limits*/,
                                                  const Progress& /*progress*/) {
  throw InputError(fmt::format(
      "{}: meshes but PLY and OBJ need assimp, which this program was built without; install "
      "libassimp-dev and build again",
      path));
}

#endif

}  // namespace pointflight
