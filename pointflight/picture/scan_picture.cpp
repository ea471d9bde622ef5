#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "pointflight/core/constants.hpp"
#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/plot.hpp"
#include "pointflight/picture/scan_statistics.hpp"

namespace pointflight::picture {
namespace {

constexpr double kRightRoom = 24.0;

struct AngleRange {
  double azimuth_min = 180.0, azimuth_max = -180.0;
  double elevation_min = 90.0, elevation_max = -90.0;

  void add(double azimuth, double elevation) {
    azimuth_min = std::min(azimuth_min, azimuth);
    azimuth_max = std::max(azimuth_max, azimuth);
    elevation_min = std::min(elevation_min, elevation);
    elevation_max = std::max(elevation_max, elevation);
  }
  /// At least a degree each way, so that a single beam has a picture.
  [[nodiscard]] AngleRange with_room() const {
    const auto room = [](double low, double high) {
      return std::max(0.01 * (high - low), 0.5 * (1.0 - (high - low)));
    };
    const double az = room(azimuth_min, azimuth_max);
    const double el = room(elevation_min, elevation_max);
    return {azimuth_min - az, azimuth_max + az, elevation_min - el, elevation_max + el};
  }
  [[nodiscard]] double wide() const { return azimuth_max - azimuth_min; }
  [[nodiscard]] double tall() const { return elevation_max - elevation_min; }
};

/// Left is +azimuth, as the sensor sees it. A degree is as high as wide, but flat fields of view
/// are drawn at least `flattest` high.
Plot angle_plot(
    const AngleRange& range, double left, double top, double wide, double tall, double flattest) {
  const double scale = std::min(wide / range.wide(), tall / range.tall());
  return {left,
          top,
          scale * range.wide(),
          std::max(flattest, scale * range.tall()),
          {range.azimuth_max, range.azimuth_min, "azimuth (deg)", Steps::kAngle},
          {range.elevation_min, range.elevation_max, "elevation (deg)", Steps::kAngle}};
}

std::pair<double, double> angles_deg(const Beam& beam) {
  const Vector3d d = beam.direction_sensor.cast<double>();
  return {std::atan2(d.y(), d.x()) / kDegree, std::asin(std::clamp(d.z(), -1.0, 1.0)) / kDegree};
}

void draw_pattern(Canvas& canvas,
                  const Plot& plot,
                  const std::vector<BeamAngles>& beams,
                  const std::string& caption) {
  constexpr Color kBeam{0.13, 0.32, 0.55};
  canvas.text(plot.left, plot.top - 8.0, caption, kLabelText, kInk);
  canvas.begin_pixels();
  for (const BeamAngles& beam : beams) {
    const auto [x, y] =
        plot.at(static_cast<double>(beam.azimuth_deg), static_cast<double>(beam.elevation_deg));
    canvas.put(static_cast<int>(x), static_cast<int>(y), kBeam, 0.6);
  }
  canvas.end_pixels();
  draw_axes(canvas, plot);
}

/// The ranges that occur, m, but for the hundredth that is nearest or farthest.
std::pair<double, double> colored_ranges(const Scan& scan) {
  if (scan.points.empty()) return {1.0, 10.0};
  std::vector<float> sorted;
  for (const ScanPoint& point : scan.points) sorted.push_back(point.range);
  std::sort(sorted.begin(), sorted.end());
  const std::size_t cut = sorted.size() / 100;
  const double near_range = std::max(0.01, static_cast<double>(sorted[cut]));
  const auto farthest = static_cast<double>(sorted[sorted.size() - 1 - cut]);
  return {near_range, std::max(1.1 * near_range, farthest)};
}

/// Where most of what the sensor sees lies, and itself; world, m.
Aabb seen_box(const Scan& scan, const Pose& T_world_sensor) {
  constexpr double kRoom = 1.0;  // m
  Aabb box;
  box.add(T_world_sensor.translation);
  const double most = 0.8 * colored_ranges(scan).second;
  for (const ScanPoint& point : scan.points) {
    if (static_cast<double>(point.range) > most) continue;
    box.add(T_world_sensor * point.position_sensor.cast<double>());
  }
  box.min -= Vector3d::Constant(kRoom);
  box.max += Vector3d::Constant(kRoom);
  return box;
}

/// The surroundings of the sensor from the south west and above, with the scan's points as the
/// sensor measured them, and the sensor's axes.
void draw_in_place(Canvas& canvas,
                   const Frame& frame,
                   const Scan& scan,
                   const ScanSetting& place,
                   const std::function<Color(double range)>& color_of) {
  constexpr double kAxis = 0.06;  // of the picture's depth
  constexpr std::array<Color, 3> kAxes = {{{0.8, 0.1, 0.1}, {0.1, 0.55, 0.1}, {0.1, 0.25, 0.85}}};
  const Aabb box = seen_box(scan, place.T_world_sensor);
  const double cut = ceiling_cut(MapLayers(place.map));
  const Perspective perspective(place.map, box, cut, frame);
  perspective.paint(canvas, [](double /*z*/) { return Color{0.86, 0.87, 0.89}; });
  canvas.begin_clip(frame.left, frame.top, frame.width, frame.height);
  for (const ScanPoint& point : scan.points) {
    const Vector3d p = place.T_world_sensor * point.position_sensor.cast<double>();
    const auto at = p.z() < cut ? perspective.visible(p) : std::nullopt;
    if (at) canvas.dot(at->first, at->second, 1.3, color_of(static_cast<double>(point.range)));
  }
  canvas.end_clip();
  const Vector3d origin = place.T_world_sensor.translation;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d tip = place.T_world_sensor * (kAxis * box.size().norm() * Vector3d::Unit(axis));
    perspective.draw_path(canvas, {origin, tip}, kAxes[static_cast<std::size_t>(axis)]);
  }
}

}  // namespace

void draw_scan(const std::vector<Beam>& beams,
               const Scan& scan,
               const LidarSettings& lidar,
               const ScanSetting& place,
               const std::string& path) {
  constexpr double kHeader = 72.0;
  AngleRange range;
  for (const Beam& beam : beams) {
    const auto [azimuth, elevation] = angles_deg(beam);
    range.add(azimuth, elevation);
  }
  range = range.with_room();
  const Plot plot = angle_plot(range, kLeftRoom + 6.0, kHeader, 1080.0, 720.0, 260.0);
  constexpr double kCaption = 24.0;  // over the perspective
  const double width = std::max(460.0, plot.width);
  const Frame view{plot.left,
                   plot.bottom() + kBottomRoom + kCaption,
                   width + kBarRoom,
                   std::round(0.55 * (width + kBarRoom))};
  Canvas canvas(static_cast<int>(view.left + view.width + 14.0),
                static_cast<int>(view.top + view.height + 12.0),
                kPaper);
  canvas.box(plot.left, plot.top, plot.width, plot.height, kNight);
  const double area =
      plot.width * plot.height / static_cast<double>(std::max<std::size_t>(1, beams.size()));
  const double size = std::clamp(0.6 * std::sqrt(area), 0.8, 4.0);

  const auto ranges = colored_ranges(scan);
  const double near_range = ranges.first;
  // logarithmic: near things matter more
  const double span = std::log(ranges.second / near_range);
  const auto color_at = [](double share) { return ramp(1.0 - share); };
  const auto color_of = [&](double range) { return color_at(std::log(range / near_range) / span); };
  const auto mark = [&](const ScanPoint& point, const auto& draw) {
    const auto [azimuth, elevation] = angles_deg(beams[point.beam]);
    const auto [x, y] = plot.at(azimuth, elevation);
    draw(x, y, color_of(static_cast<double>(point.range)));
  };
  if (size < 1.6) {  // whole pixels: sharper, and a smaller file
    const int side = static_cast<int>(std::ceil(2.0 * size + 0.75));  // no gaps between rows
    canvas.begin_pixels();
    for (const ScanPoint& point : scan.points) {
      mark(point, [&](double x, double y, Color color) {
        for (int i = 0; i < side * side; ++i) {
          canvas.put(std::min(static_cast<int>(x) + i % side, static_cast<int>(plot.right()) - 1),
                     std::min(static_cast<int>(y) + i / side, static_cast<int>(plot.bottom()) - 1),
                     color,
                     1.0);
        }
      });
    }
    canvas.end_pixels();
  } else {
    canvas.begin_clip(plot.left, plot.top, plot.width, plot.height);
    for (const ScanPoint& point : scan.points) {
      mark(point, [&](double x, double y, Color color) { canvas.dot(x, y, size, color); });
    }
    canvas.end_clip();
  }
  draw_axes(canvas, plot);
  draw_color_bar(canvas,
                 {near_range, ranges.second, "range (m)", color_at, true},
                 plot.right() + 14.0,
                 plot.top,
                 std::min(plot.height, 420.0));
  canvas.text_within(plot.left, 30.0, lidar.title, kTitleText, width, kInk);
  canvas.text_within(
      plot.left,
      54.0,
      fmt::format("{} of {} beams returned; dark: no return", scan.points.size(), beams.size()),
      kLabelText,
      width,
      kInk);
  draw_in_place(canvas, view, scan, place, color_of);
  const Vector3d& p = place.T_world_sensor.translation;
  canvas.text_within(
      view.left,
      view.top - 7.0,
      fmt::format(
          "its points in the map, from the south west (-x, -y); the sensor, with its axes x "
          "red, y green, z blue, is at ({:.4g}, {:.4g}, {:.4g}) m",
          p.x(),
          p.y(),
          p.z()),
      kTickText,
      view.width,
      kDim);
  canvas.save(path);
}

void draw_lidar(const LidarSettings& lidar, const std::string& path) {
  lidar_page(lidar)->save(path);
}

std::unique_ptr<Canvas> lidar_page(const LidarSettings& lidar) {
  constexpr double kHeader = 66.0;
  constexpr double kGap = 76.0;
  constexpr double kCurve = 180.0;  // height of the last panel
  constexpr double kShort = 0.1;    // s
  constexpr double kLong = 1.0;
  const auto pattern = pattern_of(lidar, kLong);
  AngleRange range;
  for (const BeamAngles& beam : pattern) {
    range.add(static_cast<double>(beam.azimuth_deg), static_cast<double>(beam.elevation_deg));
  }
  range = range.with_room();
  // wide fields of view one below the other, others side by side
  const bool stacked = range.wide() > 2.0 * range.tall();
  const double left = kLeftRoom + 6.0;
  const Plot first = stacked ? angle_plot(range, left, kHeader, 1000.0, 420.0, 200.0)
                             : angle_plot(range, left, kHeader, 460.0, 520.0, 200.0);
  Plot second = first;
  (stacked ? second.top : second.left) +=
      stacked ? first.height + kGap : first.width + kLeftRoom + 40.0;
  const Plot curve{left,
                   second.bottom() + kGap,
                   second.right() - left,
                   kCurve,
                   {0.0, kLong, "time (s)", Steps::kDecimal},
                   {0.0, 100.0, "covered (%)", Steps::kDecimal}};
  auto canvas =
      std::make_unique<Canvas>(static_cast<int>(std::max(curve.right(), left + 460.0) + kRightRoom),
                               static_cast<int>(curve.bottom() + kBottomRoom + 12.0),
                               kPaper);
  canvas->text_within(left,
                      28.0,
                      lidar.title.empty() ? lidar.path : lidar.title,
                      kTitleText,
                      canvas->width() - left - 12.0,
                      kInk);
  draw_pattern(*canvas, first, pattern_of(lidar, kShort), fmt::format("after {} s", kShort));
  draw_pattern(*canvas, second, pattern, fmt::format("after {:.0f} s", kLong));
  const Coverage coverage = coverage_of(lidar, kLong);
  std::vector<std::pair<double, double>> line;
  for (std::size_t i = 0; i < coverage.time.size(); ++i) {
    line.push_back(curve.at(coverage.time[i], 100.0 * coverage.fraction[i]));
  }
  canvas->line(line, 2.0, {0.84, 0.37, 0.0});
  draw_axes(*canvas, curve);
  canvas->text_within(
      curve.left,
      curve.top - 8.0,
      fmt::format("share of the field of view that was hit, in cells of {} deg", coverage.cell_deg),
      kLabelText,
      canvas->width() - left - 12.0,
      kInk);
  return canvas;
}

}  // namespace pointflight::picture
