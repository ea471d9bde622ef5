#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// One point of a cloud, in the file's own coordinates.
struct CloudPoint {
  Vector3d position = Vector3d::Zero();  ///< Metres, after `MeshSampling` and before --scale, --up.
  float intensity = 0.0f;                ///< The file's own scale; 0 if the file has none.
  std::array<std::uint8_t, 3> color{};   ///< Red, green, blue; 0 if the file has none.
};

/// Brightness of a point's colour as the eye has it, 0 to 255 (ITU-R BT.601).
inline float luminance(const CloudPoint& point) {
  const auto part = [&](std::size_t i) { return static_cast<float>(point.color[i]); };
  return 0.299f * part(0) + 0.587f * part(1) + 0.114f * part(2);
}

/// The unit of length that a file names for its coordinates.
struct FileUnit {
  std::string name;     ///< "foot"
  double metres = 1.0;  ///< Of one unit; 0 if the coordinates are angles.
};

/// What a file has beside coordinates, by its own names, for messages.
struct FileColumns {
  std::string intensity;              ///< What is taken for intensity; empty: nothing.
  std::vector<std::string> of_scans;  ///< Times and rings, which mean something in scans alone.
  std::vector<std::string> left_out;  ///< What is not read.
  std::vector<std::string> notes;     ///< Whatever else a person should know, a line each.
};

/// A column that is passed on as it is in the file, whatever it means.
struct RawColumn {
  std::string name;      ///< The file's own.
  char type = 'F';       ///< As PCD has it: 'F' floating, 'I' signed, 'U' unsigned.
  std::size_t size = 4;  ///< Bytes of a value: 1, 2, 4, 8.
};

/// Rows and columns of an organised cloud, whose points without a return are NaN.
struct CloudShape {
  std::uint64_t width = 0;   ///< Points in a row.
  std::uint64_t height = 1;  ///< Rows.
};

/// Reads a cloud front to back in batches: the whole cloud is never in memory (but for
/// binary_compressed PCD, whose layout forces one decompressed copy).
class CloudReader {
 public:
  virtual ~CloudReader() = default;

  /// Replaces `batch` with the next points (at most about 65,536). False when there are none left.
  /// NaN and infinite coordinates are passed on: the caller counts and drops them. Throws
  /// InputError with file and line or byte if the file is not what its header says.
  virtual bool read(std::vector<CloudPoint>& batch) = 0;

  /// True if the points carry an intensity.
  [[nodiscard]] virtual bool has_intensity() const = 0;

  /// True if the points carry a colour.
  [[nodiscard]] virtual bool has_color() const { return false; }

  /// When the points of the last batch were measured, s, in their order; empty if the file does
  /// not say. By the field's own zero: the scan's start, or the epoch.
  [[nodiscard]] virtual std::span<const double> times() const { return {}; }

  /// The unit that those times were taken to be in, s: of whole numbers and of huge ones 1e-9.
  [[nodiscard]] virtual double time_unit() const { return 1.0; }

  /// Numbers of the channels that measured the points of the last batch; empty if the file does
  /// not say.
  [[nodiscard]] virtual std::span<const std::int32_t> rings() const { return {}; }

  /// Scalar columns beside position, intensity and colour, times and rings among them; empty if the
  /// format's reader passes none on.
  [[nodiscard]] virtual std::vector<RawColumn> raw_columns() const { return {}; }

  /// From now on `raw` is kept.
  virtual void keep_raw() {}

  /// Of the last batch, if it is kept: a row of the raw columns for each point, little-endian,
  /// without padding.
  [[nodiscard]] virtual std::span<const std::byte> raw() const { return {}; }

  /// Of an organised cloud; nothing if it is none.
  [[nodiscard]] virtual std::optional<CloudShape> shape() const { return std::nullopt; }

  /// What is read of its columns, and what is not.
  [[nodiscard]] virtual FileColumns columns() const { return {}; }

  /// The unit that the file's header or its first comments name; nothing if they name none.
  [[nodiscard]] virtual std::optional<FileUnit> unit() const { return std::nullopt; }

  /// The axis ('x', 'y', 'z') that the file says is up; nothing if it does not say.
  [[nodiscard]] virtual std::optional<char> up_axis() const { return std::nullopt; }

  /// Share of the file that was read, 0 to 1.
  [[nodiscard]] virtual double share_read() const = 0;

 protected:
  /// Points that readers of formats put in one batch.
  static constexpr std::size_t kBatch = 65536;
};

/// How meshes turn into points; clouds ignore it.
struct MeshSampling {
  double points_per_square_metre = 3200.0;  ///< 8 points per 0.05 m square.
  double unit = 1.0;                        ///< The metres of one unit of the mesh's coordinates.
};

/// A cloud or mesh that can be opened repeatedly.
class CloudSource {
 public:
  /// A file. `format` is an extension ("las") that counts instead of the path's own.
  CloudSource(std::string path, const std::string& format = {});  // NOLINT: a path is a source
  /// The same, for literals.
  CloudSource(const char* path) : CloudSource(std::string(path)) {}  // NOLINT

  /// Reads a pipe or socket to its end into an unnamed file in `folder` (empty: the folder of
  /// temporary files), because an import may read it twice. Without a `format` the first bytes
  /// decide; meshes are not read from pipes. Throws InputError.
  static CloudSource from_stream(int descriptor,
                                 const std::string& format,
                                 const std::string& folder,
                                 const Progress& progress = {});

  /// For messages: the path, or what stands for a stream.
  [[nodiscard]] const std::string& name() const { return name_; }

  /// True if it is a mesh (by extension; a PLY or an OBJ if it has faces).
  [[nodiscard]] bool is_mesh() const;

  /// Opens it at its beginning. Throws InputError. `progress` may throw while a mesh is read.
  [[nodiscard]] std::unique_ptr<CloudReader> open(const MeshSampling& sampling = {},
                                                  const Progress& progress = {}) const;

 private:
  [[nodiscard]] MappedFile map_file() const;

  std::string name_;  ///< The path, or what stands for it in messages.
  std::string format_;
  std::shared_ptr<const int> spool_;  ///< Descriptor of the kept bytes; null for files.
};

/// Opens a file by its extension; the table of formats is in cloud_reader.cpp.
///
/// To add a format: write `io/<name>.*` with a class derived from CloudReader, add one line to the
/// table, a golden file under 10 KB in tests/io, and a fuzz target in tests/fuzz.
std::unique_ptr<CloudReader> open_cloud(const std::string& path, const MeshSampling& sampling = {});

/// Extensions that are read, for help texts.
std::string known_cloud_formats();

/// True if the path ends as clouds' files do, that are no meshes: ".pcd", ".LAS", ...
bool has_cloud_extension(const std::string& path);

/// True if the path names a mesh (by extension; a PLY or an OBJ if it has faces).
bool is_mesh(const std::string& path);

}  // namespace pointflight
