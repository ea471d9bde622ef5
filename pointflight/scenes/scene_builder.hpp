#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {

using Eigen::Vector2d;

/// Puts an exact scene together from things that are made of simple shapes, each in a frame of its
/// own, and draws what differs from seed to seed.
class SceneBuilder {
 public:
  /// `stream`: which draws of the seed.
  explicit SceneBuilder(std::uint64_t seed, std::uint32_t stream = 0)
      : random_(seed, StreamId::kForest, 1 + stream), stream_(stream), seed_(seed) {}

  /// Uniform draws, one after the other: never two in one expression, whose order is the
  /// compiler's.
  ///@{
  double between(double low, double high) { return random_.uniform(next_++, low, high); }
  int whole(int low, int high);  ///< Both included.
  bool chance(double share) { return between(0.0, 1.0) < share; }
  ///@}

  /// While it lives, shapes are given in its frame, which sits in the one before.
  class Placed {
   public:
    ~Placed() { builder_.frames_.pop_back(); }
    Placed(const Placed&) = delete;
    Placed& operator=(const Placed&) = delete;

   private:
    friend class SceneBuilder;
    explicit Placed(SceneBuilder& builder) : builder_(builder) {}
    SceneBuilder& builder_;
  };
  /// Anywhere.
  [[nodiscard]] Placed at(const Pose& T_parent_own);
  /// Turned about z, rad.
  [[nodiscard]] Placed at(const Vector3d& position, double yaw = 0.0);

  /// Shapes from here on are one thing of this class (`scene_classes`).
  void begin(const std::string& name);
  /// Shapes from here on are of this class, but of the same thing.
  void part(const std::string& name);

  /// Surfaces, m, in the present frame.
  ///@{
  void triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c);
  void rectangle(const Vector3d& corner, const Vector3d& edge_u, const Vector3d& edge_v);
  void disc(const Vector3d& center, const Vector3d& normal, double radius);
  /// A mantle without ends: bars and twigs.
  void rod(const Vector3d& from, const Vector3d& to, double radius);
  void taper(const Vector3d& from, const Vector3d& to, double radius_from, double radius_to);
  ///@}

  /// Closed bodies, m, in the present frame.
  ///@{
  void box(const Vector3d& min, const Vector3d& max);
  void ball(const Vector3d& center, double radius);
  void pole(const Vector3d& from, const Vector3d& to, double radius);
  void pole(const Vector3d& from, const Vector3d& to, double radius_from, double radius_to);
  /// What a polygon in x and z sweeps from y_low to y_high. All of the polygon is seen from its
  /// first corner.
  void profile(const std::vector<Vector2d>& outline, double y_low, double y_high);
  ///@}

  /// A grid of triangles, `height(x, y)` high, with squares of about `step` m.
  template <class Height>
  void relief(const Vector2d& low, const Vector2d& high, double step, const Height& height);

  /// What has been built so far.
  [[nodiscard]] const ExactScene& scene() const { return scene_; }
  /// All of it: `free` is where sensors may stand.
  ExactScene finish(const Aabb& free);

 private:
  void add(const Shape& shape);
  [[nodiscard]] Vector3d moved(const Vector3d& p) const { return frames_.back() * p; }
  [[nodiscard]] Vector3d turned(const Vector3d& d) const { return frames_.back().rotation * d; }

  RandomStream random_;
  std::uint64_t next_ = 0;
  ExactScene scene_;
  std::vector<Pose> frames_ = {Pose{}};
  std::uint32_t stream_;
  std::uint64_t seed_;
  std::uint16_t tag_ = 0;
  std::uint32_t object_ = 0;
};

template <class Height>
void SceneBuilder::relief(const Vector2d& low,
                          const Vector2d& high,
                          double step,
                          const Height& height) {
  const Vector2d size = high - low;
  const int nx = std::max(1, static_cast<int>(std::lround(size.x() / step)));
  const int ny = std::max(1, static_cast<int>(std::lround(size.y() / step)));
  const auto corner = [&](int i, int j) {
    const double x = low.x() + size.x() * i / nx;
    const double y = low.y() + size.y() * j / ny;
    return Vector3d(x, y, height(x, y));
  };
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j) {
      triangle(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1));
      triangle(corner(i, j), corner(i + 1, j + 1), corner(i, j + 1));
    }
  }
}

}  // namespace pointflight
