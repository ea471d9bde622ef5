#include "pointflight/picture/point_picture.hpp"

#include <algorithm>
#include <utility>

#include "pointflight/picture/map_views.hpp"

namespace pointflight::picture {
namespace {

/// Corners between which all but a few points lie: strays must not shrink the rest.
Aabb frame_of(const std::vector<PointLayer>& layers) {
  Aabb frame;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const PointLayer& layer : layers) {
      for (const Vector3d& p : layer.sample->points()) values.push_back(p[axis]);
    }
    if (values.empty()) values = {0.0, 1.0};
    const auto cut = static_cast<std::ptrdiff_t>(values.size() / 1000);
    std::nth_element(values.begin(), values.begin() + cut, values.end());
    frame.min[axis] = values[static_cast<std::size_t>(cut)];
    std::nth_element(values.begin(), values.end() - 1 - cut, values.end());
    frame.max[axis] = *(values.end() - 1 - cut);
    if (frame.max[axis] - frame.min[axis] < 1e-3) frame.max[axis] = frame.min[axis] + 1e-3;
  }
  return frame;
}

/// High points over low ones.
void draw_layer(Canvas& canvas, const Page& page, const PointLayer& layer) {
  std::vector<Vector3d> points = layer.sample->points();
  std::sort(points.begin(), points.end(), [](const Vector3d& a, const Vector3d& b) {
    return a.z() < b.z();
  });
  const double low = page.shown.min.z();
  const double high = page.shown.max.z();
  for (const Vector3d& p : points) {
    const bool within =
        (p.array() >= page.shown.min.array()).all() && (p.array() <= page.shown.max.array()).all();
    if (!within) continue;
    const Color color = layer.by_height ? ramp((p.z() - low) / (high - low)) : layer.color;
    for (const auto& [x, y] : {page.on_top(p), page.on_side(p)}) {
      canvas.put(static_cast<int>(x), static_cast<int>(y), color, 0.7);
      canvas.put(static_cast<int>(x) + 1, static_cast<int>(y), color, 0.4);
      canvas.put(static_cast<int>(x), static_cast<int>(y) - 1, color, 0.4);
    }
  }
}

std::vector<LegendEntry> legend_of(const std::vector<PointLayer>& layers) {
  std::vector<LegendEntry> entries;
  for (const PointLayer& layer : layers) {
    if (layer.by_height) continue;
    entries.push_back({layer.name, 12.0, [color = layer.color](Canvas& canvas, double x, double y) {
                         canvas.box(x, y - 5.0, 10.0, 10.0, color);
                       }});
  }
  return entries;
}

}  // namespace

void PointSample::add(const Vector3d& point) {
  if (offered_++ % one_in_ != 0) return;
  points_.push_back(point);
  if (points_.size() < kMost) return;
  for (std::size_t i = 0; 2 * i < points_.size(); ++i) points_[i] = points_[2 * i];
  points_.resize((points_.size() + 1) / 2);
  one_in_ *= 2;
}

void draw_points(const std::string& title,
                 const std::string& subtitle,
                 const std::vector<PointLayer>& layers,
                 const std::string& path) {
  constexpr double kHeader = kTopMargin + 100.0;
  const Page page = lay_out(with_room(frame_of(layers)), kHeader);
  Canvas canvas(page.width, page.height, kPaper);
  canvas.begin_pixels();
  for (const PointLayer& layer : layers) draw_layer(canvas, page, layer);
  canvas.end_pixels();
  draw_axes(canvas, page.top);
  draw_axes(canvas, page.side);
  const double left = page.top.left;
  const double room = page.width - left - 12.0;
  canvas.text_within(left, kTopMargin + 18.0, title, kTitleText, room, kInk);
  canvas.text_within(left, kTopMargin + 40.0, subtitle, kLabelText, room, kInk);
  draw_legend(canvas, legend_of(layers), left, kTopMargin + 60.0, room);
  const bool by_height = std::any_of(
      layers.begin(), layers.end(), [](const PointLayer& layer) { return layer.by_height; });
  if (by_height) {
    draw_color_bar(canvas,
                   {page.shown.min.z(), page.shown.max.z(), "height z (m)", ramp},
                   page.top.right() + 14.0,
                   page.top.top,
                   std::clamp(page.top.height, 130.0, 420.0));
  }
  draw_captions(canvas, page, "from above");
  canvas.save(path);
}

}  // namespace pointflight::picture
