#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/plot.hpp"

/// What pictures of maps have in common: a page with two views, and the map drawn into them.
namespace pointflight::picture {

inline constexpr double kTopMargin = 14.0;  ///< Above titles, pixels.

/// Pixels of one view.
struct Raster {
  /// Pixels.
  ///@{
  int width, height;
  ///@}
  std::vector<float> values;  ///< Row by row.

  /// All pixels have the value `fill`.
  Raster(int w, int h, float fill)
      : width(w),
        height(h),
        values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), fill) {}
  /// A pixel; null outside.
  float* at(int x, int y) {
    if (x < 0 || y < 0 || x >= width || y >= height) return nullptr;
    return &values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)];
  }
};

/// A page with a top view above a side view, metres along the axes.
struct Page {
  Plot top;   ///< Seen from above.
  Plot side;  ///< Seen from the south.
  /// Pixels.
  ///@{
  int width = 0, height = 0;
  ///@}
  double perspective_top = 0.0;     ///< Of the view in perspective below both.
  double perspective_height = 0.0;  ///< 0: there is none.
  Aabb shown;                       ///< World, m.

  /// Pixels of a point in the top view.
  [[nodiscard]] std::pair<double, double> on_top(const Vector3d& p) const {
    return top.at(p.x(), p.y());
  }
  /// Pixels of a point in the side view.
  [[nodiscard]] std::pair<double, double> on_side(const Vector3d& p) const {
    return side.at(p.x(), p.z());
  }
};

/// A page for a box of the world, its titles and legends `header` pixels high.
Page lay_out(const Aabb& shown, double header);

/// Makes room for a view in perspective below the others.
void add_perspective(Page& page);

/// The box with some room around and at least a metre on a side.
Aabb with_room(Aabb box);

/// Calls `mark` for the pixels that a surfel covers in a raster.
template <class Mark>
void splat(
    Raster& raster, const Plot& plot, std::pair<double, double> at, int side, const Mark& mark) {
  const int x = static_cast<int>(std::floor(at.first - plot.left - 0.5 * (side - 1)));
  const int y = static_cast<int>(std::floor(at.second - plot.top - 0.5 * (side - 1)));
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      if (float* value = raster.at(x + i, y + j)) mark(*value);
    }
  }
}

/// Value of a pixel of the top view in which nothing is.
inline constexpr float kEmpty = -std::numeric_limits<float>::infinity();

/// Both views of a map.
struct Views {
  Raster top;      ///< Of the highest thing that is shown: its height, m; kEmpty where nothing is.
  Raster assumed;  ///< Of the highest assumed surfel that is shown, the same.
  Raster density;  ///< Surfels along the line of sight, from the side.
};

/// Draws a map into both views; `shown_on_top(p)`: not cut away from the top view.
Views render(const SurfelMap& map,
             const Page& page,
             const std::function<bool(const Vector3d& p_world)>& shown_on_top);

/// Ink of a density, 0 to 1: what is hit by many is dark. `usual` is that of much of the view.
double ink_of(float density, double usual);
/// The density that much of the view has.
double usual_density(const Raster& raster);

/// `color(value, x, y)`: nothing leaves the pixel as it is.
template <class ColorOf>
void paint(Canvas& canvas, const Plot& plot, Raster& raster, const ColorOf& color) {
  canvas.begin_pixels();
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      if (const auto c = color(*raster.at(x, y), x, y)) {
        canvas.put(static_cast<int>(plot.left) + x, static_cast<int>(plot.top) + y, *c, 1.0);
      }
    }
  }
  canvas.end_pixels();
}

/// The colour that lies this fraction of the way from one to the other.
Color mixed(Color from, Color to, double fraction);

/// What each view shows.
void draw_captions(Canvas& canvas, const Page& page, const std::string& top);

}  // namespace pointflight::picture
