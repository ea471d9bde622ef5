// Scans as people record them, point by point: a folder of clouds, or a topic of a recording
// (recording/recorded_scans).
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/io/recorded_point.hpp"
#include "pointflight/survey/time_unit.hpp"

namespace pointflight {

/// Points of one scan.
struct ScanBatch {
  std::size_t scan = 0;   ///< Its number.
  bool is_return = true;  ///< False: shots without a return, each up to where nothing was.
  std::vector<RecordedPoint> points;  ///< In the recording's order.
  double time_unit = 1.0;             ///< That their times were taken to be in, s.
};

/// Reads scans front to back in batches: a scan is never in memory as a whole.
class ScanReader {
 public:
  virtual ~ScanReader() = default;
  /// Replaces `batch` with the next points (about 100,000 at most). False when there are none left.
  /// Throws InputError.
  virtual bool read(ScanBatch& batch) = 0;
  /// Fraction of the scans that was read, 0 to 1.
  [[nodiscard]] virtual double share_read() const = 0;
};

/// Scans that can be read as often as wanted.
class ScanSource {
 public:
  virtual ~ScanSource() = default;
  /// Scans in it.
  [[nodiscard]] virtual std::size_t scan_count() const = 0;
  /// A scan's stamp, s; NaN: none.
  [[nodiscard]] virtual double time(std::size_t scan) const = 0;
  /// What people call a scan: its file's name, or its number.
  [[nodiscard]] virtual std::string name(std::size_t scan) const = 0;
  /// Where it is, for messages: "scans/000017.pcd".
  [[nodiscard]] virtual std::string path(std::size_t scan) const = 0;
  /// True if the points carry an intensity.
  [[nodiscard]] virtual bool has_intensity() const = 0;
  /// Reads the scans that `chosen` accepts by their number, all without it. The source must outlive
  /// the reader. Throws InputError.
  [[nodiscard]] virtual std::unique_ptr<ScanReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const = 0;
};

/// The number that a scan's file is named by, in s or, from 1e11 on, ns: "1700000000.25.pcd";
/// nothing if it is none.
std::optional<double> seconds_in_name(const std::string& file);

/// Names of the clouds of a folder, by the numbers that they are if all are, else as text;
/// without the file `except`. Throws InputError, also if there are none.
std::vector<std::string> scan_files_in(const std::string& folder, const std::string& except = {});

/// A folder of clouds. A name that is a number is the scan's time if it has decimals or is in ns.
class ScanFolder : public ScanSource {
 public:
  /// The clouds of these names. `free`: a folder with clouds of shots without a return under the
  /// scans' names; empty: none. Throws InputError if it has none of them.
  ScanFolder(std::string folder, std::vector<std::string> names, std::string free = {});

  [[nodiscard]] std::size_t scan_count() const override { return names_.size(); }
  [[nodiscard]] double time(std::size_t scan) const override;
  [[nodiscard]] std::string name(std::size_t scan) const override { return names_[scan]; }
  [[nodiscard]] std::string path(std::size_t scan) const override;
  [[nodiscard]] bool has_intensity() const override;
  [[nodiscard]] std::unique_ptr<ScanReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const override;

 private:
  friend class ScanFolderReader;
  std::string folder_;
  std::vector<std::string> names_;
  std::string free_;
};

/// A scan in memory.
struct RecordedScan {
  double time = std::numeric_limits<double>::quiet_NaN();  ///< Its stamp, s; NaN: none.
  double time_unit = 1.0;  ///< That times of its points were taken to be in, s.
  /// In the recording's order; times count from the first point on.
  std::vector<RecordedPoint> points;
};

/// The first `most` scans of a source. Throws InputError.
std::vector<RecordedScan> read_scans(const ScanSource& source,
                                     std::size_t most,
                                     const Progress& progress = {});

/// Brings the times of their points into seconds by the rate of the scans, if the unit that they
/// were taken to be in does not fit it. Returns what users are told of it (`settled_unit`).
std::string settle_times(std::vector<RecordedScan>& scans,
                         const std::optional<TimeUnit>& given,
                         const std::string& name);

}  // namespace pointflight
