#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/map_views.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::picture {
namespace {

constexpr Color kCollision{0.8, 0.0, 0.1};
constexpr Color kSeen{0.25, 0.55, 0.95};
constexpr Color kMoving{0.45, 0.2, 0.6};
constexpr Color kNearFloor{0.93, 0.93, 0.93};
constexpr Color kHighUp{0.45, 0.45, 0.47};
constexpr double kAboveFlight =
    1.0;  // m over the highest position of the flight that is still shown

/// What must be in the picture of a run.
Aabb flight_box(const RunPicture& run) {
  Aabb box;
  for (const Track& path : run.paths) {
    for (const Vector3d& p : path.points()) box.add(p);
  }
  for (const auto& waypoints : run.waypoints) {
    for (const Vector3d& p : waypoints) box.add(p);
  }
  for (const Vector3d& p : run.collisions.items()) box.add(p);
  return box;
}

/// The map with all of the flight; of a map much larger than the flight the part around it.
Aabb shown_box(const MapLayers& layers, const Aabb& flight) {
  constexpr double kAround = 10.0;  // m
  constexpr double kMuch = 2.5;
  Aabb bounds = layers.box();
  if (flight.empty()) return with_room(bounds);
  Aabb near = flight;
  const double around = std::max(kAround, 0.3 * flight.size().maxCoeff());
  near.min -= Vector3d(around, around, 0.0);
  near.max += Vector3d(around, around, 0.0);
  if (!bounds.empty()) {
    const bool far_larger =
        bounds.size().x() > kMuch * near.size().x() || bounds.size().y() > kMuch * near.size().y();
    for (int axis = 0; axis < (far_larger ? 2 : 0); ++axis) {
      bounds.min[axis] = std::max(bounds.min[axis], near.min[axis]);
      bounds.max[axis] = std::min(bounds.max[axis], near.max[axis]);
    }
  }
  bounds.add(flight.min);
  bounds.add(flight.max);
  return with_room(bounds);
}

/// How many measured points fell on each pixel.
template <class Use>
Raster count_seen(const std::vector<Vector3d>& seen,
                  const Plot& plot,
                  bool from_above,
                  const Use& use) {
  Raster counts(static_cast<int>(plot.width), static_cast<int>(plot.height), 0.0f);
  for (const Vector3d& p : seen) {
    if (!use(p)) continue;
    splat(counts, plot, plot.at(p.x(), from_above ? p.y() : p.z()), 2, [](float& n) { n += 1.0f; });
  }
  return counts;
}

/// A tint that leaves what is below to be seen.
void tint(Canvas& canvas, const Plot& plot, Raster counts, Color color, double most) {
  canvas.begin_pixels();
  for (int y = 0; y < counts.height; ++y) {
    for (int x = 0; x < counts.width; ++x) {
      const float n = *counts.at(x, y);
      if (n <= 0.0f) continue;
      canvas.put(static_cast<int>(plot.left) + x,
                 static_cast<int>(plot.top) + y,
                 color,
                 most * (1.0 - std::exp(-static_cast<double>(n))));
    }
  }
  canvas.end_pixels();
}

/// Marks of a run in one view, one kind of each for the legend as well.
void mark_start(Canvas& canvas, double x, double y, Color color) {
  canvas.dot(x, y, 6.5, kPaper);
  canvas.dot(x, y, 5.0, color);
  canvas.ring(x, y, 6.0, 1.5, kInk);
}
void mark_end(Canvas& canvas, double x, double y, Color color) {
  canvas.box(x - 5.5, y - 5.5, 11.0, 11.0, kPaper);
  canvas.box(x - 4.0, y - 4.0, 8.0, 8.0, color);
  canvas.outline(x - 5.0, y - 5.0, 10.0, 10.0, 1.5, kInk);
}
void mark_waypoint(Canvas& canvas, double x, double y, Color color) {
  canvas.ring(x, y, 5.5, 3.5, kPaper);
  canvas.ring(x, y, 5.5, 1.8, color);
}
void mark_collision(Canvas& canvas, double x, double y) {
  for (const double width : {5.0, 2.5}) {
    const Color c = width > 3.0 ? kPaper : kCollision;
    canvas.line({{x - 6, y - 6}, {x + 6, y + 6}}, width, c);
    canvas.line({{x - 6, y + 6}, {x + 6, y - 6}}, width, c);
  }
}

template <class At>
void draw_traces(Canvas& canvas, const RunPicture& run, double scale, const At& at) {
  constexpr std::size_t kMany = 200;  // whose ways would bury everything else
  const bool many = run.traces.size() > kMany;
  for (const RunPicture::Trace& trace : run.traces) {
    const auto [x, y] = at(trace.track.last());
    if (many) {
      canvas.dot(x, y, std::max(1.0, trace.radius * scale), kMoving, 0.35);
      continue;
    }
    std::vector<std::pair<double, double>> line;
    for (const Vector3d& p : trace.track.points()) line.push_back(at(p));
    canvas.line(line, 1.2, kMoving, 0.8);
    const double radius = std::max(2.0, trace.radius * scale);
    canvas.dot(x, y, radius, kMoving, 0.35);
    canvas.ring(x, y, radius, 1.0, kMoving);
  }
}

template <class At>
void draw_flight(Canvas& canvas, const RunPicture& run, const At& at) {
  for (std::size_t v = 0; v < run.paths.size(); ++v) {
    std::vector<std::pair<double, double>> line;
    for (const Vector3d& p : run.paths[v].points()) line.push_back(at(p));
    canvas.line(line, 4.5, kPaper, 0.8);
    canvas.line(line, 2.2, vehicle_color(v));
  }
  for (std::size_t v = 0; v < run.waypoints.size(); ++v) {
    for (const Vector3d& p : run.waypoints[v]) {
      const auto [x, y] = at(p);
      mark_waypoint(canvas, x, y, vehicle_color(v));
    }
  }
  for (std::size_t v = 0; v < run.paths.size(); ++v) {
    if (run.paths[v].empty()) continue;
    const auto [x0, y0] = at(run.paths[v].first());
    mark_start(canvas, x0, y0, vehicle_color(v));
    const auto [x1, y1] = at(run.paths[v].last());
    mark_end(canvas, x1, y1, vehicle_color(v));
  }
  for (const Vector3d& p : run.collisions.items()) {
    const auto [x, y] = at(p);
    mark_collision(canvas, x, y);
  }
}

/// What the marks mean, those that are there.
std::vector<LegendEntry> legend_of(const RunPicture& run) {
  constexpr std::size_t kNamed = 24;
  std::vector<LegendEntry> entries;
  const auto path_mark = [](Color color) {
    return [color](Canvas& c, double x, double y) { c.line({{x, y}, {x + 22.0, y}}, 2.5, color); };
  };
  const std::size_t count = run.paths.size();
  for (std::size_t v = 0; v < std::min(count, kNamed); ++v) {
    const std::string name = v < run.names.size() ? run.names[v] : fmt::format("drone{}", v);
    entries.push_back({name, 22.0, path_mark(vehicle_color(v))});
  }
  if (count > kNamed) {
    entries.push_back(
        {fmt::format("and {} more", count - kNamed), 0.0, [](Canvas&, double, double) {}});
  }
  entries.push_back(
      {"start", 12.0, [](Canvas& c, double x, double y) { mark_start(c, x + 6.0, y, kDim); }});
  entries.push_back(
      {"end", 12.0, [](Canvas& c, double x, double y) { mark_end(c, x + 6.0, y, kDim); }});
  if (std::any_of(
          run.waypoints.begin(), run.waypoints.end(), [](const auto& w) { return !w.empty(); })) {
    entries.push_back({"waypoint", 12.0, [](Canvas& c, double x, double y) {
                         mark_waypoint(c, x + 6.0, y, kInk);
                       }});
  }
  if (!run.collisions.items().empty()) {
    entries.push_back(
        {"collision", 12.0, [](Canvas& c, double x, double y) { mark_collision(c, x + 6.0, y); }});
  }
  if (!run.traces.empty()) {
    entries.push_back({"obstacle, where it was last", 26.0, [](Canvas& c, double x, double y) {
                         c.line({{x, y}, {x + 16.0, y}}, 1.2, kMoving);
                         c.dot(x + 20.0, y, 5.0, kMoving, 0.35);
                         c.ring(x + 20.0, y, 5.0, 1.0, kMoving);
                       }});
  }
  if (!run.seen.items().empty()) {
    entries.push_back({"measured", 12.0, [](Canvas& c, double x, double y) {
                         c.box(x, y - 5.0, 11.0, 11.0, mixed(kHighUp, kSeen, 0.6));
                       }});
  }
  if (!run.seen_moving.items().empty()) {
    entries.push_back({"measured, moving", 12.0, [](Canvas& c, double x, double y) {
                         c.box(x, y - 5.0, 11.0, 11.0, mixed(kPaper, kMoving, 0.5));
                       }});
  }
  return entries;
}

/// What the top view shows of the map: from the floor to somewhat above the flight, without
/// ceiling.
class Slab {
 public:
  Slab(const MapLayers& layers, const Aabb& flight)
      : layers_(layers),
        cut_(flight.empty() ? layers.box().max.z() : flight.max.z() + kAboveFlight),
        thick_(std::max(1.0, std::min(cut_, layers.box().max.z()) - layers.box().min.z())) {}

  [[nodiscard]] bool holds(const Vector3d& p) const {
    return p.z() <= cut_ && !layers_.is_ceiling(p);
  }
  /// The floor is measured everywhere: from above it would hide what stands on it.
  [[nodiscard]] bool holds_above_floor(const Vector3d& p) const {
    constexpr double kFloor = 0.3;  // m
    return holds(p) && p.z() > layers_.floor_at(p) + kFloor;
  }
  /// The floor itself is pale; few greys, for relief is not what is shown and files stay small.
  [[nodiscard]] Color grey(double above_floor) const {
    constexpr double kRelief = 0.2;  // m
    constexpr double kGreys = 16.0;
    const double share = std::clamp((above_floor - kRelief) / thick_, 0.0, 1.0);
    return mixed(kNearFloor, kHighUp, std::ceil(std::sqrt(share) * kGreys) / kGreys);
  }
  [[nodiscard]] Color grey_at(const Vector3d& p) const { return grey(p.z() - layers_.floor_at(p)); }
  [[nodiscard]] ColorBar bar() const {
    return {
        0.0, thick_, "above the floor (m)", [this](double share) { return grey(share * thick_); }};
  }
  [[nodiscard]] std::string caption() const {
    const bool is_cut = layers_.has_ceiling() || cut_ < layers_.box().max.z();
    return is_cut ? fmt::format("from above, up to z = {:.1f} m", cut_) : "from above";
  }

 private:
  const MapLayers& layers_;
  double cut_;    ///< Height, m.
  double thick_;  ///< m
};

void paint_map(Canvas& canvas, const Page& page, const SurfelMap& map, const Slab& slab) {
  Views views = render(map, page, [&](const Vector3d& p) { return slab.holds(p); });
  paint(canvas, page.top, views.top, [&](float z, int x, int y) -> std::optional<Color> {
    if (z == kEmpty) return std::nullopt;
    const Vector3d size = page.shown.size();
    return slab.grey_at({page.shown.min.x() + (x + 0.5) / page.top.width * size.x(),
                         page.shown.max.y() - (y + 0.5) / page.top.height * size.y(),
                         static_cast<double>(z)});
  });
  const double usual = usual_density(views.density);
  paint(canvas, page.side, views.density, [&](float n, int, int) -> std::optional<Color> {
    if (n <= 0.0f) return std::nullopt;
    return mixed(kPaper, kHighUp, 0.15 + 0.75 * ink_of(n, usual));
  });
}

void tint_seen(Canvas& canvas, const Page& page, const RunPicture& run, const Slab& slab) {
  const auto all = [](const Vector3d&) { return true; };
  const auto above_floor = [&](const Vector3d& p) { return slab.holds_above_floor(p); };
  const auto& seen = run.seen.items();
  tint(canvas, page.top, count_seen(seen, page.top, true, above_floor), kSeen, 0.55);
  tint(canvas, page.side, count_seen(seen, page.side, false, all), kSeen, 0.3);
  const auto& moving = run.seen_moving.items();
  tint(canvas, page.top, count_seen(moving, page.top, true, all), kMoving, 0.5);
  tint(canvas, page.side, count_seen(moving, page.side, false, all), kMoving, 0.5);
}

void draw_marks(Canvas& canvas, const Page& page, const RunPicture& run) {
  const double scale = page.top.width / page.shown.size().x();
  for (const Plot* plot : {&page.top, &page.side}) {
    const auto at = [&](const Vector3d& p) {
      return plot == &page.top ? page.on_top(p) : page.on_side(p);
    };
    canvas.begin_clip(plot->left, plot->top, plot->width, plot->height);
    draw_traces(canvas, run, scale, at);
    draw_flight(canvas, run, at);
    canvas.end_clip();
  }
}

/// The same in perspective, with the flown paths.
void draw_perspective(Canvas& canvas,
                      const Page& page,
                      const SurfelMap& map,
                      const RunPicture& run,
                      const MapLayers& layers,
                      const Aabb& flight) {
  const double cut = flight.empty() ? ceiling_cut(layers)
                                    : std::min(ceiling_cut(layers), flight.max.z() + kAboveFlight);
  const Perspective view(map,
                         page.shown,
                         layers.has_ceiling() ? cut : std::numeric_limits<double>::infinity(),
                         {page.top.left,
                          page.perspective_top,
                          page.width - page.top.left - 12.0,
                          page.perspective_height});
  const double low = layers.box().min.z();
  const double high = std::max(low + 1.0, layers.has_ceiling() ? cut : layers.box().max.z());
  view.paint(canvas, [&](double z) { return mixed(ramp((z - low) / (high - low)), kPaper, 0.45); });
  for (std::size_t v = 0; v < run.paths.size(); ++v) {
    view.draw_path(canvas, run.paths[v].points(), vehicle_color(v));
    if (run.paths[v].empty()) continue;
    if (const auto at = view.visible(run.paths[v].first())) {
      mark_start(canvas, at->first, at->second, vehicle_color(v));
    }
    if (const auto at = view.visible(run.paths[v].last())) {
      mark_end(canvas, at->first, at->second, vehicle_color(v));
    }
  }
  for (const Vector3d& p : run.collisions.items()) {
    if (const auto at = view.visible(p)) mark_collision(canvas, at->first, at->second);
  }
}

}  // namespace

/// One colour for each vehicle: first those that are told apart by who sees no red or green (Okabe,
/// Ito 2008), then hues all round.
Color vehicle_color(std::size_t number) {
  constexpr Color kFirst[] = {{0.84, 0.37, 0.0},
                              {0.0, 0.45, 0.70},
                              {0.0, 0.62, 0.45},
                              {0.80, 0.47, 0.65},
                              {0.90, 0.62, 0.0},
                              {0.20, 0.20, 0.20}};
  if (number < std::size(kFirst)) return kFirst[number];
  const double hue = 6.0 * std::fmod(0.618034 * static_cast<double>(number), 1.0);
  const double value = number % 2 == 0 ? 0.85 : 0.6;
  const auto part = [&](double shift) {
    const double k = std::fmod(shift + hue, 6.0);
    return value * (1.0 - 0.85 * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  };
  return {part(5.0), part(3.0), part(1.0)};
}

std::unique_ptr<Canvas> overview_page(const SurfelMap& map, const RunPicture& run) {
  const MapLayers layers(map);
  const Aabb flight = flight_box(run);
  const Slab slab(layers, flight);
  const Aabb shown = shown_box(layers, flight);
  const auto entries = legend_of(run);
  Page page = lay_out(shown, 0.0);  // its width says how many rows the legend takes
  const double room = page.width - page.top.left - 12.0;
  page = lay_out(shown, kTopMargin + 78.0 + legend_rows(entries, room) * kLegendRow);
  add_perspective(page);

  auto canvas = std::make_unique<Canvas>(page.width, page.height, kPaper);
  paint_map(*canvas, page, map, slab);
  tint_seen(*canvas, page, run, slab);
  draw_marks(*canvas, page, run);
  draw_perspective(*canvas, page, map, run, layers, flight);
  draw_axes(*canvas, page.top);
  draw_axes(*canvas, page.side);
  draw_color_bar(*canvas,
                 slab.bar(),
                 page.top.right() + 14.0,
                 page.top.top,
                 std::clamp(page.top.height, 130.0, 420.0));
  canvas->text_within(page.top.left, kTopMargin + 18.0, run.title, kTitleText, room, kInk);
  canvas->text_within(page.top.left, kTopMargin + 40.0, run.subtitle, kLabelText, room, kInk);
  draw_legend(*canvas, entries, page.top.left, kTopMargin + 60.0, room);
  draw_captions(*canvas, page, slab.caption());
  return canvas;
}

void draw_overview(const SurfelMap& map, const RunPicture& run, const std::string& path) {
  overview_page(map, run)->save(path);
}

}  // namespace pointflight::picture
