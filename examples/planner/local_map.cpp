#include "examples/planner/local_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planner {
namespace {

constexpr std::int8_t kHitGain = 4;  // a scan that hits counts as much as four that look through
constexpr std::int8_t kScoreMax = 12;
constexpr std::uint8_t kSurelyFree = 4;  // scans in a row
constexpr double kDistanceMax = 3.0;     // m
constexpr double kForget = 1.0;          // s: a mover that nobody sees any more
constexpr double kCluster = 0.6;         // m between points of one mover
constexpr double kMatch = 0.7;           // m a mover may be from where it was expected
constexpr double kFastest = 2.0;         // m/s

/// The exact squared distance transform along one line (Felzenszwalb, Huttenlocher 2012).
void transform_line(std::vector<float>& f, std::size_t n) {
  static thread_local std::vector<int> v;
  static thread_local std::vector<float> z, d;
  v.resize(n);
  z.resize(n + 1);
  d.resize(n);
  int k = 0;
  v[0] = 0;
  z[0] = -std::numeric_limits<float>::infinity();
  z[1] = std::numeric_limits<float>::infinity();
  for (int q = 1; q < static_cast<int>(n); ++q) {
    float s = 0.0f;
    for (;; --k) {
      const auto a = static_cast<float>(v[static_cast<std::size_t>(k)]);
      const auto b = static_cast<float>(q);
      s = ((f[static_cast<std::size_t>(q)] + b * b) -
           (f[static_cast<std::size_t>(v[static_cast<std::size_t>(k)])] + a * a)) /
          (2.0f * b - 2.0f * a);
      if (s > z[static_cast<std::size_t>(k)]) break;
    }
    ++k;
    v[static_cast<std::size_t>(k)] = q;
    z[static_cast<std::size_t>(k)] = s;
    z[static_cast<std::size_t>(k) + 1] = std::numeric_limits<float>::infinity();
  }
  k = 0;
  for (int q = 0; q < static_cast<int>(n); ++q) {
    while (z[static_cast<std::size_t>(k) + 1] < static_cast<float>(q)) ++k;
    const int at = v[static_cast<std::size_t>(k)];
    d[static_cast<std::size_t>(q)] =
        static_cast<float>((q - at) * (q - at)) + f[static_cast<std::size_t>(at)];
  }
  std::copy(d.begin(), d.begin() + static_cast<std::ptrdiff_t>(n), f.begin());
}

/// Points that lie together, as things that do not move yet.
std::vector<Mover> clusters_of(const std::vector<Vector3d>& points, double time) {
  std::vector<bool> taken(points.size(), false);
  std::vector<Mover> found;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (taken[i]) continue;
    std::vector<std::size_t> open = {i};
    taken[i] = true;
    pointflight::Aabb box;
    std::size_t count = 0;
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      box.add(points[at]);
      ++count;
      for (std::size_t j = 0; j < points.size(); ++j) {
        if (taken[j] || (points[j] - points[at]).norm() > kCluster) continue;
        taken[j] = true;
        open.push_back(j);
      }
    }
    if (count < 3) continue;
    Mover mover;
    mover.center = 0.5 * (box.min + box.max);
    mover.radius = 0.5 * box.size().norm();
    mover.last_seen = time;
    mover.track = {{time, mover.center}};
    found.push_back(mover);
  }
  return found;
}

/// A known mover was seen again: a straight line through its track is its velocity.
void follow(Mover& known, const Mover& seen) {
  const double time = seen.last_seen;
  known.center = seen.center;
  known.radius = std::max(0.9 * known.radius, seen.radius);
  known.last_seen = time;
  known.track.emplace_back(time, seen.center);
  std::erase_if(known.track, [&](const auto& entry) { return time - entry.first > 1.0; });
  double mean_t = 0.0;
  Vector3d mean_p = Vector3d::Zero();
  for (const auto& [t, p] : known.track) {
    mean_t += t / static_cast<double>(known.track.size());
    mean_p += p / static_cast<double>(known.track.size());
  }
  double tt = 0.0;
  Vector3d tp = Vector3d::Zero();
  for (const auto& [t, p] : known.track) {
    tt += (t - mean_t) * (t - mean_t);
    tp += (t - mean_t) * (p - mean_p);
  }
  const double span = known.track.back().first - known.track.front().first;
  const Vector3d velocity = tt > 0.0 ? Vector3d(tp / tt) : Vector3d(0, 0, 0);
  double off = 0.0;  // from the line
  for (const auto& [t, p] : known.track) {
    off = std::max(off, (p - mean_p - (t - mean_t) * velocity).norm());
  }
  known.moves = known.track.size() >= 4 && span > 0.3 && velocity.norm() > 0.2 &&
                velocity.norm() < kFastest && off < 0.35;
  known.velocity = known.moves ? velocity : Vector3d(0, 0, 0);
}

std::int64_t cell_number(double x) {
  return static_cast<std::int64_t>(std::floor(x / LocalMap::kCell));
}

}  // namespace

bool LocalMap::contains(const Vector3d& p) const {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t i = cell_number(p[static_cast<int>(axis)]) - low_[axis];
    if (i < 0 || i >= kSize[axis]) return false;
  }
  return !score_.empty();
}

bool LocalMap::is_known(const Vector3d& p) const {
  const std::size_t i = index_of(p);
  return score_[i] > 0 || free_[i] > 0;
}

std::size_t LocalMap::index_of(const Vector3d& p) const {
  const std::int64_t x = cell_number(p.x()) - low_[0];
  const std::int64_t y = cell_number(p.y()) - low_[1];
  const std::int64_t z = cell_number(p.z()) - low_[2];
  return static_cast<std::size_t>((z * kSize[1] + y) * kSize[0] + x);
}

std::uint64_t LocalMap::key_of(const Vector3d& p) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key = key << 21u | (static_cast<std::uint64_t>(cell_number(p[axis])) & 0x1fffffu);
  }
  return key;
}

Vector3d LocalMap::center_of(std::size_t index) const {
  const auto i = static_cast<std::int64_t>(index);
  const std::int64_t x = i % kSize[0];
  const std::int64_t y = i / kSize[0] % kSize[1];
  const std::int64_t z = i / (kSize[0] * kSize[1]);
  return kCell * Vector3d(static_cast<double>(low_[0] + x) + 0.5,
                          static_cast<double>(low_[1] + y) + 0.5,
                          static_cast<double>(low_[2] + z) + 0.5);
}

/// Shifts the grid so that `center` is in its middle; what leaves is forgotten.
void LocalMap::move_to(const Vector3d& center) {
  const auto count = static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2]);
  std::array<std::int64_t, 3> low{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = cell_number(center[static_cast<int>(axis)]) - kSize[axis] / 2;
  }
  if (score_.empty()) {
    score_.assign(count, 0);
    free_.assign(count, 0);
    low_ = low;
    return;
  }
  if (low == low_) return;
  std::vector<std::int8_t> score(count, 0);
  std::vector<std::uint8_t> free(count, 0);
  const LocalMap& old = *this;
  for (int z = 0; z < kSize[2]; ++z) {
    for (int y = 0; y < kSize[1]; ++y) {
      for (int x = 0; x < kSize[0]; ++x) {
        const std::int64_t ox = x + low[0] - low_[0];
        const std::int64_t oy = y + low[1] - low_[1];
        const std::int64_t oz = z + low[2] - low_[2];
        if (ox < 0 || oy < 0 || oz < 0 || ox >= kSize[0] || oy >= kSize[1] || oz >= kSize[2]) {
          continue;
        }
        const auto to = static_cast<std::size_t>((z * kSize[1] + y) * kSize[0] + x);
        const auto from = static_cast<std::size_t>((oz * kSize[1] + oy) * kSize[0] + ox);
        score[to] = old.score_[from];
        free[to] = old.free_[from];
      }
    }
  }
  score_ = std::move(score);
  free_ = std::move(free);
  low_ = low;
}

void LocalMap::add_scan(const std::vector<SeenPoint>& points, const Vector3d& center, double time) {
  move_to(center);
  enum : std::uint8_t { kNothing, kThrough, kHit };
  std::vector<std::uint8_t> seen(score_.size(), kNothing);
  // beams pass through cells up to shortly before their points
  for (const SeenPoint& s : points) {
    const Vector3d way = s.point - s.origin;
    const double length = way.norm();
    const double step = 0.7 * kCell;
    for (double t = kCell; t < length - 1.5 * kCell; t += step) {
      const Vector3d p = s.origin + (t / length) * way;
      if (!contains(p)) break;
      seen[index_of(p)] = kThrough;
    }
  }
  std::vector<Vector3d> fresh;
  for (const SeenPoint& s : points) {
    if (!contains(s.point)) continue;
    const std::size_t i = index_of(s.point);
    // if there surely was nothing something has come
    if (free_[i] >= kSurelyFree && !is_beside_filled(s.point)) fresh.push_back(s.point);
    seen[i] = kHit;
  }
  find_movers(fresh, time);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] == kHit) {
      score_[i] = static_cast<std::int8_t>(std::min<int>(kScoreMax, score_[i] + kHitGain));
      free_[i] = 0;
    } else if (seen[i] == kThrough) {
      if (score_[i] > 0) --score_[i];
      if (score_[i] == 0 && free_[i] < 255) ++free_[i];
    }
  }
  measure_distances();
}

/// An edge that comes into sight beside what is known is nothing that moves.
bool LocalMap::is_beside_filled(const Vector3d& p) const {
  constexpr int kBeside = 2;  // cells
  for (int z = -kBeside; z <= kBeside; ++z) {
    for (int y = -kBeside; y <= kBeside; ++y) {
      for (int x = -kBeside; x <= kBeside; ++x) {
        const Vector3d q = p + kCell * Vector3d(x, y, z);
        if (contains(q) && score_[index_of(q)] > 0) return true;
      }
    }
  }
  return false;
}

/// Groups of fresh points are movers; matched with those known, their motion is their velocity.
void LocalMap::find_movers(const std::vector<Vector3d>& fresh, double time) {
  for (const Mover& mover : clusters_of(fresh, time)) {
    Mover* match = nullptr;
    double nearest = kMatch;
    for (Mover& known : candidates_) {
      const double apart = (known.at(time) - mover.center).norm();
      if (apart >= nearest || known.last_seen >= time) continue;
      nearest = apart;
      match = &known;
    }
    if (match == nullptr) {
      candidates_.push_back(mover);
    } else {
      follow(*match, mover);
    }
  }
  std::erase_if(candidates_, [&](const Mover& m) { return time - m.last_seen > kForget; });
  movers_.clear();
  for (const Mover& m : candidates_) {
    if (m.moves) movers_.push_back(m);
  }
}

void LocalMap::measure_distances() {
  const auto nx = static_cast<std::size_t>(kSize[0]);
  const auto ny = static_cast<std::size_t>(kSize[1]);
  const auto nz = static_cast<std::size_t>(kSize[2]);
  distance_.assign(score_.size(), 1e6f);
  for (std::size_t i = 0; i < score_.size(); ++i) {
    if (score_[i] > 0) distance_[i] = 0.0f;
  }
  std::vector<float> line(std::max({nx, ny, nz}));
  const auto along = [&](std::size_t n, std::size_t stride, std::size_t first) {
    for (std::size_t i = 0; i < n; ++i) line[i] = distance_[first + i * stride];
    transform_line(line, n);
    for (std::size_t i = 0; i < n; ++i) distance_[first + i * stride] = line[i];
  };
  for (std::size_t z = 0; z < nz; ++z) {
    for (std::size_t y = 0; y < ny; ++y) along(nx, 1, (z * ny + y) * nx);
    for (std::size_t x = 0; x < nx; ++x) along(ny, nx, z * ny * nx + x);
  }
  for (std::size_t i = 0; i < nx * ny; ++i) along(nz, nx * ny, i);
}

double LocalMap::distance(const Vector3d& p) const {
  if (!contains(p)) return 0.0;
  const double cells = std::sqrt(static_cast<double>(distance_[index_of(p)]));
  return std::min(kDistanceMax, kCell * cells);
}

double LocalMap::distance_between(const Vector3d& p) const {
  const Vector3d corner = p - Vector3d::Constant(0.5 * kCell);
  const Vector3d low = kCell * (corner / kCell).array().floor().matrix();
  const Vector3d share = (corner - low) / kCell;
  double sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    double weight = 1.0;
    Vector3d q = low + Vector3d::Constant(0.5 * kCell);
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_next = (i >> axis & 1) != 0;
      weight *= is_next ? share[axis] : 1.0 - share[axis];
      q[axis] += is_next ? kCell : 0.0;
    }
    if (weight > 0.0) sum += weight * distance(q);
  }
  return sum;
}

}  // namespace planner
