#include "apps/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "apps/canvas.hpp"
#include "pointflight/core/constants.hpp"

namespace pointflight::apps {
namespace {

constexpr Color kPath{0.85, 0.1, 0.15};
constexpr Color kSeen{0.1, 0.45, 0.85};

/// An orthographic view: world x to the right, and y (top view) or z (side view) up.
struct View {
  int vertical_axis;  ///< 1: top view; 2: side view.
  double scale;       ///< Pixels a metre.
  double left, bottom;
  Vector3d low;

  [[nodiscard]] std::pair<double, double> at(const Vector3d& p) const {
    return {left + scale * (p.x() - low.x()),
            bottom - scale * (p[vertical_axis] - low[vertical_axis])};
  }
};

/// A page with a top view above a side view at one scale.
struct Page {
  int width, height;
  View top, side;
  double z_low, z_high;  ///< Of the colour scale.
};

/// Heights between which nearly all surfels lie: stray points must not use up the colours.
std::pair<double, double> height_range(const SurfelMap& map) {
  std::vector<float> heights;
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    if (word % 7 == 0) heights.push_back(static_cast<float>(p.z()));
  });
  if (heights.empty()) return {0.0, 1.0};
  std::sort(heights.begin(), heights.end());
  const std::size_t cut = heights.size() / 100;
  return {static_cast<double>(heights[cut]),
          static_cast<double>(heights[heights.size() - 1 - cut]) + 1e-3};
}

Page lay_out(const SurfelMap& map, double header) {
  constexpr double kMargin = 46.0;
  constexpr double kGap = 44.0;
  constexpr double kWide = 1100.0;  // most room for the views, pixels
  constexpr double kTall = 1100.0;
  const Aabb& bounds = map.bounds_world();
  const Vector3d size = bounds.empty() ? Vector3d(1, 1, 1) : bounds.size().cwiseMax(0.5);
  const double scale = std::min(kWide / size.x(), kTall / (size.y() + size.z()));
  Page page{};
  page.width = static_cast<int>(std::max(620.0, scale * size.x() + 2.0 * kMargin));
  const double top_height = scale * size.y();
  const double side_height = scale * size.z();
  page.height = static_cast<int>(header + top_height + kGap + side_height + kMargin);
  const Vector3d low = bounds.empty() ? Vector3d(0, 0, 0) : bounds.min;
  page.top = {1, scale, kMargin, header + top_height, low};
  page.side = {2, scale, kMargin, header + top_height + kGap + side_height, low};
  std::tie(page.z_low, page.z_high) = height_range(map);
  return page;
}

/// The map's surfels: height as colour or as pale grey; high ones over low ones in the top view.
void draw_surfels(Canvas& canvas, const SurfelMap& map, const Page& page, bool pale) {
  std::vector<Vector3d> centers;
  centers.reserve(map.surfel_count());
  map.for_each_surfel(
      [&](const Vector3d& p, const Vector3d&, double, std::uint32_t) { centers.push_back(p); });
  std::sort(centers.begin(), centers.end(), [](const Vector3d& a, const Vector3d& b) {
    return a.z() < b.z();
  });
  const int thick = std::max(1, static_cast<int>(std::lround(map.resolution() * page.top.scale)));
  canvas.begin_pixels();
  for (const View* view : {&page.top, &page.side}) {
    for (const Vector3d& p : centers) {
      const double share = (p.z() - page.z_low) / (page.z_high - page.z_low);
      const double grey = 0.78 - 0.38 * std::clamp(share, 0.0, 1.0);
      const Color c = pale ? Color{grey, grey, grey} : ramp(share);
      const auto [x, y] = view->at(p);
      for (int i = 0; i < thick; ++i) {
        for (int j = 0; j < thick; ++j) {
          canvas.put(static_cast<int>(x) + i, static_cast<int>(y) - j, c, pale ? 0.5 : 0.7);
        }
      }
    }
  }
  canvas.end_pixels();
}

/// A bar of a round number of metres.
void draw_scale_bar(Canvas& canvas, const View& view, double x, double y) {
  double metres = 1.0;
  for (const double step : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0}) {
    if (step * view.scale < 160.0) metres = step;
  }
  canvas.line({{x, y}, {x + metres * view.scale, y}}, 2.0, kInk);
  canvas.text(x + metres * view.scale + 6.0, y + 4.0, fmt::format("{:.0f} m", metres), 12.0, kInk);
}

void draw_captions(Canvas& canvas, const Page& page, double header) {
  canvas.text(page.top.left, header - 8.0, "from above (x right, y up)", 12.0, kDim);
  canvas.text(page.side.left, page.side.bottom + 18.0, "from the side (x right, z up)", 12.0, kDim);
  draw_scale_bar(canvas, page.top, page.width - 230.0, header - 12.0);
}

}  // namespace

void draw_map(const SurfelMap& map, const std::string& title, const std::string& path) {
  constexpr double kHeader = 92.0;
  const Page page = lay_out(map, kHeader);
  Canvas canvas(page.width, page.height, kPaper);
  canvas.text(page.top.left, 30.0, title, 19.0, kInk);
  const Vector3d size = map.bounds_world().size();
  canvas.text(
      page.top.left,
      52.0,
      fmt::format("{} surfels at {} m, {:.1f} x {:.1f} x {:.1f} m; height {:.1f} to {:.1f} m",
                  map.surfel_count(),
                  map.resolution(),
                  size.x(),
                  size.y(),
                  size.z(),
                  page.z_low,
                  page.z_high),
      13.0,
      kInk);
  for (int i = 0; i < 120; ++i) {
    canvas.box(page.width - 170.0 + i, 22.0, 1.5, 10.0, ramp(i / 119.0));
  }
  draw_surfels(canvas, map, page, false);
  draw_captions(canvas, page, kHeader);
  canvas.save(path);
}

void draw_scan(const std::vector<Beam>& beams,
               const Scan& scan,
               const LidarSettings& lidar,
               const std::string& path) {
  constexpr double kMargin = 54.0;
  constexpr double kHeader = 62.0;
  double az_low = kPi;
  double az_high = -kPi;
  double el_low = kPi;
  double el_high = -kPi;
  const auto angles = [](const Beam& beam) {
    const Vector3d d = beam.direction_sensor.cast<double>();
    return std::pair(std::atan2(d.y(), d.x()), std::asin(std::clamp(d.z(), -1.0, 1.0)));
  };
  for (const Beam& beam : beams) {
    const auto [az, el] = angles(beam);
    az_low = std::min(az_low, az);
    az_high = std::max(az_high, az);
    el_low = std::min(el_low, el);
    el_high = std::max(el_high, el);
  }
  const double wide = std::max(0.01, az_high - az_low);
  const double tall = std::max(0.01, el_high - el_low);
  const double scale = std::min(1200.0 / wide, 800.0 / tall);
  Canvas canvas(static_cast<int>(std::max(560.0, wide * scale + 2.0 * kMargin)),
                static_cast<int>(tall * scale + kHeader + kMargin),
                kPaper);
  canvas.box(kMargin, kHeader, wide * scale, tall * scale, kNight);
  const double size = std::clamp(
      0.6 * scale *
          std::sqrt(wide * tall / static_cast<double>(std::max<std::size_t>(1, beams.size()))),
      1.0,
      4.0);

  // colours over the ranges that occur, logarithmic: near things matter more
  std::vector<float> sorted;
  for (const ScanPoint& point : scan.points) sorted.push_back(point.range);
  std::sort(sorted.begin(), sorted.end());
  const double near_range = sorted.empty() ? 1.0 : static_cast<double>(sorted[sorted.size() / 50]);
  const double far_range =
      sorted.empty() ? 10.0 : static_cast<double>(sorted[sorted.size() - 1 - sorted.size() / 50]);
  const double span = std::log(std::max(far_range / near_range, 1.01));
  for (const ScanPoint& point : scan.points) {
    const auto [az, el] = angles(beams[point.beam]);
    const double share = std::log(static_cast<double>(point.range) / near_range) / span;
    canvas.dot(kMargin + (az_high - az) * scale,
               kHeader + (el_high - el) * scale,
               size,
               ramp(1.0 - share));
  }
  canvas.text(
      kMargin,
      28.0,
      fmt::format("{}: {} of {} beams returned", lidar.title, scan.points.size(), beams.size()),
      16.0,
      kInk);
  canvas.text(
      kMargin,
      48.0,
      fmt::format("range {:.2f} m (bright) to {:.2f} m (dark), logarithmic; left is +azimuth",
                  near_range,
                  far_range),
      12.0,
      kDim);
  for (int i = 0; i <= 4; ++i) {
    const double az = az_high - wide * i / 4.0;
    const double el = el_high - tall * i / 4.0;
    canvas.text(kMargin + (az_high - az) * scale - 12.0,
                kHeader + tall * scale + 18.0,
                fmt::format("{:.0f}°", az / kDegree),
                11.0,
                kInk);
    canvas.text(6.0,
                kHeader + (el_high - el) * scale + 4.0,
                fmt::format("{:.1f}°", el / kDegree),
                11.0,
                kInk);
  }
  canvas.text(kMargin + wide * scale / 2 - 60.0,
              kHeader + tall * scale + 36.0,
              "azimuth; elevation upwards",
              11.0,
              kDim);
  canvas.save(path);
}

void OverviewSink::on_state(const StateSample& sample) {
  constexpr double kApart = 0.05;  // m
  const Vector3d& p = sample.state.body.p_world;
  if (path_.empty() || (path_.back() - p).norm() > kApart) path_.push_back(p);
}

void OverviewSink::on_scan(const Scan& scan, const PoseAt& pose_at) {
  constexpr std::size_t kPointsMax = 400000;
  const std::size_t stride = points_.size() < kPointsMax / 2 ? 40 : 200;
  if (points_.size() >= kPointsMax) return;
  for (std::size_t i = scan.index % stride; i < scan.points.size(); i += stride) {
    const ScanPoint& point = scan.points[i];
    points_.push_back(pose_at(scan.start + point.time_offset) *
                      point.position_sensor.cast<double>());
  }
}

void OverviewSink::on_collision(const CollisionEvent& event) {
  if (event.entered) collisions_.push_back(event.place_world);
}

void draw_overview(const SurfelMap& map,
                   const Simulation& simulation,
                   const OverviewSink& run,
                   const std::string& path) {
  constexpr double kHeader = 112.0;
  const Page page = lay_out(map, kHeader);
  Canvas canvas(page.width, page.height, kPaper);
  draw_surfels(canvas, map, page, true);
  const RunSummary& s = simulation.summary();
  for (const View* view : {&page.top, &page.side}) {
    canvas.begin_pixels();
    for (const Vector3d& p : run.points()) {
      const auto [x, y] = view->at(p);
      canvas.put(static_cast<int>(x), static_cast<int>(y), kSeen, 0.5);
    }
    canvas.end_pixels();
    std::vector<std::pair<double, double>> line;
    for (const Vector3d& p : run.path()) line.push_back(view->at(p));
    canvas.line(line, 4.5, kPaper);
    canvas.line(line, 2.5, kPath);
    for (const Vector3d& p : simulation.scenario().mission.waypoints) {
      const auto [x, y] = view->at(p);
      canvas.ring(x, y, 5.0, 1.5, kInk);
    }
    if (!run.path().empty()) {
      const auto [x, y] = view->at(run.path().front());
      canvas.dot(x, y, 6.0, kInk);
    }
    for (const Vector3d& p : run.collisions()) {
      const auto [x, y] = view->at(p);
      canvas.line({{x - 7, y - 7}, {x + 7, y + 7}}, 3.0, kPath);
      canvas.line({{x - 7, y + 7}, {x + 7, y - 7}}, 3.0, kPath);
    }
  }
  canvas.text(
      page.top.left,
      30.0,
      fmt::format(
          "{:.1f} m flown in {:.1f} s, {}", s.distance_flown, to_seconds(s.time), to_string(s.end)),
      19.0,
      kInk);
  canvas.text(page.top.left,
              52.0,
              fmt::format("{} scans, {:.2f} M points; closest approach {}; {} collision{}",
                          s.scans,
                          static_cast<double>(s.points) * 1e-6,
                          s.closest_approach ? fmt::format("{:.2f} m", *s.closest_approach)
                                             : std::string("over 10 m"),
                          s.collisions,
                          s.collisions == 1 ? "" : "s"),
              13.0,
              kInk);
  const double y = 72.0;
  canvas.line({{page.top.left, y}, {page.top.left + 26, y}}, 2.5, kPath);
  canvas.text(page.top.left + 32, y + 4, "flown path", 12.0, kInk);
  canvas.dot(page.top.left + 122, y, 5.0, kInk);
  canvas.text(page.top.left + 132, y + 4, "start", 12.0, kInk);
  canvas.ring(page.top.left + 182, y, 5.0, 1.5, kInk);
  canvas.text(page.top.left + 192, y + 4, "waypoint", 12.0, kInk);
  canvas.dot(page.top.left + 272, y, 3.0, kSeen);
  canvas.text(page.top.left + 282, y + 4, "measured points", 12.0, kInk);
  canvas.box(page.top.left + 394, y - 5, 10, 10, {0.65, 0.65, 0.65});
  canvas.text(page.top.left + 410, y + 4, "map (higher is darker)", 12.0, kInk);
  draw_captions(canvas, page, kHeader);
  canvas.save(path);
}

}  // namespace pointflight::apps
