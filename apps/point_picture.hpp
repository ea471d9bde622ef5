#pragma once

#include <string>
#include <vector>

#include "apps/canvas.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight::apps {

/// Some points of a stream, evenly: each k-th, k doubled whenever there are too many.
class PointSample {
 public:
  void add(const Vector3d& point);
  [[nodiscard]] const std::vector<Vector3d>& points() const { return points_; }

 private:
  static constexpr std::size_t kMost = 600'000;
  std::vector<Vector3d> points_;
  std::size_t one_in_ = 1;
  std::size_t offered_ = 0;
};

/// Points of one colour, drawn over those of the layers before.
struct PointLayer {
  std::string name;
  Color color;
  bool by_height = false;  ///< Coloured by height instead.
  const PointSample* sample = nullptr;
};

/// A top view above a side view, metres along the axes. Throws
/// InputError if it cannot be written.
void draw_points(const std::string& title,
                 const std::string& subtitle,
                 const std::vector<PointLayer>& layers,
                 const std::string& path);

}  // namespace pointflight::apps
