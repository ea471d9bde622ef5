#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// What the points of a written cloud carry beside x, y and z.
struct CloudColumns {
  bool intensity = false;                ///< float32; 16 bits in LAS.
  bool color = false;                    ///< Red, green, blue.
  bool normal = false;                   ///< Not in LAS.
  bool ellipsoid = false;                ///< Deviations, axes and number of a surfel; not in LAS.
  std::vector<RawColumn> raw = {};       ///< Passed on behind all others; not in LAS.
  std::optional<CloudShape> shape = {};  ///< Of an organised cloud; PCD alone has it.
};

/// One row of a written cloud; what its columns lack is not looked at.
struct CloudRow {
  CloudPoint point;                                          ///< World, m.
  Vector3f normal = Vector3f::Zero();                        ///< Unit length.
  Vector3f spread = Vector3f::Zero();                        ///< Standard deviations, m.
  Eigen::Quaternionf axes = Eigen::Quaternionf::Identity();  ///< World <- surfel.
  std::uint32_t surfel = 0;             ///< Its number, as scans' truth has it.
  std::span<const std::byte> raw = {};  ///< Its raw columns (`CloudReader::raw`).
};

/// Writes a cloud row by row, never held; it appears under its name with `commit`.
///
/// PCD and PLY are binary with coordinates as float32, or float64 if the first batch lies beyond
/// 4 km; LAS is 1.2 with steps of 0.1 mm.
class CloudWriter {
 public:
  virtual ~CloudWriter() = default;

  /// Appends points without normals and ellipsoids, with their raw columns (`CloudReader::raw`).
  /// Throws InputError.
  void write(std::span<const CloudPoint> points, std::span<const std::byte> raw = {});
  /// Appends rows. Throws InputError.
  void write(std::span<const CloudRow> rows);

  /// Completes the header and the file.
  virtual void commit() = 0;

  /// Rows written so far.
  [[nodiscard]] std::uint64_t count() const { return count_; }

  /// What the format could not hold, for a warning; empty if nothing was lost.
  [[nodiscard]] virtual std::string loss() const { return {}; }

 protected:
  /// Of a format: writes into `file`, whose header is completed by `commit`.
  explicit CloudWriter(OutputFile file) : file_(std::move(file)) {}
  /// Called once, with the first rows.
  virtual void begin(std::span<const CloudRow> rows) = 0;
  /// Adds the bytes of a row to `bytes`, which are written in blocks.
  virtual void append(const CloudRow& row, std::vector<std::byte>& bytes) = 0;

  OutputFile file_;          ///< What is written.
  std::uint64_t count_ = 0;  ///< Rows so far.
  bool begun_ = false;       ///< `begin` was called.

 private:
  std::vector<CloudRow> rows_;
  std::vector<std::byte> bytes_;
};

/// Opens a cloud for writing by the extension of the file's path: .pcd, .ply, .las. Throws
/// InputError if it is another one, or cannot hold the columns.
std::unique_ptr<CloudWriter> write_cloud(OutputFile file, const CloudColumns& columns);

/// Throws InputError if `path` has no extension that is written; says so before hours of work.
void require_writable_cloud(const std::string& path);

}  // namespace pointflight
