#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// One point of a cloud, in the file's own coordinates.
struct CloudPoint {
  Vector3d position = Vector3d::Zero();  ///< Metres, after `MeshSampling` and before --scale, --up.
  float intensity = 0.0f;                ///< The file's own scale; 0 where the file has none.
};

/// Reads a cloud front to back in batches: the whole cloud is never in memory (but for
/// binary_compressed PCD, whose layout forces one decompressed copy).
class CloudReader {
 public:
  virtual ~CloudReader() = default;

  /// Replaces `batch` with the next points (at most about 65,536). False when there are none left.
  /// NaN and infinite coordinates are passed on: the caller counts and drops them. Throws
  /// InputError with file and line or byte where the file is not what its header says.
  virtual bool read(std::vector<CloudPoint>& batch) = 0;

  /// True if the points carry an intensity.
  [[nodiscard]] virtual bool has_intensity() const = 0;

  /// Share of the file that was read, 0 to 1.
  [[nodiscard]] virtual double share_read() const = 0;

 protected:
  static constexpr std::size_t kBatch = 65536;
};

/// How meshes turn into points; clouds ignore it.
struct MeshSampling {
  double points_per_square_metre = 3200.0;  ///< 8 points per 0.05 m square.
  double unit = 1.0;                        ///< The metres of one unit of the mesh's coordinates.
};

/// Opens a cloud or mesh by its extension; the table of formats is in cloud_reader.cpp.
///
/// To add a format: write `io/<name>.*` with a class derived from CloudReader, add one line to the
/// table, a golden file under 10 KB in tests/io, and a fuzz target in tests/fuzz.
std::unique_ptr<CloudReader> open_cloud(const std::string& path, const MeshSampling& sampling = {});

/// Extensions that `open_cloud` reads, for help texts.
std::string known_cloud_formats();

/// True if the path names a mesh (by extension, or a PLY with faces).
bool is_mesh(const std::string& path);

}  // namespace pointflight
