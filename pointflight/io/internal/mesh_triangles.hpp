// Where the triangles of a mesh come from.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"

namespace pointflight {

/// The triangles of a mesh in a fixed order, in the file's own unit and axes.
class MeshTriangles {
 public:
  virtual ~MeshTriangles() = default;
  /// The next one; false after the last. Throws InputError with line or byte.
  virtual bool next(Triangle& triangle) = 0;
  /// Back to the first.
  virtual void restart() = 0;
  /// Of what there is, 0 to 1.
  [[nodiscard]] virtual double share_read() const = 0;
  /// Corners were stored or read as 32-bit floats.
  [[nodiscard]] virtual bool is_single_precision() const = 0;
  /// As the file names it.
  [[nodiscard]] virtual std::optional<FileUnit> unit() const { return std::nullopt; }
};

/// PLY: faces of any number of corners, and triangle strips; streamed beside the vertices.
std::unique_ptr<MeshTriangles> ply_triangles(MappedFile file, const Progress& progress);

/// Wavefront OBJ: faces of any number of corners; streamed beside the vertices.
std::unique_ptr<MeshTriangles> obj_triangles(MappedFile file, const Progress& progress);

/// Any format that assimp reads, in a child process: damaged files make assimp crash. Throws
/// InputError, also if the program was built without assimp.
std::unique_ptr<MeshTriangles> imported_triangles(const std::string& path,
                                                  const MeshLimits& limits,
                                                  const Progress& progress);

/// The triangles that a plane polygon falls into, as numbers of its corners; corners may be
/// reentrant, up to 2,048 of them. Polygons that cross themselves come out somehow; fewer than
/// three corners as nothing.
std::vector<std::array<std::size_t, 3>> triangulated(std::span<const Vector3d> corners);

}  // namespace pointflight
