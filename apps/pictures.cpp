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

void RunPicture::add_path_point(std::size_t vehicle, const Vector3d& p) {
  constexpr double kApart = 0.05;  // m
  if (paths.size() <= vehicle) paths.resize(vehicle + 1);
  auto& path = paths[vehicle];
  if (path.empty() || (path.back() - p).norm() > kApart) path.push_back(p);
}

void RunPicture::add_seen(const Vector3d& p) {
  // ever fewer, so that a long run and many vehicles fit
  const std::size_t stride = 40 * (1 + seen.size() / 100000);
  if (seen_offered_++ % stride == 0) seen.push_back(p);
}

void RunPicture::add_obstacle(std::uint32_t label, const Vector3d& p, double radius) {
  constexpr double kJump = 2.0;  // m between two samples: another one took its place
  auto trace = std::find_if(
      traces.rbegin(), traces.rend(), [&](const Trace& t) { return t.label == label; });
  if (trace == traces.rend() || (trace->points.back() - p).norm() > kJump) {
    traces.push_back({label, radius, {p}});
    return;
  }
  trace->points.push_back(p);
}

void RunPicture::on_state(const StateSample& sample) {
  add_path_point(sample.vehicle, sample.state.body.p_world);
}

void RunPicture::on_scan(const Scan& scan, const PoseAt& pose_at) {
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& point = scan.points[i];
    const bool moving = point.label != kMapLabel;
    if (!moving && i % 40 != scan.index % 40) {
      ++seen_offered_;
      continue;
    }
    const Vector3d p = pose_at(scan.seen_at(point)) * point.position_sensor.cast<double>();
    if (moving) {
      if (seen_moving.size() < 400000 && i % 4 == 0) seen_moving.push_back(p);
    } else {
      seen_offered_ -= seen_offered_ % 40;
      add_seen(p);
    }
  }
}

void RunPicture::on_collision(const CollisionEvent& event) {
  if (event.entered) collisions.push_back(event.place_world);
}

void RunPicture::on_obstacle(const ObstacleSample& sample) {
  add_obstacle(sample.label,
               sample.T_world_body.translation,
               std::max(sample.half_extent.x(), sample.half_extent.y()));
}

void describe_run(const Simulation& simulation, RunPicture& picture) {
  double flown = 0.0;
  double closest = Simulation::kClearanceReach;
  std::uint64_t scans = 0;
  std::uint64_t points = 0;
  std::uint64_t collisions = 0;
  picture.waypoints.clear();
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleSummary& s = simulation.summary(v);
    flown += s.distance_flown;
    scans += s.scans;
    points += s.points;
    collisions += s.collisions;
    closest = std::min(closest, s.closest_approach.value_or(closest));
    picture.waypoints.push_back(simulation.vehicle(v).setup().mission.waypoints);
  }
  const std::size_t count = simulation.vehicle_count();
  picture.title = fmt::format("{}{:.1f} m flown in {:.1f} s, {}",
                              count > 1 ? fmt::format("{} vehicles, ", count) : std::string(),
                              flown,
                              to_seconds(simulation.time()),
                              to_string(simulation.end()));
  picture.subtitle =
      fmt::format("{} scans, {:.2f} M points; closest approach {}; {} collision{}",
                  scans,
                  static_cast<double>(points) * 1e-6,
                  closest < Simulation::kClearanceReach ? fmt::format("{:.2f} m", closest)
                                                        : std::string("over 10 m"),
                  collisions,
                  collisions == 1 ? "" : "s");
}

namespace {

/// Colours of the vehicles' paths, in turn: told apart by those who see no red or green (Okabe, Ito
/// 2008).
constexpr Color kPaths[] = {
    {0.84, 0.37, 0.0}, {0.0, 0.45, 0.70}, {0.80, 0.47, 0.65}, {0.0, 0.62, 0.45}, {0.90, 0.62, 0.0}};
constexpr Color kMoving{0.45, 0.2, 0.6};

void draw_traces(Canvas& canvas, const View& view, const RunPicture& run) {
  for (const RunPicture::Trace& trace : run.traces) {
    std::vector<std::pair<double, double>> line;
    for (const Vector3d& p : trace.points) line.push_back(view.at(p));
    canvas.line(line, 1.2, kMoving);
    const auto [x, y] = line.back();
    const double radius = std::max(2.0, trace.radius * view.scale);
    canvas.dot(x, y, radius, kMoving, 0.35);
    canvas.ring(x, y, radius, 1.0, kMoving);
  }
}

void draw_run(Canvas& canvas, const View& view, const RunPicture& run) {
  canvas.begin_pixels();
  const auto put = [&](const Vector3d& p, Color color) {
    const auto [x, y] = view.at(p);
    canvas.put(static_cast<int>(x), static_cast<int>(y), color, 0.5);
  };
  for (const Vector3d& p : run.seen) put(p, kSeen);
  for (const Vector3d& p : run.seen_moving) put(p, kMoving);
  canvas.end_pixels();
  draw_traces(canvas, view, run);
  for (std::size_t v = 0; v < run.paths.size(); ++v) {
    std::vector<std::pair<double, double>> line;
    for (const Vector3d& p : run.paths[v]) line.push_back(view.at(p));
    if (line.empty()) continue;
    canvas.line(line, 4.5, kPaper);
    canvas.line(line, 2.5, kPaths[v % std::size(kPaths)]);
    canvas.dot(line.front().first, line.front().second, 6.0, kInk);
  }
  for (const auto& waypoints : run.waypoints) {
    for (const Vector3d& p : waypoints) {
      const auto [x, y] = view.at(p);
      canvas.ring(x, y, 5.0, 1.5, kInk);
    }
  }
  for (const Vector3d& p : run.collisions) {
    const auto [x, y] = view.at(p);
    canvas.line({{x - 7, y - 7}, {x + 7, y + 7}}, 3.0, kPath);
    canvas.line({{x - 7, y + 7}, {x + 7, y - 7}}, 3.0, kPath);
  }
}

/// What the marks mean, those that are there.
void draw_legend(Canvas& canvas, const RunPicture& run, double left, double y) {
  double x = left;
  const auto entry = [&](double width, const char* words, const auto& mark) {
    mark(x);
    canvas.text(x + width, y + 4, words, 12.0, kInk);
    x += width + 7.0 * static_cast<double>(std::string(words).size()) + 12.0;
  };
  entry(32, run.paths.size() > 1 ? "flown paths" : "flown path", [&](double at) {
    canvas.line({{at, y}, {at + 26, y}}, 2.5, kPaths[0]);
  });
  entry(12, "start", [&](double at) { canvas.dot(at + 3, y, 5.0, kInk); });
  entry(14, "waypoint", [&](double at) { canvas.ring(at + 4, y, 5.0, 1.5, kInk); });
  entry(10, "measured", [&](double at) { canvas.dot(at + 3, y, 3.0, kSeen); });
  if (!run.traces.empty()) {
    entry(34, "obstacle, last seen at the ball", [&](double at) {
      canvas.line({{at, y}, {at + 20, y}}, 1.2, kMoving);
      canvas.ring(at + 24, y, 5.0, 1.0, kMoving);
    });
  }
  if (!run.collisions.empty()) {
    entry(16, "collision", [&](double at) {
      canvas.line({{at, y - 5}, {at + 10, y + 5}}, 3.0, kPath);
      canvas.line({{at, y + 5}, {at + 10, y - 5}}, 3.0, kPath);
    });
  }
  entry(16, "map (higher is darker)", [&](double at) {
    canvas.box(at, y - 5, 10, 10, {0.65, 0.65, 0.65});
  });
}

}  // namespace

void draw_overview(const SurfelMap& map, const RunPicture& run, const std::string& path) {
  constexpr double kHeader = 112.0;
  const Page page = lay_out(map, kHeader);
  Canvas canvas(page.width, page.height, kPaper);
  draw_surfels(canvas, map, page, true);
  for (const View* view : {&page.top, &page.side}) draw_run(canvas, *view, run);
  canvas.text(page.top.left, 30.0, run.title, 19.0, kInk);
  canvas.text(page.top.left, 52.0, run.subtitle, 13.0, kInk);
  draw_legend(canvas, run, page.top.left, 72.0);
  draw_captions(canvas, page, kHeader);
  canvas.save(path);
}

}  // namespace pointflight::apps
