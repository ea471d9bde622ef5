#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/map_views.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::picture {

namespace {

void draw_way(Canvas& canvas, const Page& page, const MapWay& way) {
  std::vector<std::pair<double, double>> line;
  for (const Vector3d& p : way.points_world) line.push_back(page.on_top(p));
  canvas.line(line, 5.0, kPaper, 0.8);
  canvas.line(line, 2.4, way.color);
  canvas.ring(line.front().first, line.front().second, 5.0, 2.4, way.color);
  canvas.dot(line.back().first, line.back().second, 5.0, way.color);
  canvas.text(line.back().first + 7.0, line.back().second + 4.0, way.label, kLabelText, kInk);
}

}  // namespace

std::unique_ptr<Canvas> map_page(const SurfelMap& map,
                                 const std::string& title,
                                 std::span<const MapWay> ways) {
  constexpr double kHeader = kTopMargin + 76.0;
  const MapLayers layers(map);
  Aabb bounds = map.bounds_world();
  if (bounds.empty()) bounds.add(Vector3d::Zero());
  Page page = lay_out(with_room(bounds), kHeader);
  add_perspective(page);
  Views views = render(map, page, [&](const Vector3d& p) { return !layers.is_ceiling(p); });
  // colours are for heights that occur
  std::vector<float> heights;
  for (const float z : views.top.values) {
    if (z > kEmpty) heights.push_back(z);
  }
  std::sort(heights.begin(), heights.end());
  const std::size_t cut = heights.size() / 200;
  const double low = heights.empty() ? 0.0 : static_cast<double>(heights[cut]);
  const double high =
      heights.empty() ? 1.0 : static_cast<double>(heights[heights.size() - 1 - cut]) + 0.01;
  const auto color_at = [&](double z) { return ramp((z - low) / (high - low)); };

  auto canvas = std::make_unique<Canvas>(page.width, page.height, kPaper);
  paint(*canvas, page.top, views.top, [&](float z, int x, int y) -> std::optional<Color> {
    if (z == kEmpty) return std::nullopt;
    if (*views.assumed.at(x, y) == z) return kAssumedColor;
    return color_at(static_cast<double>(z));
  });
  for (const MapWay& way : ways) draw_way(*canvas, page, way);
  const double usual = usual_density(views.density);
  paint(*canvas, page.side, views.density, [&](float n, int, int y) -> std::optional<Color> {
    if (n <= 0.0f) return std::nullopt;
    const double z = page.shown.max.z() - (y + 0.5) / page.side.height * page.shown.size().z();
    const Color color = z > high && layers.has_ceiling() ? kDim : color_at(z);  // cut away above
    return mixed(kPaper, color, 0.25 + 0.75 * ink_of(n, usual));
  });
  const Perspective perspective(map,
                                page.shown,
                                ceiling_cut(layers),
                                {page.top.left,
                                 page.perspective_top,
                                 page.width - page.top.left - 12.0,
                                 page.perspective_height});
  perspective.paint(*canvas, color_at);
  draw_axes(*canvas, page.top);
  draw_axes(*canvas, page.side);
  draw_color_bar(*canvas,
                 {low, high, "height z (m)", ramp},
                 page.top.right() + 14.0,
                 page.top.top,
                 std::clamp(page.top.height, 130.0, 420.0));
  const double room = page.width - page.top.left - 12.0;
  canvas->text_within(page.top.left, kTopMargin + 18.0, title, kTitleText, room, kInk);
  const Vector3d size = map.bounds_world().empty() ? Vector3d::Zero() : map.bounds_world().size();
  canvas->text_within(page.top.left,
                      kTopMargin + 40.0,
                      fmt::format("{} surfels at {:.4g} m, {:.1f} x {:.1f} x {:.1f} m{}",
                                  map.surfel_count(),
                                  map.resolution(),
                                  size.x(),
                                  size.y(),
                                  size.z(),
                                  map.has_assumed() ? "; violet: assumed" : ""),
                      kLabelText,
                      room,
                      kInk);
  draw_captions(*canvas,
                page,
                layers.has_ceiling() ? "from above, without the ceiling and what hangs from it"
                                     : "from above");
  return canvas;
}

void draw_map(const SurfelMap& map,
              const std::string& title,
              const std::string& path,
              std::span<const MapWay> ways) {
  map_page(map, title, ways)->save(path);
}

}  // namespace pointflight::picture
