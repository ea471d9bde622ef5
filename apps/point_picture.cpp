#include "apps/point_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace pointflight::apps {
namespace {

constexpr double kMargin = 56.0;
constexpr double kHeader = 92.0;
constexpr double kGap = 60.0;

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

/// One of the two views: x to the right, `vertical` up.
struct View {
  int vertical;
  double scale, left, top, bottom;
  const Aabb& frame;

  [[nodiscard]] double x(double metres) const { return left + scale * (metres - frame.min.x()); }
  [[nodiscard]] double y(double metres) const {
    return bottom - scale * (metres - frame.min[vertical]);
  }
};

/// A round number of metres that makes a few steps of `span`.
double round_step(double span) {
  double step = 1e-3;
  while (span / step > 8.0) {
    for (const double factor : {2.0, 2.5, 2.0}) {
      if (span / step > 8.0) step *= factor;
    }
  }
  return step;
}

void draw_axes(Canvas& canvas, const View& view) {
  const auto label = [](double value) {
    return fmt::format("{:g}", std::abs(value) < 1e-9 ? 0.0 : value);
  };
  const double right = view.x(view.frame.max.x());
  canvas.line({{view.left, view.top}, {view.left, view.bottom}, {right, view.bottom}}, 1.0, kDim);
  const double step = round_step(view.frame.size().x());
  for (double x = std::ceil(view.frame.min.x() / step) * step; x <= view.frame.max.x(); x += step) {
    canvas.line({{view.x(x), view.bottom}, {view.x(x), view.bottom + 4.0}}, 1.0, kDim);
    canvas.text(view.x(x) - 8.0, view.bottom + 16.0, label(x), 10.0, kDim);
  }
  const int v = view.vertical;
  const double rise = std::max(step, round_step(view.frame.size()[v]));
  for (double y = std::ceil(view.frame.min[v] / rise) * rise; y <= view.frame.max[v]; y += rise) {
    canvas.line({{view.left - 4.0, view.y(y)}, {view.left, view.y(y)}}, 1.0, kDim);
    canvas.text(view.left - 40.0, view.y(y) + 4.0, label(y), 10.0, kDim);
  }
  canvas.text(right + 6.0, view.bottom + 4.0, "x, m", 10.0, kDim);
  canvas.text(view.left - 12.0, view.top - 6.0, v == 1 ? "y, m" : "z, m", 10.0, kDim);
}

void draw_layer(Canvas& canvas, const View& view, const PointLayer& layer) {
  std::vector<Vector3d> points = layer.sample->points();
  std::sort(points.begin(), points.end(), [](const Vector3d& a, const Vector3d& b) {
    return a.z() < b.z();  // high ones over low ones
  });
  const double low = view.frame.min.z();
  const double high = view.frame.max.z();
  for (const Vector3d& p : points) {
    const double x = view.x(p.x());
    const double y = view.y(p[view.vertical]);
    const bool within =
        x >= view.left && y <= view.bottom && y >= view.top && p.x() <= view.frame.max.x();
    if (!within) continue;
    const Color color = layer.by_height ? ramp((p.z() - low) / (high - low)) : layer.color;
    canvas.put(static_cast<int>(x), static_cast<int>(y), color, 0.7);
    canvas.put(static_cast<int>(x) + 1, static_cast<int>(y), color, 0.4);
    canvas.put(static_cast<int>(x), static_cast<int>(y) - 1, color, 0.4);
  }
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
  const Aabb frame = frame_of(layers);
  const Vector3d size = frame.size();
  const double scale = std::min(1100.0 / size.x(), 1000.0 / (size.y() + size.z()));
  const double top_bottom = kHeader + scale * size.y();
  const double side_top = top_bottom + kGap;
  const View top{1, scale, kMargin, kHeader, top_bottom, frame};
  const View side{2, scale, kMargin, side_top, side_top + scale * size.z(), frame};
  Canvas canvas(static_cast<int>(std::max(640.0, scale * size.x() + 2.0 * kMargin)),
                static_cast<int>(side.bottom + kMargin),
                kPaper);
  canvas.text(kMargin, 28.0, title, 18.0, kInk);
  canvas.text(kMargin, 48.0, subtitle, 12.0, kInk);
  double x = kMargin;
  for (const PointLayer& layer : layers) {
    if (layer.name.empty()) continue;
    canvas.box(x, 58.0, 10.0, 10.0, layer.color);
    canvas.text(x + 14.0, 67.0, layer.name, 11.0, kInk);
    x += 30.0 + 6.5 * static_cast<double>(layer.name.size());
  }
  canvas.begin_pixels();
  for (const View& view : {top, side}) {
    for (const PointLayer& layer : layers) draw_layer(canvas, view, layer);
  }
  canvas.end_pixels();
  for (const View& view : {top, side}) draw_axes(canvas, view);
  canvas.save(path);
}

}  // namespace pointflight::apps
