#include <algorithm>
#include <numeric>

#include "pointflight/io/internal/mesh_triangles.hpp"

namespace pointflight {
namespace {

/// Twice the area of a polygon, along its normal (Newell's method).
Vector3d area_vector(std::span<const Vector3d> corners) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    sum += (corners[i] - corners[0]).cross(corners[(i + 1) % corners.size()] - corners[0]);
  }
  return sum;
}

constexpr std::size_t kMostCorners = 2048;  // of polygons that may be reentrant
constexpr std::size_t kLooksPerCorner = 16;

/// Cuts ears off a polygon until a triangle is left (G. Meisters, "Polygons have ears", 1975).
class EarCutter {
 public:
  explicit EarCutter(std::span<const Vector3d> corners)
      : corners_(corners), normal_(area_vector(corners)), left_(corners.size()) {
    std::iota(left_.begin(), left_.end(), std::size_t{0});
  }

  std::vector<std::array<std::size_t, 3>> cut() {
    std::vector<std::array<std::size_t, 3>> triangles;
    std::size_t at = 0;
    std::size_t tried = 0;
    while (left_.size() > 3) {
      // a polygon that crosses itself may have no ear, and hostile ones take for ever to look
      // through: any corner will do then
      if (tried < left_.size() && !is_ear(at)) {
        at = (at + 1) % left_.size();
        ++tried;
        continue;
      }
      triangles.push_back(corner(at));
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(at));
      at %= left_.size();
      tried = 0;
    }
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  [[nodiscard]] std::array<std::size_t, 3> corner(std::size_t at) const {
    const std::size_t count = left_.size();
    return {left_[(at + count - 1) % count], left_[at], left_[(at + 1) % count]};
  }
  /// Above zero if c is on the inner side of the edge from a to b.
  [[nodiscard]] double side(const Vector3d& a, const Vector3d& b, const Vector3d& c) const {
    return (b - a).cross(c - a).dot(normal_);
  }
  [[nodiscard]] bool is_ear(std::size_t at) {
    const auto [i, j, k] = corner(at);
    const Vector3d& a = corners_[i];
    const Vector3d& b = corners_[j];
    const Vector3d& c = corners_[k];
    if (side(a, b, c) <= 0.0) return false;
    if (looks_++ > kLooksPerCorner * corners_.size()) return true;
    return std::none_of(left_.begin(), left_.end(), [&, i = i, j = j, k = k](std::size_t other) {
      if (other == i || other == j || other == k) return false;
      const Vector3d& p = corners_[other];
      if (p == a || p == b || p == c) return false;  // bridges to holes go along twice
      return side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0;
    });
  }

  std::span<const Vector3d> corners_;
  Vector3d normal_;
  std::vector<std::size_t> left_;
  std::size_t looks_ = 0;
};

}  // namespace

std::vector<std::array<std::size_t, 3>> triangulated(std::span<const Vector3d> corners) {
  if (corners.size() < 3) return {};
  if (corners.size() > 3 && corners.size() <= kMostCorners) return EarCutter(corners).cut();
  std::vector<std::array<std::size_t, 3>> fan;
  for (std::size_t i = 2; i < corners.size(); ++i) fan.push_back({0, i - 1, i});
  return fan;
}

}  // namespace pointflight
