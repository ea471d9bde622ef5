// A yard with what the hall and the forest lack: vegetation of several kinds, a net, a railing,
// glass, shelves, a staircase.
#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/scenes/exact_scene.hpp"
#include "pointflight/scenes/scene_tree.hpp"

namespace pointflight {
namespace {

/// Uniform numbers one after the other.
class Draws {
 public:
  explicit Draws(std::uint32_t part) : random_(1, StreamId::kSurvey, 1000 + part) {}
  double between(double low, double high) { return random_.uniform(next_++, low, high); }
  Vector3d in(const Aabb& box) {
    return {between(box.min.x(), box.max.x()),
            between(box.min.y(), box.max.y()),
            between(box.min.z(), box.max.z())};
  }
  Vector3d direction() {
    const double azimuth = between(-kPi, kPi);  // the order of arguments is the compiler's
    const double sine = between(-1.0, 1.0);
    return unit_direction(azimuth, math::asin(sine));
  }

 private:
  RandomStream random_;
  std::uint64_t next_ = 0;
};

Aabb box_of(const Vector3d& min, const Vector3d& max) {
  Aabb box;
  box.add(min);
  box.add(max);
  return box;
}

double ground_at(double x, double y) {
  return 0.12 * math::sin(0.5 * x) * math::cos(0.4 * y) + 0.03 * math::sin(2.1 * x + 1.7 * y);
}

class Yard {
 public:
  ExactScene make() {
    ground();
    house();
    staircase();
    net();
    hedge();
    meadow();
    for (const auto& [x, y] : {std::pair{5.0, 5.0}, {9.5, 15.0}, {14.0, 6.5}}) tree(x, y);
    for (const auto& [x, y] : {std::pair{3.0, 11.0}, {12.5, 11.5}, {7.0, 17.5}}) conifer(x, y);
    scene_.free = box_of({1, 1, 1}, {29, 19, 3});
    return std::move(scene_);
  }

 private:
  void rod(const Vector3d& from, const Vector3d& to, double radius) {
    scene_.geometry.shapes.emplace_back(Cone{from, to, radius, radius});
  }
  void tag(const std::string& name) {
    scene_.tag_from(tagged_, name);
    tagged_ = scene_.geometry.shapes.size();
  }

  void ground() {
    constexpr double kStep = 0.25;
    const auto corner = [](int i, int j) {
      const double x = kStep * i;
      const double y = kStep * j;
      return Vector3d(x, y, ground_at(x, y));
    };
    for (int i = 0; i < 120; ++i) {
      for (int j = 0; j < 80; ++j) {
        const Vector3d low = corner(i, j);
        const Vector3d high = corner(i + 1, j + 1);
        scene_.geometry.shapes.emplace_back(Triangle{low, corner(i + 1, j), high});
        scene_.geometry.shapes.emplace_back(Triangle{low, high, corner(i, j + 1)});
      }
    }
    tag("ground");
  }

  /// 8 x 7 x 3 m, open to the west over 3 m, with windows, shelves and a flat roof with a railing.
  void house() {
    ShapeScene& to = scene_.geometry;
    const Vector3d up(0, 0, 3.4);  // from below the ground
    constexpr double kBase = -0.4;
    to.add_box({20, 3, kBase}, {20.2, 5, 3});
    to.add_box({20, 8, kBase}, {20.2, 10, 3});
    to.add_box({20, 3, kBase}, {28, 3.2, 3});
    to.add_box({27.8, 3, kBase}, {28, 10, 3});
    to.add_rectangle({20, 10, kBase}, {1.5, 0, 0}, up);
    to.add_rectangle({26.5, 10, kBase}, {1.5, 0, 0}, up);
    to.add_rectangle({21.5, 10, kBase}, {5, 0, 0}, {0, 0, 1.3});
    to.add_rectangle({21.5, 10, 2.4}, {5, 0, 0}, {0, 0, 0.6});
    to.add_rectangle({20.2, 3.2, 0.14}, {7.6, 0, 0}, {0, 6.8, 0});
    tag("wall");
    to.add_box({19.8, 2.8, 3}, {28.2, 10.2, 3.2});
    tag("roof");
    to.add_rectangle({21.5, 10, 0.9}, {5, 0, 0}, {0, 0, 1.5});
    tag("glass");
    for (int i = 0; i <= 5; ++i) rod({21.5 + i, 10, 0.9}, {21.5 + i, 10, 2.4}, 0.02);
    tag("frame");
    Draws draws(1);
    for (int shelf = 0; shelf < 3; ++shelf) {
      const double y = 4.2 + 1.6 * shelf;
      for (const double z : {0.2, 0.8, 1.4, 2.0}) {
        to.add_box({25, y, z}, {27.5, y + 0.5, z + 0.02});
        for (double x = 25.05; x < 27.2;) {
          const double width = draws.between(0.08, 0.35);
          const double front = y + draws.between(0.02, 0.1);
          const double back = y + draws.between(0.3, 0.48);
          const double top = z + draws.between(0.12, 0.5);
          to.add_box({x, front, z + 0.02}, {x + width, back, top});
          x += width + draws.between(0.01, 0.2);
        }
      }
      for (const double x : {25.0, 27.5}) rod({x, y, 0.14}, {x, y, 2.3}, 0.015);
      for (const double x : {25.0, 27.5}) rod({x, y + 0.5, 0.14}, {x, y + 0.5, 2.3}, 0.015);
    }
    tag("shelf");
    for (const double y : {2.9, 10.1}) railing({19.9, y, 3.2}, {28.1, y, 3.2});
  }

  /// Posts of 4 cm, bars of 12 mm every 12 cm, a handrail.
  void railing(const Vector3d& from, const Vector3d& to) {
    const double length = (to - from).norm();
    const Vector3d along = (to - from) / length;
    const Vector3d up(0, 0, 1.0);
    for (double at = 0.0; at <= length; at += 1.5) {
      rod(from + at * along, from + at * along + up, 0.02);
    }
    for (double at = 0.12; at < length; at += 0.12) {
      rod(from + at * along + 0.1 * up, from + at * along + up, 0.006);
    }
    rod(from + up, to + up, 0.022);
    rod(from + 0.1 * up, to + 0.1 * up, 0.012);
    tag("railing");
  }

  /// Eighteen open steps up to the roof.
  void staircase() {
    constexpr int kSteps = 18;
    const Vector3d foot(14.7, 2.0, 0.0);
    for (int i = 0; i < kSteps; ++i) {
      const Vector3d at = foot + Vector3d(0.28 * i, 0.0, 3.2 / kSteps * (i + 1));
      scene_.geometry.add_box(at - Vector3d(0, 0, 0.04), at + Vector3d(0.28, 0.8, 0.0));
    }
    scene_.geometry.add_box({14.7 + 0.28 * kSteps, 2.0, 3.16}, {28.2, 2.8, 3.2});
    tag("step");
    const Vector3d top = foot + Vector3d(0.28 * kSteps, 0, 3.2);
    railing(foot + Vector3d(0, 0, 0.2), top);
    railing(top, {28.2, 2.0, 3.2});
  }

  /// Strings of 4 mm, 10 cm apart, between posts: 12 m long, 3 m high.
  void net() {
    for (int i = 0; i <= 120; ++i) {
      rod({16, 7.5 + 0.1 * i, 0.1}, {16, 7.5 + 0.1 * i, 3.0}, 0.002);
    }
    for (int i = 0; i <= 29; ++i) rod({16, 7.5, 0.1 + 0.1 * i}, {16, 19.5, 0.1 + 0.1 * i}, 0.002);
    tag("net");
    for (int i = 0; i <= 3; ++i) rod({16, 7.5 + 4 * i, -0.3}, {16, 7.5 + 4 * i, 3.1}, 0.03);
    tag("post");
  }

  void leaves(Draws& draws, std::size_t count, double radius, const Aabb& box, bool round) {
    const Vector3d middle = 0.5 * (box.min + box.max);
    const Vector3d half = 0.5 * box.size();
    for (std::size_t i = 0; i < count;) {
      const Vector3d at = draws.in(box);
      if (round && (at - middle).cwiseQuotient(half).squaredNorm() > 1.0) continue;
      scene_.geometry.shapes.emplace_back(Disc{at, draws.direction(), radius});
      ++i;
    }
  }

  void hedge() {
    Draws draws(2);
    leaves(draws, 9000, 0.02, box_of({2, 0.6, 0.05}, {13, 1.4, 1.6}), false);
    tag("leaf hedge");
    leaves(draws, 1500, 0.03, box_of({17.5, 12, 0}, {19.5, 14, 1.4}), true);
    leaves(draws, 900, 0.04, box_of({22, 15, 0}, {24, 17, 1.8}), true);
    tag("bush");
  }

  /// Blades of grass, 20 to 60 cm long.
  void meadow() {
    Draws draws(3);
    for (int i = 0; i < 9000; ++i) {
      const double x = draws.between(18.0, 29.0);
      const double y = draws.between(11.0, 19.5);
      const Vector3d foot(x, y, ground_at(x, y));
      const Vector3d lean{draws.between(-0.15, 0.15), draws.between(-0.15, 0.15), 0.0};
      const double length = draws.between(0.2, 0.6);
      scene_.geometry.shapes.emplace_back(
          Cone{foot, foot + lean + Vector3d(0, 0, length), 0.003, 0.0005});
    }
    tag("grass");
  }

  void tree(double x, double y) {
    Draws draws(static_cast<std::uint32_t>(100.0 * x + y));
    const Vector3d foot(x, y, ground_at(x, y) - 0.1);
    const Vector3d top = foot + Vector3d(0, 0, draws.between(6.0, 8.0));
    scene_.geometry.shapes.emplace_back(Cone{foot, top, 0.16, 0.03});
    std::vector<Vector3d> ends;
    for (int i = 0; i < 24; ++i) {
      const Vector3d from = foot + draws.between(0.35, 0.95) * (top - foot);
      const double length = draws.between(0.8, 2.2);
      const double azimuth = draws.between(-kPi, kPi);
      const Vector3d to = from + length * unit_direction(azimuth, draws.between(0.0, 0.9));
      scene_.geometry.shapes.emplace_back(Cone{from, to, 0.03, 0.008});
      ends.push_back(to);
    }
    tag("branch");
    for (const Vector3d& end : ends) {
      const Vector3d half(0.7, 0.7, 0.5);
      leaves(draws, 140, 0.035, box_of(end - half, end + half), true);
    }
    tag("leaf");
  }

  /// Whorls of branches with needles as rods of 2 mm.
  void conifer(double x, double y) {
    Draws draws(static_cast<std::uint32_t>(50000.0 + 100.0 * x + y));
    const Vector3d foot(x, y, ground_at(x, y) - 0.1);
    const double height = draws.between(5.0, 7.0);
    scene_.geometry.shapes.emplace_back(Cone{foot, foot + Vector3d(0, 0, height), 0.12, 0.01});
    std::vector<std::pair<Vector3d, Vector3d>> branches;
    for (double z = 0.8; z < height - 0.3; z += 0.35) {
      for (int i = 0; i < 7; ++i) {
        const Vector3d from = foot + Vector3d(0, 0, z);
        const double length = 0.32 * (height - z) + 0.2;
        const Vector3d to = from + length * unit_direction(draws.between(-kPi, kPi), -0.25);
        scene_.geometry.shapes.emplace_back(Cone{from, to, 0.012, 0.004});
        branches.emplace_back(from, to);
      }
    }
    tag("branch");
    for (const auto& [from, to] : branches) {
      const auto count = static_cast<int>(45.0 * (to - from).norm());
      for (int i = 0; i < count; ++i) {
        const Vector3d at = from + draws.between(0.2, 1.0) * (to - from);
        rod(at, at + 0.05 * draws.direction(), 0.001);
      }
    }
    tag("needle");
  }

  ExactScene scene_;
  std::size_t tagged_ = 0;
};

}  // namespace

ExactScene make_yard_scene() {
  ExactScene scene = Yard().make();
  scene.name = "yard";
  return scene;
}

}  // namespace pointflight
