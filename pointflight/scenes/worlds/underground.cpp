#include <algorithm>
#include <cmath>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

/// A piece of a passage: from one point to another in plan, and how wide and high it is.
struct Passage {
  Vector2d from, to;
  double half_width;  ///< m
  double height;      ///< In the middle, m.
};

/// A net of passages as two surfaces that touch along the walls: a floor and a roof of rock.
class Burrow {
 public:
  Burrow(std::vector<Passage> passages, double roughness, double squareness, double phase)
      : passages_(std::move(passages)),
        roughness_(roughness),
        squareness_(squareness),
        phase_(phase) {}

  /// How high the roof is above the floor, negative inside the rock.
  [[nodiscard]] double opening(double x, double y) const {
    double best = -1.0;
    for (const Passage& p : passages_) {
      const Vector2d along = p.to - p.from;
      const double share =
          std::clamp((Vector2d(x, y) - p.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
      const double away = (Vector2d(x, y) - p.from - share * along).norm() / p.half_width;
      const double rough = 1.0 + roughness_ * wave(x, y, 0.0);
      const double inside = 1.0 - away / rough;
      if (inside <= 0.0) {
        best = std::max(best, inside);
      } else {
        // squareness 0: a half circle; 1: steep walls
        const double share_of_height = std::min(1.0, inside * (1.0 + 4.0 * squareness_));
        best = std::max(best, p.height * std::sqrt(share_of_height * (2.0 - share_of_height)));
      }
    }
    return best;
  }
  [[nodiscard]] double floor(double x, double y) const {
    return roughness_ * (0.8 * wave(0.6 * x, 0.6 * y, 1.3) + 0.3 * wave(2.0 * x, 2.0 * y, 0.4)) *
           0.6;
  }
  [[nodiscard]] double roof(double x, double y) const {
    const double open = std::max(0.0, opening(x, y));
    const double rough = std::min(1.0, open) * roughness_ * 0.9 * wave(1.4 * x, 1.4 * y, 2.1);
    return floor(x, y) + open + rough;
  }

  /// Both surfaces, where there is room between them.
  void add(SceneBuilder& to, const Aabb& box, double step) const {
    const int nx = static_cast<int>(box.size().x() / step);
    const int ny = static_cast<int>(box.size().y() / step);
    const auto open_at = [&](int i, int j) {
      return opening(box.min.x() + step * i, box.min.y() + step * j) > 0.0;
    };
    for (const bool is_roof : {false, true}) {
      to.begin("rock");
      const auto corner = [&](int i, int j) {
        const double x = box.min.x() + step * i;
        const double y = box.min.y() + step * j;
        return Vector3d(x, y, is_roof ? roof(x, y) : floor(x, y));
      };
      for (int i = 0; i < nx; ++i) {
        for (int j = 0; j < ny; ++j) {
          if (!open_at(i, j) && !open_at(i + 1, j) && !open_at(i, j + 1) && !open_at(i + 1, j + 1))
            continue;
          to.triangle(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1));
          to.triangle(corner(i, j), corner(i + 1, j + 1), corner(i, j + 1));
        }
      }
    }
  }

 private:
  [[nodiscard]] double wave(double x, double y, double turn) const {
    return 0.5 * math::sin(1.1 * x + 0.7 * y + phase_ + turn) +
           0.3 * math::sin(2.3 * y - 1.7 * x + 2.0 * phase_ + turn) +
           0.2 * math::sin(4.1 * x + 3.7 * y + 3.0 * phase_ + turn);
  }

  std::vector<Passage> passages_;
  double roughness_, squareness_, phase_;
};

/// Galleries in a grid with crosscuts, timber sets, rails, cables and pipes.
Aabb build_mine(SceneBuilder& to, const WorldValues& values) {
  const double half = 0.5 * values["width"];
  const double height = values["height"];
  std::vector<Passage> passages;
  for (const double y : {6.0, 20.0, 34.0}) {
    double at = 3.0;
    double before = y;
    while (at < 57.0) {
      const double next = std::min(57.0, at + to.between(9.0, 14.0));
      const double after = y + to.between(-1.5, 1.5);
      passages.push_back({{at, before}, {next, after}, half, height});
      at = next;
      before = after;
    }
  }
  const int crosscuts = values.count("crosscuts");
  for (int i = 0; i < crosscuts; ++i) {
    const double x = 6.0 + 48.0 * (i + 0.5) / crosscuts + to.between(-1.0, 1.0);
    const double lean = to.between(-2.0, 2.0);
    passages.push_back({{x, 6.0}, {x + lean, 20.0}, 0.9 * half, 0.9 * height});
    const double further = to.between(-2.0, 2.0);
    passages.push_back({{x + lean, 20.0}, {x + lean + further, 34.0}, 0.9 * half, 0.9 * height});
  }
  const double phase = to.between(0.0, 6.0);
  const Burrow burrow(passages, 0.16, 0.7, phase);
  const Aabb box = box_of({0, 0, 0}, {60, 40, 4});
  burrow.add(to, box, 0.25);
  // timber sets and a pipe along the first of the galleries, a track in the second
  for (double x = 5.0; x < 56.0; x += 3.0) {
    const double y = 6.0;
    if (burrow.opening(x, y) < 0.8 * height) continue;
    to.begin("column");
    const double top = burrow.floor(x, y) + 0.82 * height;
    for (const double beside : {-0.62 * half, 0.62 * half}) {
      to.pole({x, y + beside, -0.3}, {x, y + beside, top}, 0.09);
    }
    to.pole({x, y - 0.72 * half, top}, {x, y + 0.72 * half, top}, 0.1);
  }
  to.begin("rail");
  for (double x = 4.0; x < 55.0; x += 0.8) to.box({x, 19.3, -0.02}, {x + 0.18, 20.7, 0.1});
  for (const double y : {19.6, 20.4}) to.box({4.0, y - 0.03, 0.1}, {55.0, y + 0.03, 0.2});
  parts::add_pipe(to, {{4.0, 34.0 - 0.7 * half, 1.4}, {56.0, 34.0 - 0.7 * half, 1.4}}, 0.08);
  for (int i = 0; i < 18; ++i) {
    const double x = to.between(4.0, 56.0);
    const double y = to.between(4.0, 36.0);
    if (burrow.opening(x, y) < 1.0) continue;
    const auto placed = to.at({x, y, burrow.floor(x, y)});
    parts::add_rock(to, to.between(0.2, 0.5));
  }
  return box_of({3, 3, 0.8}, {57, 37, 2.6});
}

/// Chambers and winding passages, columns of dripstone.
Aabb build_cave(SceneBuilder& to, const WorldValues& values) {
  std::vector<Passage> passages;
  const int chambers = values.count("chambers");
  Vector2d before(6.0, 15.0);
  for (int i = 0; i < chambers; ++i) {
    const double x = 6.0 + 43.0 * (i + 0.5) / chambers;
    const double y = to.between(8.0, 24.0);
    const Vector2d here(x, y);
    const double size = to.between(3.5, 5.5);
    const double tall = to.between(4.0, 7.5);
    passages.push_back({here - Vector2d(1.0, 0.5), here + Vector2d(1.0, 0.5), size, tall});
    passages.push_back({before, here, to.between(2.6, 3.2), to.between(3.0, 3.8)});
    before = here;
  }
  // a second way round
  passages.push_back({{8.0, 27.0}, {45.0, 27.5}, 2.8, 3.2});
  passages.push_back({{8.0, 27.0}, passages.front().from, 2.7, 3.2});
  passages.push_back({{45.0, 27.5}, before, 2.7, 3.2});
  const double phase = to.between(0.0, 6.0);
  const Burrow burrow(passages, 0.24, 0.35, phase);
  burrow.add(to, box_of({-2, 0, 0}, {54, 34, 8}), 0.22);
  const int dripstones = values.count("dripstones");
  for (int i = 0; i < dripstones; ++i) {
    const double x = to.between(3.0, 49.0);
    const double y = to.between(3.0, 31.0);
    const double kind = to.between(0.0, 1.0);
    const double share = to.between(0.2, 0.5);
    const double open = burrow.opening(x, y);
    if (open < 2.2) continue;
    const double low = burrow.floor(x, y);
    const double high = burrow.roof(x, y);
    to.begin("rock");
    if (kind < 0.2) {
      to.taper({x, y, low - 0.1}, {x, y, 0.5 * (low + high)}, 0.45, 0.16);
      to.taper({x, y, 0.5 * (low + high)}, {x, y, high + 0.1}, 0.16, 0.4);
    } else if (kind < 0.6) {
      to.taper({x, y, high + 0.1}, {x, y, high - share * open}, 0.04 * open, 0.0);
    } else {
      to.taper({x, y, low - 0.1}, {x, y, low + 0.6 * share * open}, 0.06 * open, 0.01);
    }
  }
  return box_of({1, 2, 1.0}, {51, 32, 4.0});
}

}  // namespace

WorldKind mine() {
  return {"mine",
          "rough galleries with crosscuts, timber, a track, a pipe",
          {57, 34, 4},
          {{"width", "of galleries, m", 3.6, 5.0},
           {"height", "of galleries, m", 2.8, 3.6},
           {"crosscuts", "how many", 4, 7, true}},
          build_mine,
          {{5, 20, 1.6}, {20, 20, 1.3}}};
}

WorldKind cave() {
  return {"cave",
          "chambers, winding passages, dripstone",
          {46, 23, 8},
          {{"chambers", "in a row", 4, 6, true}, {"dripstones", "tried", 80, 160, true}},
          build_cave,
          {{9.5, 27, 1.3}, {22, 27.2, 1.4}}};
}

}  // namespace pointflight::worlds
