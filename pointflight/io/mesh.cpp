#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

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
  MeshReader(const std::string& path, const MeshSampling& sampling)
      : path_(path), sampling_(sampling) {
    // the file's own axes, whatever its header says of them: --up is the user's word
    importer_.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
    scene_ = importer_.ReadFile(path,
                                aiProcess_ValidateDataStructure | aiProcess_Triangulate |
                                    aiProcess_PreTransformVertices | aiProcess_SortByPType);
    if (scene_ == nullptr) {
      throw InputError(
          fmt::format("{}: cannot read as a mesh: {}; open it in a mesh editor and export it again",
                      path,
                      importer_.GetErrorString()));
    }
    for (unsigned m = 0; m < scene_->mNumMeshes; ++m) faces_ += scene_->mMeshes[m]->mNumFaces;
    if (faces_ == 0) {
      throw InputError(fmt::format("{}: the mesh has no faces; is it a cloud?", path));
    }
    check_size(path);
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
  /// What a wrong unit or single precision would spoil is said before hours of sampling.
  void check_size(const std::string& path) const {
    constexpr double kMostPoints = 2e9;
    constexpr double kCoarsestStep = 0.01;  // m
    double points = 0.0;
    double farthest = 0.0;
    for (unsigned m = 0; m < scene_->mNumMeshes; ++m) {
      const aiMesh& mesh = *scene_->mMeshes[m];
      for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const auto triangle = triangle_of(path, mesh, mesh.mFaces[f]);
        if (!triangle) continue;
        const double wanted = area(*triangle) * sampling_.points_per_square_metre;
        points += std::isfinite(wanted) ? wanted : 0.0;
      }
      for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        const aiVector3D& p = mesh.mVertices[v];
        for (const float c : {p.x, p.y, p.z}) {
          if (std::isfinite(c)) farthest = std::max(farthest, std::abs(static_cast<double>(c)));
        }
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

  /// Nothing for points and lines, which have no area.
  [[nodiscard]] std::optional<Triangle> triangle_of(const std::string& path,
                                                    const aiMesh& mesh,
                                                    const aiFace& face) const {
    if (face.mNumIndices != 3) return std::nullopt;
    std::array<Vector3d, 3> corner;
    for (unsigned i = 0; i < 3; ++i) {
      if (face.mIndices[i] >= mesh.mNumVertices) {
        throw InputError(fmt::format("{}: a face names vertex {}, the mesh has {}; export it again",
                                     path,
                                     face.mIndices[i],
                                     mesh.mNumVertices));
      }
      const aiVector3D& p = mesh.mVertices[face.mIndices[i]];
      corner[i] = sampling_.unit * Vector3d(p.x, p.y, p.z);
    }
    return Triangle{corner[0], corner[1], corner[2]};
  }

  void next_face(const aiMesh& mesh) {
    const auto triangle = triangle_of(path_, mesh, mesh.mFaces[face_]);
    if (!triangle) return;
    triangle_ = *triangle;
    const double wanted = area(triangle_) * sampling_.points_per_square_metre;
    if (!std::isfinite(wanted)) return;
    owed_ += wanted;
    pending_ = static_cast<std::uint64_t>(owed_);
    owed_ -= static_cast<double>(pending_);
  }

  std::string path_;
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
