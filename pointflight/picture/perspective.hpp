#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "pointflight/map/body.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/map_layers.hpp"
#include "pointflight/render/hit.hpp"

namespace pointflight::picture {

/// A viewpoint.
struct Eye {
  Vector3d position = Vector3d::Zero();  ///< World, m.
  Vector3d target = Vector3d::UnitX();   ///< In the middle of the picture; not above or below.
  double field_deg = 65.0;               ///< Across the picture's width.
};

/// Pixels of a canvas.
struct Frame {
  /// Its corner.
  ///@{
  double left = 0.0, top = 0.0;
  ///@}
  /// Its size.
  ///@{
  double width = 0.0, height = 0.0;
  ///@}
};

/// What moves, at an instant.
struct MovingThings {
  std::span<const Body> bodies;  ///< All of them.
  SimTime time;                  ///< The instant.
};

/// What an eye sees along one ray.
struct Seen {
  float range = -1.0f;               ///< From the eye, m; negative: nothing.
  float cosine = 0.0f;               ///< |cos| of the angle between ray and surface normal.
  float z = 0.0f;                    ///< World, m.
  Label label = kMapLabel;           ///< What it is of.
  std::uint32_t surfel = kNoSurfel;  ///< Of the map: index in `SurfelMap::words()`.
  bool is_assumed = false;           ///< No survey saw this surfel.
};

/// A map, and what moves in it, as an eye sees it, rendered as scans are: a ray for each pixel, or
/// several.
class Perspective {
 public:
  /// On the part of the map within `shown`, from the south west and above, filling the frame; what
  /// lies higher than `cut` (m) is not there. Of each pixel `samples` by `samples` rays: edges are
  /// the smoother.
  Perspective(
      const SurfelMap& map, const Aabb& shown, double cut, const Frame& frame, int samples = 1);
  /// From an eye.
  Perspective(const SurfelMap& map,
              const Eye& eye,
              double cut,
              const Frame& frame,
              const MovingThings& things,
              int samples = 1);

  /// Draws it, light falling from the eye; `color_at(z)`: of the map at a height
  /// (what is assumed has a colour of its own);
  /// `color_of(label)`: of what moves.
  void paint(Canvas& canvas,
             const std::function<Color(double z)>& color_at,
             const std::function<Color(Label)>& color_of = {}) const;

  /// Draws it in the colours that `color_of(seen, direction of the ray)` has for what rays hit, the
  /// mean of those of a pixel.
  void paint_seen(Canvas& canvas,
                  const std::function<Color(const Seen&, const Vector3d&)>& color_of) const;

  /// A path through it; what the map hides of it is faint.
  void draw_path(Canvas& canvas, const std::vector<Vector3d>& points, Color color) const;

  /// The pixel of a point; nothing if it is outside of the picture or hidden.
  [[nodiscard]] std::optional<std::pair<double, double>> visible(const Vector3d& p_world) const;

 private:
  void look(const Vector3d& target);
  void render(const SurfelMap& map, double cut, const MovingThings& things);
  /// Column, row (pixels) and range (m) of a point; nothing behind the eye.
  [[nodiscard]] std::optional<Vector3d> project(const Vector3d& p_world) const;
  [[nodiscard]] bool is_hidden(const Vector3d& projected) const;
  /// Of the ray through a position in the picture, pixels; world, unit length.
  [[nodiscard]] Vector3d direction(double x, double y) const;

  Frame frame_;
  int samples_ = 1;
  int columns_, rows_;  ///< Of rays.
  Vector3d eye_ = Vector3d::Zero();
  Matrix3d axes_ = Matrix3d::Identity();              ///< Rows: right, down, ahead.
  double focal_ = 1.0;                                ///< Pixels.
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();  ///< Where the eye looks straight on, pixels.
  std::vector<Seen> seen_;                            ///< By rows of rays.
};

/// Height (m) below which a map has to be cut so that its inside is seen from above: infinite
/// without a ceiling.
double ceiling_cut(const MapLayers& layers);

}  // namespace pointflight::picture
