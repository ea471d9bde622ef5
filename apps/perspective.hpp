#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "apps/canvas.hpp"
#include "apps/map_layers.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight::apps {

/// A map as an eye sees it, rendered as scans are: a ray for each pixel.
class Perspective {
 public:
  /// On the part of the map within `shown`, from the south west and above; what lies higher than
  /// `cut` (m) is not there. `left`, `top`, `width`, `height`: pixels of the canvas.
  Perspective(const SurfelMap& map,
              const Aabb& shown,
              double cut,
              double left,
              double top,
              double width,
              double height);

  /// Draws it, light falling from the eye; `color_at(z)`: of a height.
  void paint(Canvas& canvas, const std::function<Color(double z)>& color_at) const;

  /// A way through it: what the map hides of it is faint.
  void draw_way(Canvas& canvas, const std::vector<Vector3d>& points, Color color) const;

  /// Where a place is on the canvas; nothing where it is not in the picture, or hidden.
  [[nodiscard]] std::optional<std::pair<double, double>> visible(const Vector3d& p_world) const;

  [[nodiscard]] double left() const { return left_; }
  [[nodiscard]] double top() const { return top_; }
  [[nodiscard]] double width() const { return width_; }
  [[nodiscard]] double height() const { return height_; }

 private:
  /// Column, row (pixels) and range (m) of a place; nothing behind the eye.
  [[nodiscard]] std::optional<Vector3d> project(const Vector3d& p_world) const;
  [[nodiscard]] bool is_hidden(const Vector3d& projected) const;

  double left_, top_, width_, height_;
  int columns_, rows_;
  Vector3d eye_ = Vector3d::Zero();
  Matrix3d axes_ = Matrix3d::Identity();              ///< Rows: right, down, ahead.
  double focal_ = 1.0;                                ///< Pixels.
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();  ///< Where the eye looks straight on, pixels.
  std::vector<float> ranges_;                         ///< From the eye, m; negative: nothing.
  std::vector<float> cosines_, heights_;
};

/// Height (m) below which a map has to be cut so that its inside is seen from above: infinite
/// without a ceiling.
double ceiling_cut(const MapLayers& layers);

}  // namespace pointflight::apps
