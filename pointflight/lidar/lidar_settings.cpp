#include "pointflight/lidar/lidar_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/lidar/vendor_files.hpp"

namespace pointflight {
namespace {

constexpr Named<ScanPattern> kPatterns[] = {{ScanPattern::kRotor, "rotor"},
                                            {ScanPattern::kPrisms, "prisms"},
                                            {ScanPattern::kRings, "rings"},
                                            {ScanPattern::kGrid, "grid"},
                                            {ScanPattern::kCsv, "csv"}};
constexpr Named<RingConvention> kConventions[] = {{RingConvention::kVelodyne, "velodyne"},
                                                  {RingConvention::kHesai, "hesai"},
                                                  {RingConvention::kOuster, "ouster"}};
constexpr Named<GridProjection> kProjections[] = {{GridProjection::kAngular, "angular"},
                                                  {GridProjection::kPinhole, "pinhole"}};
constexpr Named<Ground> kGrounds[] = {{Ground::kMeasured, "measured"},
                                      {Ground::kSheet, "sheet"},
                                      {Ground::kQuoted, "quoted"},
                                      {Ground::kAssumed, "assumed"}};

void describe_grounds(SettingsVisitor& v, GroundsSettings& s) {
  v.choice({"pattern", "", "directions and times of beams"}, s.pattern, kGrounds);
  v.choice({"ranges", "", "how far it sees"}, s.ranges, kGrounds);
  v.choice({"range_noise", "", "noise.range_sigma"}, s.range_noise, kGrounds);
  v.choice({"direction_noise", "", "optics.angle_sigma_deg"}, s.direction_noise, kGrounds);
  v.choice({"beam_width", "", "the optics' divergence"}, s.beam_width, kGrounds);
}

void describe_rotor(SettingsVisitor& v, RotorSettings& s) {
  v.value({"shot_rate", "Hz", "all lines fire together at this rate", 1, 1e7}, s.shot_rate);
  v.value({"shot_phase", "", "of the first shot, in shot periods", 0, 1}, s.shot_phase);
  v.value({"rotor_rpm", "1/min", "turns of the rotor", -1e6, 1e6}, s.rotor_rpm);
  v.value({"wedge_rpm", "1/min", "turns of the wedge", -1e6, 1e6}, s.wedge_rpm);
  v.value({"wedge_wobble", "rad", "second harmonic of the wedge's angle", -1, 1}, s.wedge_wobble);
  v.value({"wedge_phase", "rad", "of the wedge at time zero", -7, 7}, s.wedge_phase);
  v.value({"wedge_angle_deg", "deg", "between the wedge's faces", 0, 60}, s.wedge_angle_deg);
  v.value({"wedge_index", "", "refractive index of the wedge", 1, 4}, s.wedge_index);
  v.value({"mirror_angle_deg", "deg", "of the rotor's prism", -45, 45}, s.mirror_angle_deg);
  v.value({"mirror_index", "", "refractive index of the rotor's prism", 1, 4}, s.mirror_index);
  v.value({"line_angles_deg", "deg", "of each line in the fan", -45, 45}, s.line_angles_deg);
}

void describe_prisms(SettingsVisitor& v, PrismsSettings& s) {
  v.value({"shot_rate", "Hz", "all lines fire together at this rate", 1, 1e7}, s.shot_rate);
  v.value({"shot_phase", "", "of the first shot, in shot periods", 0, 1}, s.shot_phase);
  v.value({"line_heights", "", "z of each line's unit input direction", -0.7, 0.7}, s.line_heights);
  v.list({"wedges", "", "in the order in which light passes them"},
         s.wedges,
         [](SettingsVisitor& w, WedgeSettings& wedge) {
           w.value({"angle_deg", "deg", "between the faces", 0, 60, true}, wedge.angle_deg);
           w.value({"index", "", "refractive index", 1, 4, true}, wedge.index);
           w.value({"rate", "1/s", "turns per second; the sign is the sense", -1e4, 1e4, true},
                   wedge.rate);
           w.value({"phase_deg", "deg", "at time zero", -360, 360}, wedge.phase_deg);
           w.value({"flat_first", "", "light hits the flat face first"}, wedge.flat_first);
         });
}

void describe_channels(SettingsVisitor& v, RingsSettings& s) {
  v.value({"table",
           "",
           "CSV of the channels: a path from this file's folder, or the name of a shipped table"},
          s.table);
  v.value({"elevations_deg", "deg", "of the channels, instead of a table", -90, 90},
          s.elevations_deg);
  v.only_if(!s.elevations_deg.empty(), "elevations_deg", [&](SettingsVisitor& w) {
    w.value({"azimuth_offsets_deg", "deg", "of the same channels; empty: none", -180, 180},
            s.azimuth_offsets_deg);
  });
  v.value({"channels", "", "so many, evenly spaced, instead of a table; 0: none", 0, 1024},
          s.channels);
  v.only_if(s.channels > 0, "channels", [&](SettingsVisitor& w) {
    w.value({"elevation_min_deg", "deg", "of the lowest channel", -90, 90}, s.elevation_min_deg);
    w.value({"elevation_max_deg", "deg", "of the highest channel", -90, 90}, s.elevation_max_deg);
  });
}

void describe_rings(SettingsVisitor& v, RingsSettings& s) {
  v.choice({"convention", "", "how channels fire and how a table's angles are meant"},
           s.convention,
           kConventions);
  describe_channels(v, s);
  v.only_if(s.convention != RingConvention::kOuster,
            "convention: velodyne or hesai",
            [&](SettingsVisitor& w) {
              w.value({"cycle_us", "us", "between firings of one channel", 1, 1e6}, s.cycle_us);
              w.value({"channel_interval_us",
                       "us",
                       "from channel to channel, without times in a table",
                       0,
                       1e5},
                      s.channel_interval_us);
            });
  v.only_if(s.convention == RingConvention::kOuster, "convention: ouster", [&](SettingsVisitor& w) {
    w.value({"columns", "", "a turn", 1, 65536}, s.columns);
    w.value({"beam_origin_radius", "m", "of the beams' origin from the axis", 0, 1},
            s.beam_origin_radius);
    w.value({"origin_z", "m", "height of the beams' origin", -1, 1}, s.origin_z);
  });
}

void describe_stereo(SettingsVisitor& v, StereoSettings& s) {
  v.value({"baseline", "m", "distance of the right imager; 0: depths are measured as such", 0, 10},
          s.baseline);
  v.only_if(s.baseline > 0.0, "with a baseline", [&](SettingsVisitor& w) {
    w.value({"disparity_sigma", "px", "of the disparity's noise", 0, 100}, s.disparity_sigma);
    w.value({"white_share", "", "of the noise that each pixel has of its own", 0, 1},
            s.white_share);
    w.value({"window", "px", "the rest is common to so many, across and down", 1, 1000}, s.window);
    w.value({"disparities", "px", "the largest that is looked for", 1, 16384}, s.disparities);
    w.value({"disparity_steps", "1/px", "disparities are whole multiples; 0: not rounded", 0, 1024},
            s.disparity_steps);
    w.value({"incidence_max_deg", "deg", "surfaces seen at more have no depth", 0, 90},
            s.incidence_max_deg);
  });
}

void describe_grid(SettingsVisitor& v, GridSettings& s) {
  v.choice({"projection", "", "how rows and columns lie"}, s.projection, kProjections);
  v.value({"columns", "", "beams in a row", 1, 16384}, s.columns);
  v.value({"rows", "", "rows", 1, 16384}, s.rows);
  v.only_if(
      s.projection == GridProjection::kAngular, "projection: angular", [&](SettingsVisitor& w) {
        w.value({"fov_horizontal_deg", "deg", "width", 0.001, 360}, s.fov_horizontal_deg);
        w.value({"fov_vertical_deg", "deg", "height", 0.001, 180}, s.fov_vertical_deg);
      });
  v.only_if(
      s.projection == GridProjection::kPinhole, "projection: pinhole", [&](SettingsVisitor& w) {
        w.value({"fx", "px", "focal length", 0, 1e6}, s.fx);
        w.value({"fy", "px", "focal length", 0, 1e6}, s.fy);
        w.value({"cx", "px", "principal point", -1e5, 1e5}, s.cx);
        w.value({"cy", "px", "principal point", -1e5, 1e5}, s.cy);
        w.value({"projector_klx",
                 "klx",
                 "its own light at 1 m, as sunlight: of infrared pictures",
                 0,
                 1000},
                s.projector_klx);
        w.section({"stereo", "", "of two imagers, this grid the left one"},
                  [&](SettingsVisitor& u) { describe_stereo(u, s.stereo); });
      });
}

void describe_csv(SettingsVisitor& v, CsvSettings& s) {
  v.value({"file", "", "CSV with columns azimuth and elevation or zenith, degrees"}, s.file);
  v.value({"points_per_second", "1/s", "rows replayed in a second", 1, 1e8}, s.points_per_second);
  v.value({"lines", "", "ring of row i is i mod lines", 1, 4096}, s.lines);
}

void describe_noise(SettingsVisitor& v, RangeNoiseSettings& s) {
  v.value({"range_sigma", "m", "standard deviation of the range (pinhole grid: depth)", 0, 10},
          s.range_sigma);
  v.value({"range_sigma_per_m2", "1/m", "part that grows with range squared (stereo)", 0, 1},
          s.range_sigma_per_m2);
  v.value({"range_sigma_at_limit", "m", "added in squares where the signal is at its limit", 0, 10},
          s.range_sigma_at_limit);
  v.value({"offset_sigma", "m", "of an offset of all ranges that is drawn once for a run", 0, 1},
          s.offset_sigma);
  v.value({"ring_offset_sigma", "m", "of an offset of each ring, drawn once for a run", 0, 1},
          s.ring_offset_sigma);
  v.value({"range_step", "m", "ranges are whole multiples of it; 0: not rounded", 0, 1},
          s.range_step);
}

void describe_deskewing(SettingsVisitor& v, DeskewingSettings& s) {
  v.value({"rotation_sigma_deg",
           "deg",
           "points turn by so much, about each axis, from a scan's first beam to its last",
           0,
           2},
          s.rotation_sigma_deg);
  v.value({"translation_sigma", "m", "they shift by so much, along each axis", 0, 1},
          s.translation_sigma);
}
void describe_optics(SettingsVisitor& v, OpticsSettings& s) {
  v.value({"wavelength_nm", "nm", "not used yet", 0, 20000}, s.wavelength_nm);
  v.value({"divergence_horizontal_deg", "deg", "full angle, FWHM; both 0: beams are lines", 0, 10},
          s.divergence_horizontal_deg);
  v.value({"divergence_vertical_deg", "deg", "full angle, FWHM", 0, 10}, s.divergence_vertical_deg);
  v.value({"angle_sigma_deg", "deg", "of the beam's direction, about each of two axes", 0, 10},
          s.angle_sigma_deg);
  v.value(
      {"pulse_ns", "ns", "length of a pulse: echoes closer than half of it are one", 0.01, 1000},
      s.pulse_ns);
  v.value({"sub_rays",
           "",
           "rays over a beam's cross-section; 0: as many as it takes, 8 to 288; 1: beams are lines",
           0,
           4096},
          s.sub_rays);
}

LidarSettings read(SettingsReader& reader, const std::string& path) {
  LidarSettings settings;
  describe(reader, settings);
  reader.finish();
  settings.path = path;
  settings.lines = reader.lines();
  check(settings);
  return settings;
}

}  // namespace

void describe(SettingsVisitor& v, LidarSettings& s) {
  v.value({"title", "", "vendor and model"}, s.title);
  v.value({"source", "", "where the figures come from"}, s.source);
  v.section({"grounds", "", "what its figures rest on"},
            [&](SettingsVisitor& w) { describe_grounds(w, s.grounds); });
  v.value({"rate", "Hz", "scans per second", 0.01, 10000}, s.rate);
  v.value({"range_min",
           "m",
           "shorter returns are dropped; of a pinhole grid: less depth along the axis",
           0,
           1e5},
          s.range_min);
  v.value(
      {"range_max",
       "m",
       "longest range, where detection.rated does not say it; of a pinhole grid: depth along the "
       "axis",
       0.01,
       1e5,
       true},
      s.range_max);
  v.value({"image_resolution_deg", "deg", "theta_res of the paper renderer", 0.01, 10},
          s.image_resolution_deg);
  v.section({"noise", "", "Gaussian range noise"},
            [&](SettingsVisitor& w) { describe_noise(w, s.noise); });
  v.section({"optics", "", "of every beam"},
            [&](SettingsVisitor& w) { describe_optics(w, s.optics); });
  v.section({"detection", "", "which beams come back, by the sheet's ranges"},
            [&](SettingsVisitor& w) { describe(w, s.detection); });
  v.section({"deskewing", "", "what it leaves in scans that are taken from one pose"},
            [&](SettingsVisitor& w) { describe_deskewing(w, s.deskewing); });
  v.value({"blocked",
           "",
           "CSV of directions in which what carries the sensor is in the way: a path from this "
           "file's folder"},
          s.blocked);
  Key pattern{"pattern", "", "scan principle; its figures stand in the section of this name"};
  pattern.required = true;
  v.choice(pattern, s.pattern, kPatterns);
  v.only_if(s.pattern == ScanPattern::kRotor, "pattern: rotor", [&](SettingsVisitor& u) {
    u.section({"rotor", "", "prism, mirror and wedge on one shaft (Mid-360)"},
              [&](SettingsVisitor& w) { describe_rotor(w, s.rotor); });
  });
  v.only_if(s.pattern == ScanPattern::kPrisms, "pattern: prisms", [&](SettingsVisitor& u) {
    u.section({"prisms", "", "refracting wedges on one axis (Avia, Mid-40, Mid-70)"},
              [&](SettingsVisitor& w) { describe_prisms(w, s.prisms); });
  });
  v.only_if(s.pattern == ScanPattern::kRings, "pattern: rings", [&](SettingsVisitor& u) {
    u.section({"rings", "", "spinning channels (Velodyne, Ouster)"},
              [&](SettingsVisitor& w) { describe_rings(w, s.rings); });
  });
  v.only_if(s.pattern == ScanPattern::kGrid, "pattern: grid", [&](SettingsVisitor& u) {
    u.section({"grid", "", "depth camera or dense angular grid"},
              [&](SettingsVisitor& w) { describe_grid(w, s.grid); });
  });
  v.only_if(s.pattern == ScanPattern::kCsv, "pattern: csv", [&](SettingsVisitor& u) {
    u.section({"csv", "", "a table of directions of your own"},
              [&](SettingsVisitor& w) { describe_csv(w, s.csv); });
  });
}

std::string_view to_string(ScanPattern pattern) {
  return name_in(kPatterns, pattern);
}

std::string_view to_string(Ground ground) {
  return name_in(kGrounds, ground);
}

std::string lidar_reference() {
  LidarSettings defaults;  // with one of each, so that all keys are listed
  defaults.prisms.wedges.resize(1);
  defaults.detection.rated.resize(1);
  defaults.detection.near.resize(1);
  SettingsTable table;
  describe(table, defaults);
  return table.text();
}

std::string LidarSettings::location(const std::string& key) const {
  const auto line = lines.find(key);
  return line == lines.end() ? path : fmt::format("{}:{}", path, line->second);
}

std::vector<std::string*> tables_of(LidarSettings& settings) {
  std::vector<std::string*> tables;
  const std::string folder = std::filesystem::path(settings.path).parent_path().string();
  if (std::string& table = settings.rings.table; !table.empty()) {
    table = settings.at("rings.table", [&] { return find_table("lidars", table, folder); });
    tables.push_back(&table);
  }
  for (std::string* file : {&settings.csv.file, &settings.blocked}) {
    if (file->empty()) continue;
    *file = resolve_path(*file, folder);
    tables.push_back(file);
  }
  return tables;
}

LidarSettings load_lidar(const std::string& name_or_path, const std::string& base) {
  const std::string path = find_model("lidars", name_or_path, base);
  if (path.ends_with(".json")) return load_ouster_metadata(path);
  if (path.ends_with(".csv")) return load_livox_table(path);
  SettingsReader reader(path);
  return read(reader, path);
}

LidarSettings parse_lidar(std::string_view text, const std::string& path) {
  SettingsReader reader(text, path);
  return read(reader, path);
}

}  // namespace pointflight
