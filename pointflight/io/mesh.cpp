#include <fmt/format.h>

#include <array>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/formats.hpp"

#ifdef POINTFLIGHT_HAS_ASSIMP
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#endif

namespace pointflight {

#ifdef POINTFLIGHT_HAS_ASSIMP

namespace {

/// Points drawn evenly by area from triangles, in a fixed order.
class MeshReader : public CloudReader {
 public:
  MeshReader(const std::string& path, const MeshSampling& sampling) : sampling_(sampling) {
    // the file's own axes, whatever its header says of them: --up is the user's word
    importer_.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
    scene_ = importer_.ReadFile(
        path, aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_SortByPType);
    if (scene_ == nullptr) {
      throw InputError(
          fmt::format("{}: cannot read as a mesh: {}", path, importer_.GetErrorString()));
    }
    for (unsigned m = 0; m < scene_->mNumMeshes; ++m) faces_ += scene_->mMeshes[m]->mNumFaces;
    if (faces_ == 0) throw InputError(fmt::format("{}: the mesh has no faces", path));
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.size() < kBatch && mesh_ < scene_->mNumMeshes) {
      const aiMesh& mesh = *scene_->mMeshes[mesh_];
      if (face_ >= mesh.mNumFaces) {
        ++mesh_;
        face_ = 0;
        continue;
      }
      if (pending_ == 0) next_face(mesh);
      const RandomStream random(0, StreamId::kCloudSampling, static_cast<std::uint32_t>(done_));
      while (pending_ > 0 && batch.size() < kBatch) {
        const auto [u, v] = random.uniform2(--pending_);
        batch.push_back({point_on(triangle_, u, v) / sampling_.unit, 0.0f});
      }
      if (pending_ == 0) {
        ++face_;
        ++done_;
      }
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(done_) / static_cast<double>(faces_);
  }

 private:
  void next_face(const aiMesh& mesh) {
    const aiFace& face = mesh.mFaces[face_];
    if (face.mNumIndices != 3) return;  // points and lines have no area
    std::array<Vector3d, 3> corner;
    for (unsigned i = 0; i < 3; ++i) {
      const aiVector3D& p = mesh.mVertices[face.mIndices[i]];
      corner[i] = sampling_.unit * Vector3d(p.x, p.y, p.z);
    }
    triangle_ = {corner[0], corner[1], corner[2]};
    const double wanted = area(triangle_) * sampling_.points_per_square_metre;
    if (!std::isfinite(wanted)) return;
    owed_ += wanted;
    pending_ = static_cast<std::uint64_t>(owed_);
    owed_ -= static_cast<double>(pending_);
  }

  MeshSampling sampling_;
  Assimp::Importer importer_;
  const aiScene* scene_ = nullptr;
  Triangle triangle_{};
  std::uint64_t faces_ = 0;
  std::uint64_t done_ = 0;
  unsigned mesh_ = 0;
  unsigned face_ = 0;
  std::uint64_t pending_ = 0;
  double owed_ = 0.0;
};

}  // namespace

std::unique_ptr<CloudReader> open_mesh(const std::string& path, const MeshSampling& sampling) {
  return std::make_unique<MeshReader>(path, sampling);
}

#else

std::unique_ptr<CloudReader> open_mesh(const std::string& path, const MeshSampling& /*sampling*/) {
  throw InputError(fmt::format(
      "{}: meshes need assimp, which this program was built without; install libassimp-dev and "
      "build again",
      path));
}

#endif

}  // namespace pointflight
