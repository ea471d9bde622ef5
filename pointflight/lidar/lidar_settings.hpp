#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/lidar/detection.hpp"

namespace pointflight {

/// Scan principles: which section of a sensor file counts.
enum class ScanPattern {
  kUnset,   ///< None yet: files must name one.
  kRotor,   ///< Livox Mid-360.
  kPrisms,  ///< Livox Avia, Mid-40, Mid-70.
  kRings,   ///< Spinning LiDARs.
  kGrid,    ///< Depth cameras, angular grids.
  kCsv,     ///< A table of directions.
};

/// How the channels of a spinning LiDAR fire and what its angles mean.
enum class RingConvention {
  kVelodyne,  ///< One after the other; channels lag behind the head by their azimuths.
  kHesai,     ///< One after the other; channels lead by their azimuths.
  kOuster,    ///< All at once, in columns.
};

/// How the beams of a grid lie.
enum class GridProjection {
  kAngular,  ///< Evenly in azimuth and elevation.
  kPinhole,  ///< As pixels; x right, y down.
};

/// Livox Mid-360: a rotating prism and mirror behind a slower wedge.
struct RotorSettings {
  double shot_rate = 50000.0;        ///< Hz; all lines fire together.
  double shot_phase = 0.5;           ///< Of the first shot, in shot periods.
  double rotor_rpm = 10945.0;        ///< theta
  double wedge_rpm = 600.0;          ///< phi
  double wedge_wobble = 0.15;        ///< psi = phi + wobble sin(2 phi) + phase, rad
  double wedge_phase = -0.010644;    ///< rad
  double wedge_angle_deg = 31.1723;  ///< Between its faces.
  double wedge_index = 1.59285;      ///< Refractive.
  double mirror_angle_deg = 10.0;    ///< Of the rotor's prism.
  double mirror_index = 1.96827;     ///< Refractive, of the rotor's prism.
  /// Of each line in the fan.
  std::vector<double> line_angles_deg = {2.12589, 0.70863, -0.70863, -2.12589};
};

/// One refracting wedge on a rotating axis.
struct WedgeSettings {
  double angle_deg = 0.0;   ///< Between the faces.
  double index = 1.51;      ///< Refractive.
  double rate = 0.0;        ///< Turns a second; the sign is the sense.
  double phase_deg = 0.0;   ///< At time zero.
  bool flat_first = false;  ///< Light hits the flat face first ("out"), else the inclined one.
};

/// Livox Avia, Mid-40, Mid-70: wedges on one axis.
struct PrismsSettings {
  double shot_rate = 40000.0;  ///< Hz; all lines fire together.
  double shot_phase = 0.0;     ///< Of the first shot, in shot periods.
  std::vector<double> line_heights = {
      0.0};                           ///< z of each unit input direction (sqrt(1-s^2), 0, s).
  std::vector<WedgeSettings> wedges;  ///< In the order in which light passes them.
};

/// Spinning LiDARs: channels from a table, as a list or evenly spaced.
struct RingsSettings {
  std::string table;  ///< CSV: a path from the sensor file's folder, or a shipped table's name.
  std::vector<double> elevations_deg;       ///< Instead of a table, in the order of firing.
  std::vector<double> azimuth_offsets_deg;  ///< Of the same channels, as a table has them.
  std::int64_t channels = 0;                ///< Instead of both: so many, from the lowest up.
  double elevation_min_deg = -15.0;         ///< Of evenly spaced channels: the lowest.
  double elevation_max_deg = 15.0;          ///< The highest.
  RingConvention convention = RingConvention::kVelodyne;  ///< How a turn is fired.
  double cycle_us = 55.296;          ///< not ouster: from one firing of all channels to the next.
  double channel_interval_us = 0.0;  ///< not ouster: between channels, if the table has no times.
  std::int64_t columns = 1024;       ///< ouster: a turn.
  double beam_origin_radius = 0.0;   ///< ouster: distance of the beams' origin from the axis, m.
  double origin_z = 0.0;  ///< ouster: height of the beams' origin in the sensor frame, m.
};

/// A stereo pair of which a pinhole grid is the left imager (`StereoCamera`).
struct StereoSettings {
  double baseline = 0.0;  ///< The right imager's distance, m; 0: depths are measured as such.
  double disparity_sigma = 0.08;  ///< Of the disparity's noise, px.
  double white_share = 0.3;  ///< Of that, what each pixel has of its own; the rest is common...
  std::int64_t window = 7;   ///< ... to so many pixels across and down.
  std::int64_t disparities = 126;     ///< The matcher's largest, px.
  std::int64_t disparity_steps = 32;  ///< Of each pixel that it tells apart; 0: it does not round.
  double incidence_max_deg = 75.0;    ///< Surfaces seen at more have no depth.
};

/// Depth cameras and dense angular grids: all beams at the scan's start.
struct GridSettings {
  GridProjection projection = GridProjection::kAngular;  ///< Between beams.
  std::int64_t columns = 385;                            ///< Beams in a row.
  std::int64_t rows = 350;                               ///< Rows.
  double fov_horizontal_deg = 77.0;  ///< angular: beams at the centres of the grid's cells.
  double fov_vertical_deg = 70.0;    ///< angular: as above.
  double fx = 0.0;                   ///< pinhole: pixels.
  double fy = 0.0;                   ///< pinhole: focal length along the rows' axis, pixels.
  double cx = 0.0;                   ///< pinhole: principal point, pixels.
  double cy = 0.0;                   ///< pinhole: principal point, pixels.
  StereoSettings stereo{};           ///< pinhole: what measures the depth.
  /// pinhole: what its own light gives at 1 m, as sunlight, klx: of infrared pictures.
  double projector_klx = 5.0;
};

/// A user's own table of directions, replayed in a loop.
struct CsvSettings {
  std::string file;                     ///< Columns azimuth and elevation or zenith, degrees.
  double points_per_second = 200000.0;  ///< Rows replayed in a second.
  std::int64_t lines = 1;               ///< Ring of row i = i mod lines.
};

/// Standard deviation of the range: sqrt(range_sigma^2 + (range_sigma_per_m2 R^2)^2 +
/// (range_sigma_at_limit / margin)^2), the last one if returns are modelled (`ReturnModel`): the
/// jitter of a threshold's crossing goes with rise time over signal.
struct RangeNoiseSettings {
  double range_sigma = 0.0;           ///< m
  double range_sigma_per_m2 = 0.0;    ///< m per m^2: stereo cameras.
  double range_sigma_at_limit = 0.0;  ///< m, added in squares at the rated ranges.
  double offset_sigma = 0.0;          ///< m: deviation of an offset of all ranges of a run.
  double ring_offset_sigma = 0.0;     ///< m: the same of each ring by itself.
  double range_step = 0.0;            ///< m: ranges are whole multiples; 0: they are not rounded.
};

/// The optics. The divergence sets the footprint of a beam (mixed pixels, echoes) and how many
/// raindrops it hits. The wavelength is shown by `lidar show` and not used.
struct OpticsSettings {
  double wavelength_nm = 0.0;              ///< Not used yet.
  double divergence_horizontal_deg = 0.0;  ///< Full angle at half maximum.
  double divergence_vertical_deg = 0.0;    ///< Full angle at half maximum.
  double angle_sigma_deg = 0.0;  ///< Of each beam's direction about each of two axes across it.
  double pulse_ns = 5.0;         ///< Echoes closer than half its length are one.
  /// Rays over the cross-section; 0: as many as it takes, 8 to 288; 1: beams are lines
  /// (`Footprint`).
  std::int64_t sub_rays = 0;
};

/// What deskewing leaves in a scan: from its first to its last beam points turn and shift, in
/// proportion to time, by what the motion estimate was wrong (`ResidualMotion`). Of scans that are
/// taken from one pose, which stand for deskewed ones; rolling scans have their motion in them.
struct DeskewingSettings {
  double rotation_sigma_deg = 0.0;  ///< About each axis, over a scan.
  double translation_sigma = 0.0;   ///< m along each axis, over a scan.
};

/// What a figure rests on.
enum class Ground {
  kMeasured,  ///< On scans of the sensor or a table of its maker's that was measured or computed.
  kSheet,     ///< Its maker's data sheet, manual, driver or SDK, read.
  kQuoted,    ///< The sheet as others quote it.
  kAssumed,   ///< Nobody's figure: what is likely.
};

/// As files have it: "measured", ...
std::string_view to_string(Ground ground);

/// What the figures of a sensor file rest on, by what they are of; of several the one that counts
/// most in a scan.
struct GroundsSettings {
  Ground pattern = Ground::kAssumed;          ///< Directions and times of beams.
  Ground ranges = Ground::kAssumed;           ///< How far it sees: `detection.rated`.
  Ground range_noise = Ground::kAssumed;      ///< `noise.range_sigma`
  Ground direction_noise = Ground::kAssumed;  ///< `optics.angle_sigma_deg`
  Ground beam_width = Ground::kAssumed;       ///< `optics.divergence_...`
};

/// A sensor file, `data/lidars/<name>.yaml`.
struct LidarSettings {
  std::string path;         ///< Of the file, for messages and for files beside it.
  std::string title;        ///< Maker and model.
  std::string source;       ///< Where the figures come from.
  GroundsSettings grounds;  ///< The same in a word each.
  double rate = 10.0;       ///< Scans a second.
  double range_min = 0.1;   ///< m; nearer returns are lost (a depth camera's: depth).
  /// m; farther returns are lost (a depth camera's: depth), if `detection` does not say more.
  double range_max = 100.0;
  double image_resolution_deg = 0.2;          ///< theta_res of the `paper` renderer.
  RangeNoiseSettings noise;                   ///< Of every return.
  OpticsSettings optics;                      ///< Of every beam.
  DetectionSettings detection;                ///< Which beams come back.
  DeskewingSettings deskewing;                ///< Of scans without motion.
  std::string blocked;                        ///< CSV: `read_blocked_sectors`. Empty: nothing is.
  ScanPattern pattern = ScanPattern::kUnset;  ///< Which of the sections below counts.
  RotorSettings rotor;                        ///< Where `pattern` says so.
  PrismsSettings prisms;                      ///< Where `pattern` says so.
  RingsSettings rings;                        ///< Where `pattern` says so.
  GridSettings grid;                          ///< Where `pattern` says so.
  CsvSettings csv;                            ///< Where `pattern` says so.
  std::map<std::string, int> lines;           ///< Of each key in the file, for messages.

  /// A depth camera: limits and noise are of the depth along its axis.
  [[nodiscard]] bool measures_depth() const {
    return pattern == ScanPattern::kGrid && grid.projection == GridProjection::kPinhole;
  }

  /// "mid360.yaml:12" for a key, or the path where the key is not in the file.
  [[nodiscard]] std::string location(const std::string& key) const;

  /// Runs `action` for what a key names; an InputError in it also says where the key stands.
  template <class Action>
  auto at(const std::string& key, const Action& action) const {
    return at_key(location(key), key, action);
  }
};

/// As files have it: "rotor", ...
std::string_view to_string(ScanPattern pattern);

/// The one list of keys of a sensor file.
void describe(SettingsVisitor& visitor, LidarSettings& settings);

/// Markdown table of all keys.
std::string lidar_reference();

/// Refuses settings whose parts do not fit together. Throws InputError with the key's location.
void check(const LidarSettings& settings);

/// Reads a sensor by name ("mid360") or path; relative paths are taken from `base`. Beside sensor
/// files (.yaml) it reads those of vendors (`vendor_files.hpp`): Ouster's metadata (.json) and
/// tables of directions (.csv).
LidarSettings load_lidar(const std::string& name_or_path, const std::string& base = {});

/// The files that a sensor's settings name beside its own, as paths that can be opened; each in
/// its setting.
std::vector<std::string*> tables_of(LidarSettings& settings);

/// From text, for tests and fuzzers; `path` is where files beside it would lie.
LidarSettings parse_lidar(std::string_view text, const std::string& path);

}  // namespace pointflight
