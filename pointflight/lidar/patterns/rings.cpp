#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/patterns/patterns.hpp"

namespace pointflight {
namespace {

struct Channel {
  double elevation_deg;
  double azimuth_offset_deg;
};

/// The channels of a file that has no table, in its order.
std::vector<Channel> listed_channels(const RingsSettings& s) {
  std::vector<Channel> channels;
  for (std::size_t i = 0; i < s.elevations_deg.size(); ++i) {
    channels.push_back(
        {s.elevations_deg[i], s.azimuth_offsets_deg.empty() ? 0.0 : s.azimuth_offsets_deg[i]});
  }
  for (std::int64_t i = 0; i < s.channels; ++i) {
    const double share =
        s.channels == 1 ? 0.0 : static_cast<double>(i) / static_cast<double>(s.channels - 1);
    channels.push_back(
        {s.elevation_min_deg + share * (s.elevation_max_deg - s.elevation_min_deg), 0.0});
  }
  return channels;
}

/// The table that channels without one stand for.
CsvTable table_of(std::vector<Channel> channels, const RingsSettings& s, const std::string& name) {
  const auto below = [](const Channel& a, const Channel& b) {
    return a.elevation_deg < b.elevation_deg;
  };
  std::string text;
  if (s.convention == RingConvention::kOuster) {  // whose rows are counted from the top
    std::stable_sort(channels.begin(), channels.end(), [&](const Channel& a, const Channel& b) {
      return below(b, a);
    });
    text = "beam_altitude_deg,beam_azimuth_deg\n";
    for (const Channel& c : channels) {
      text += fmt::format("{},{}\n", c.elevation_deg, c.azimuth_offset_deg);
    }
    return {text, name};
  }
  text = "ring,elevation_deg,azimuth_offset_deg\n";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    // from below; equal ones in their order
    std::size_t ring = 0;
    for (std::size_t j = 0; j < channels.size(); ++j) {
      const bool equal = channels[j].elevation_deg == channels[i].elevation_deg;
      if (below(channels[j], channels[i]) || (equal && j < i)) ++ring;
    }
    text +=
        fmt::format("{},{},{}\n", ring, channels[i].elevation_deg, channels[i].azimuth_offset_deg);
  }
  return {text, name};
}

/// Refuses a time between channels if the table has the time of each.
void check_interval(const LidarSettings& settings, const CsvTable& table) {
  const int time = table.find("fire_time_us");
  if (time < 0 || settings.rings.channel_interval_us <= 0.0) return;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (std::isnan(table.at(row, time))) return;
  }
  throw InputError(fmt::format(
      "{}: rings.channel_interval_us: has no effect here: {} has a fire_time_us for each "
      "channel; remove it",
      settings.location("rings.channel_interval_us"),
      settings.rings.table));
}

CsvTable load_table(const LidarSettings& settings) {
  const RingsSettings& s = settings.rings;
  if (s.table.empty()) return table_of(listed_channels(s), s, settings.path);
  const std::string folder = std::filesystem::path(settings.path).parent_path().string();
  CsvTable table =
      settings.at("rings.table", [&] { return CsvTable(find_table("lidars", s.table, folder)); });
  check_interval(settings, table);
  return table;
}

/// Velodyne and Hesai: the head turns clockwise seen from above; a channel fires at its own time
/// within the cycle. Velodyne: at azimuth encoder(time) - rot_correction, geometry of the channels
/// as in the vendor's ROS driver (velodyne_pointcloud, RawData::unpack), with the offsets as the
/// beam's origin. Hesai: at encoder(time) + azimuth offset, as in the vendor's SDK
/// (HesaiLidar_SDK_2.0); that driver's frame has y where ours has x: the way that azimuth 0 looks.
class FiringsPattern : public BeamPattern {
 public:
  explicit FiringsPattern(const LidarSettings& settings)
      : rate_(settings.rate), train_(1e6 / settings.rings.cycle_us, Duration{0}, settings.rate) {
    const CsvTable table = load_table(settings);
    const bool hesai = settings.rings.convention == RingConvention::kHesai;
    // Hesai's driver numbers channels in the order of the table, from 1 there and from 0 in points
    const int channel_number = hesai ? table.find("channel") : -1;
    const int ring = channel_number < 0 ? table.require("ring") : channel_number;
    const int elevation = table.require("elevation_deg");
    const int azimuth = table.require("azimuth_offset_deg");
    const int fire_time = table.find("fire_time_us");
    const int vertical = table.find("vert_offset_mm");
    const int horizontal = table.find("horiz_offset_mm");
    for (std::size_t row = 0; row < table.rows(); ++row) {
      Channel channel{};
      channel.elevation = math::sincos(table.at(row, elevation) * kDegree);
      channel.azimuth = (hesai ? -1.0 : 1.0) * table.at(row, azimuth) * kDegree;
      double time_us = fire_time < 0 ? std::nan("") : table.at(row, fire_time);
      if (std::isnan(time_us)) {
        time_us = settings.rings.channel_interval_us * static_cast<double>(row);
      }
      channel.vertical = vertical < 0 ? 0.0 : table.at(row, vertical) * 1e-3;
      channel.horizontal = horizontal < 0 ? 0.0 : table.at(row, horizontal) * 1e-3;
      const double number = table.at(row, ring) - (channel_number < 0 ? 0.0 : 1.0);
      if (!(number >= 0.0 && number <= 65535.0) || !(std::abs(time_us) < 1e6)) {
        throw InputError(
            fmt::format("{}: row {}: a ring from 0 to 65535 (a channel from 1) and a firing time "
                        "within a second are "
                        "wanted",
                        settings.rings.table,
                        row + 1));
      }
      channel.ring = static_cast<std::uint16_t>(number);
      channel.fire_time = from_seconds(time_us * 1e-6);
      if (!std::isfinite(channel.elevation.sin + channel.azimuth + channel.vertical +
                         channel.horizontal)) {
        throw InputError(fmt::format("{}: row {} lacks a number", settings.rings.table, row + 1));
      }
      channels_.push_back(channel);
    }
    std::stable_sort(channels_.begin(), channels_.end(), [](const Channel& a, const Channel& b) {
      return a.fire_time < b.fire_time;
    });
    for (const Channel& channel : channels_) {
      const double cycles = to_seconds(channel.fire_time) / (settings.rings.cycle_us * 1e-6);
      reach_ = std::max(reach_, static_cast<std::int64_t>(std::ceil(std::abs(cycles))));
    }
  }

  [[nodiscard]] std::vector<Beam> beams(std::uint64_t scan_index,
                                        const Executor& executor) const override {
    // of the cycles that reach over its ends, too
    ShotTrain::Range range = train_.in_scan(scan_index);
    range.begin = std::max<std::int64_t>(0, range.begin - reach_);
    range.end += reach_;
    const auto cycles = static_cast<std::size_t>(range.end - range.begin);
    std::vector<Beam> beams(cycles * channels_.size());
    executor.parallel_for(cycles, 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const SimTime cycle = train_.shots.at(range.begin + static_cast<std::int64_t>(i));
        for (std::size_t c = 0; c < channels_.size(); ++c) {
          const SimTime time = cycle + channels_[c].fire_time;
          beams[i * channels_.size() + c] = fire(channels_[c], time, range.scan_start);
        }
      }
    });
    // each beam belongs to the scan that it fires in
    const Duration period =
        train_.scans.at(static_cast<std::int64_t>(scan_index) + 1) - range.scan_start;
    std::erase_if(beams, [&](const Beam& beam) {
      return beam.time_offset < Duration{0} || beam.time_offset >= period;
    });
    return beams;
  }

 private:
  struct Channel {
    math::SinCos elevation;
    double azimuth;  ///< By which it lags behind the encoder, rad.
    Duration fire_time;
    double vertical;    ///< m
    double horizontal;  ///< m
    std::uint16_t ring;
  };

  [[nodiscard]] Beam fire(const Channel& c, SimTime time, SimTime scan_start) const {
    const double turns = rate_ * to_seconds(time);
    const auto a = math::sincos(2.0 * kPi * (turns - std::floor(turns)) - c.azimuth);
    const Vector3d direction(c.elevation.cos * a.cos, -c.elevation.cos * a.sin, c.elevation.sin);
    const Vector3d origin(-c.vertical * c.elevation.sin * a.cos + c.horizontal * a.sin,
                          c.vertical * c.elevation.sin * a.sin + c.horizontal * a.cos,
                          c.vertical * c.elevation.cos);
    return {origin.cast<float>(), direction.cast<float>(), time - scan_start, c.ring};
  }

  double rate_;
  ShotTrain train_;
  std::vector<Channel> channels_;  ///< In the order of their times.
  std::int64_t reach_ = 0;         ///< Cycles that a channel fires before or after its own.
};

/// Ouster: all rows of a column share one time; geometry of the vendor's SDK ("lidar range to
/// XYZ"), in the sensor frame (half a turn about z from the lidar frame). A scan is one turn. Rings
/// are the rows from the top, as in the vendor's ROS driver (ouster_ros).
class OusterPattern : public BeamPattern {
 public:
  explicit OusterPattern(const LidarSettings& settings) {
    const RingsSettings& s = settings.rings;
    const CsvTable table = load_table(settings);
    const int altitude = table.require("beam_altitude_deg");
    const int azimuth = table.require("beam_azimuth_deg");
    const Schedule columns(settings.rate * static_cast<double>(s.columns));
    for (std::int64_t column = 0; column < s.columns; ++column) {
      const double encoder =
          2.0 * kPi * (1.0 - static_cast<double>(column) / static_cast<double>(s.columns));
      const auto e = math::sincos(encoder);
      for (std::size_t row = 0; row < table.rows(); ++row) {
        const Vector3d lidar = direction_of(encoder - table.at(row, azimuth) * kDegree,
                                            table.at(row, altitude) * kDegree);
        const Vector3d origin(
            -s.beam_origin_radius * e.cos, -s.beam_origin_radius * e.sin, s.origin_z);
        if (!lidar.allFinite()) {
          throw InputError(fmt::format("{}: row {} lacks a number", s.table, row + 1));
        }
        beams_.push_back({origin.cast<float>(),
                          Vector3d(-lidar.x(), -lidar.y(), lidar.z()).cast<float>(),
                          columns.at(column).time_since_epoch(),
                          static_cast<std::uint16_t>(row)});
      }
    }
  }

  [[nodiscard]] bool repeats() const override { return true; }

  [[nodiscard]] std::vector<Beam> beams(std::uint64_t /*scan_index*/,
                                        const Executor& /*executor*/) const override {
    return beams_;
  }

 private:
  std::vector<Beam> beams_;
};

}  // namespace

std::unique_ptr<BeamPattern> make_rings_pattern(const LidarSettings& settings) {
  if (settings.rings.convention == RingConvention::kOuster)
    return std::make_unique<OusterPattern>(settings);
  return std::make_unique<FiringsPattern>(settings);
}

}  // namespace pointflight
