#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/mesh_triangles.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kReportFaces = 65536;  // faces

/// Points drawn evenly by area from triangles, in a fixed order.
class MeshReader : public CloudReader {
 public:
  MeshReader(const std::string& path,
             const MeshSampling& sampling,
             std::unique_ptr<MeshTriangles> triangles,
             std::optional<char> up,
             const Progress& progress)
      : sampling_(sampling), triangles_(std::move(triangles)), up_(up) {
    check_size(path, progress);
    triangles_->restart();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.size() < kBatch) {
      if (pending_ == 0 && !next_face()) break;
      const RandomStream random(0, StreamId::kCloudSampling, static_cast<std::uint32_t>(face_));
      while (pending_ > 0 && batch.size() < kBatch) {
        const auto [u, v] = random.uniform2(--pending_);
        batch.push_back({point_on(triangle_, u, v) / sampling_.unit, 0.0f});
      }
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return false; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return triangles_->unit(); }
  [[nodiscard]] std::optional<char> up_axis() const override { return up_; }
  [[nodiscard]] double share_read() const override { return triangles_->share_read(); }

 private:
  /// In metres; false after the last one.
  bool next_triangle(Triangle& triangle) {
    if (!triangles_->next(triangle)) return false;
    for (Vector3d* corner : {&triangle.a, &triangle.b, &triangle.c}) *corner *= sampling_.unit;
    return true;
  }

  /// What a wrong unit or single precision would spoil is said before hours of sampling.
  void check_size(const std::string& path, const Progress& progress) {
    constexpr double kMostPoints = 2e9;
    constexpr double kCoarsestStep = 0.01;  // m
    double points = 0.0;
    double farthest = 0.0;  // m
    std::uint64_t faces = 0;
    for (Triangle t{}; next_triangle(t); ++faces) {
      if (faces % kReportFaces == 0) report(progress, "measuring the mesh", share_read());
      const double wanted = area(t) * sampling_.points_per_square_metre;
      points += std::isfinite(wanted) ? wanted : 0.0;
      for (const Vector3d& corner : {t.a, t.b, t.c}) {
        if (corner.allFinite()) farthest = std::max(farthest, corner.cwiseAbs().maxCoeff());
      }
    }
    if (faces == 0) {
      throw InputError(fmt::format("{}: the mesh has no faces; is it a cloud?", path));
    }
    if (points > kMostPoints) {
      throw InputError(fmt::format(
          "{}: {:.2g} m^2 of surface would take {:.2g} points; check --scale (0.001 for "
          "millimetres) or give a coarser --resolution",
          path,
          points / sampling_.points_per_square_metre,
          points));
    }
    const double step = farthest * std::numeric_limits<float>::epsilon();
    if (triangles_->is_single_precision() && step > kCoarsestStep) {
      throw InputError(fmt::format(
          "{}: coordinates up to {:.3g} are kept in steps of {:.2g} m (single precision); move the "
          "mesh near its origin before it is saved, or save it as OBJ, or as PLY with doubles",
          path,
          farthest / sampling_.unit,
          step));
    }
  }

  /// The next triangle that points are due of; false after the last one.
  bool next_face() {
    while (next_triangle(triangle_)) {
      ++face_;
      const double wanted = area(triangle_) * sampling_.points_per_square_metre;
      if (!std::isfinite(wanted)) continue;
      owed_ += wanted;
      pending_ = static_cast<std::uint64_t>(owed_);
      owed_ -= static_cast<double>(pending_);
      if (pending_ > 0) return true;
    }
    return false;
  }

  MeshSampling sampling_;
  std::unique_ptr<MeshTriangles> triangles_;
  std::optional<char> up_;
  std::uint64_t face_ = 0;  // from 1
  Triangle triangle_{};
  std::uint64_t pending_ = 0;
  double owed_ = 0.0;
};

/// The axis that a file of this kind says is up: glTF by its standard, Collada in its header.
std::optional<char> up_axis_of(const std::string& path, std::string_view format) {
  if (format == ".gltf" || format == ".glb") return 'y';
  if (format != ".dae") return std::nullopt;
  constexpr std::size_t kHead = 65536;
  const MappedFile file(path);
  const std::string_view head = as_text(file.bytes()).substr(0, kHead);
  constexpr std::string_view kTag = "<up_axis>";
  const std::size_t at = head.find(kTag);
  if (at == std::string_view::npos) return 'y';  // Collada 1.4, <up_axis>: the default
  const std::size_t axis = head.find_first_not_of(" \t\r\n", at + kTag.size());
  if (axis == std::string_view::npos) return std::nullopt;
  return head[axis] == 'Y' ? 'y' : head[axis] == 'X' ? 'x' : 'z';
}

}  // namespace

std::unique_ptr<CloudReader> open_mesh(const std::string& path,
                                       const std::string& format,
                                       const MeshSampling& sampling,
                                       const MeshLimits& limits,
                                       const Progress& progress) {
  std::unique_ptr<MeshTriangles> triangles =
      format == ".ply"   ? ply_triangles(MappedFile(path), progress)
      : format == ".obj" ? obj_triangles(MappedFile(path), progress)
                         : imported_triangles(path, limits, progress);
  return std::make_unique<MeshReader>(
      path, sampling, std::move(triangles), up_axis_of(path, format), progress);
}

MeshLimits mesh_limits(std::size_t file_bytes) {
  const double megabytes = 1e-6 * static_cast<double>(file_bytes);
  return {20.0 + 4.0 * megabytes, (std::size_t{2} << 30) + 100 * file_bytes};
}

}  // namespace pointflight
