#pragma once

#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/picture/canvas.hpp"

namespace pointflight::picture {

/// Some points of a stream, evenly: each k-th, k doubled whenever there are too many.
class PointSample {
 public:
  /// Offers a point.
  void add(const Vector3d& point);
  /// Those that were kept.
  [[nodiscard]] const std::vector<Vector3d>& points() const { return points_; }

 private:
  static constexpr std::size_t kMost = 600'000;
  std::vector<Vector3d> points_;
  std::size_t one_in_ = 1;
  std::size_t offered_ = 0;
};

/// Points of one colour, drawn over those of the layers before.
struct PointLayer {
  std::string name;                     ///< In the legend.
  Color color;                          ///< Of its points.
  bool by_height = false;               ///< Coloured by height instead.
  const PointSample* sample = nullptr;  ///< What to draw.
};

/// A top view above a side view, metres along the axes. Throws
/// InputError if it cannot be written.
void draw_points(const std::string& title,
                 const std::string& subtitle,
                 const std::vector<PointLayer>& layers,
                 const std::string& path);

}  // namespace pointflight::picture
