#include "pointflight/picture/perspective.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "pointflight/core/constants.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight::picture {
namespace {

constexpr double kField = 45.0 * kDegree;      // across the picture's width
constexpr double kElevation = 38.0 * kDegree;  // of the eye over what it looks at
constexpr double kAzimuth = 235.0 * kDegree;   // where the eye is: south west
constexpr double kHidden = 0.3;                // m behind what is seen

}  // namespace

Perspective::Perspective(
    const SurfelMap& map, const Aabb& shown, double cut, const Frame& frame, int samples)
    : frame_(frame),
      samples_(samples),
      columns_(samples * static_cast<int>(frame.width)),
      rows_(samples * static_cast<int>(frame.height)) {
  Aabb box = shown;
  box.max.z() = std::max(box.min.z() + 0.5, std::min(box.max.z(), cut));
  const Vector3d target = 0.5 * (box.min + box.max);
  const Vector3d back(std::cos(kElevation) * std::cos(kAzimuth),
                      std::cos(kElevation) * std::sin(kAzimuth),
                      std::sin(kElevation));
  // so far that it looks natural; then what is there fills the picture
  const double away = 0.5 * box.size().norm() / std::tan(0.5 * kField);
  eye_ = target + away * back;
  look(target);
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p((corner & 1) != 0 ? box.max.x() : box.min.x(),
                     (corner & 2) != 0 ? box.max.y() : box.min.y(),
                     (corner & 4) != 0 ? box.max.z() : box.min.z());
    const Vector3d q = axes_ * (p - eye_);
    const Eigen::Vector2d at = q.head<2>() / std::max(q.z(), 0.1 * away);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  focal_ = 0.97 * std::min(frame.width / (high.x() - low.x()), frame.height / (high.y() - low.y()));
  middle_ = 0.5 * Eigen::Vector2d(frame.width, frame.height) - 0.5 * focal_ * (low + high);
  render(map, cut, {});
}

Perspective::Perspective(const SurfelMap& map,
                         const Eye& eye,
                         double cut,
                         const Frame& frame,
                         const MovingThings& things,
                         int samples)
    : frame_(frame),
      samples_(samples),
      columns_(samples * static_cast<int>(frame.width)),
      rows_(samples * static_cast<int>(frame.height)),
      eye_(eye.position),
      focal_(0.5 * frame.width / std::tan(0.5 * eye.field_deg * kDegree)),
      middle_(0.5 * frame.width, 0.5 * frame.height) {
  look(eye.target);
  render(map, cut, things);
}

/// Turns the eye.
void Perspective::look(const Vector3d& target) {
  const Vector3d ahead = (target - eye_).normalized();
  const Vector3d right = ahead.cross(Vector3d::UnitZ()).normalized();
  axes_.row(0) = right;
  axes_.row(1) = ahead.cross(right);
  axes_.row(2) = ahead;
}

Vector3d Perspective::direction(double x, double y) const {
  return (axes_.transpose() * Vector3d(x - middle_.x(), y - middle_.y(), focal_)).normalized();
}

/// Some rows at a time: a page's rays together would take more memory than a flight.
void Perspective::render(const SurfelMap& map, double cut, const MovingThings& things) {
  constexpr float kFarthest = 2000.0f;  // m
  constexpr std::size_t kRowsAtOnce = 32;
  const auto columns = static_cast<std::size_t>(columns_);
  const std::size_t count = columns * static_cast<std::size_t>(rows_);
  seen_.assign(count, {});
  // not owned: it outlives the renderer
  const std::shared_ptr<const SurfelMap> shared(std::shared_ptr<void>(), &map);
  const auto renderer = make_renderer("beam", Scene{shared});
  const Executor executor(0);
  std::vector<Ray> rays;
  std::vector<float> before;  // from the eye to where a ray begins
  std::vector<Hit> hits;
  for (std::size_t first = 0; first < count; first += kRowsAtOnce * columns) {
    const std::size_t now = std::min(kRowsAtOnce * columns, count - first);
    rays.resize(now);
    before.assign(now, 0.0f);
    hits.assign(now, {});
    for (std::size_t i = 0; i < now; ++i) {
      const std::size_t row = (first + i) / columns;
      const std::size_t column = (first + i) % columns;
      const Vector3d d = direction((static_cast<double>(column) + 0.5) / samples_,
                                   (static_cast<double>(row) + 0.5) / samples_);
      const double above = d.z() < 0.0 ? std::max(0.0, (cut - eye_.z()) / d.z()) : 0.0;
      before[i] = std::isfinite(above) ? static_cast<float>(above) : 0.0f;
      rays[i].origin_world = eye_ + static_cast<double>(before[i]) * d;
      rays[i].direction_world = d.cast<float>();
      rays[i].range_max = kFarthest;
    }
    RayBatch batch;
    batch.rays = rays;
    batch.range_max = kFarthest;
    batch.draws.scan = first;  // else rows repeat what glass and leaves let through
    batch.bodies = things.bodies;
    batch.time = batch.snapshot_time = things.time;
    renderer->render(batch, hits, executor);
    for (std::size_t i = 0; i < now; ++i) {
      if (!hits[i].is_return()) continue;
      seen_[first + i] = {before[i] + hits[i].range,
                          hits[i].cos_incidence,
                          static_cast<float>(rays[i].origin_world.z()) +
                              hits[i].range * rays[i].direction_world.z(),
                          hits[i].label,
                          hits[i].surfel,
                          map.is_assumed(hits[i].surfel)};
    }
  }
}

void Perspective::paint(Canvas& canvas,
                        const std::function<Color(double z)>& color_at,
                        const std::function<Color(Label)>& color_of) const {
  paint_seen(canvas, [&](const Seen& seen, const Vector3d& /*direction*/) {
    const double light = 0.35 + 0.65 * static_cast<double>(seen.cosine);
    const bool moves = seen.label != kMapLabel && color_of;
    const Color c = moves             ? color_of(seen.label)
                    : seen.is_assumed ? kAssumedColor
                                      : color_at(static_cast<double>(seen.z));
    return Color{light * c.r, light * c.g, light * c.b};
  });
}

void Perspective::paint_seen(
    Canvas& canvas, const std::function<Color(const Seen&, const Vector3d&)>& color_of) const {
  canvas.begin_pixels();
  for (int y = 0; y < rows_ / samples_; ++y) {
    for (int x = 0; x < columns_ / samples_; ++x) {
      Color sum{0.0, 0.0, 0.0};
      int hits = 0;
      for (int i = 0; i < samples_ * samples_; ++i) {
        const int row = y * samples_ + i / samples_;
        const int column = x * samples_ + i % samples_;
        const Seen& seen =
            seen_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
        if (seen.range < 0.0f) continue;
        const Color c =
            color_of(seen, direction((column + 0.5) / samples_, (row + 0.5) / samples_));
        sum = {sum.r + c.r, sum.g + c.g, sum.b + c.b};
        ++hits;
      }
      if (hits == 0) continue;
      canvas.put(static_cast<int>(frame_.left) + x,
                 static_cast<int>(frame_.top) + y,
                 {sum.r / hits, sum.g / hits, sum.b / hits},
                 static_cast<double>(hits) / (samples_ * samples_));
    }
  }
  canvas.end_pixels();
}

std::optional<Vector3d> Perspective::project(const Vector3d& p_world) const {
  const Vector3d q = axes_ * (p_world - eye_);
  if (q.z() <= 0.01) return std::nullopt;
  return Vector3d(
      middle_.x() + focal_ * q.x() / q.z(), middle_.y() + focal_ * q.y() / q.z(), q.norm());
}

bool Perspective::is_hidden(const Vector3d& projected) const {
  const int x = static_cast<int>(std::floor(samples_ * projected.x()));
  const int y = static_cast<int>(std::floor(samples_ * projected.y()));
  if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return true;
  const float range = seen_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                            static_cast<std::size_t>(x)]
                          .range;
  return range >= 0.0f && static_cast<double>(range) < projected.z() - kHidden;
}

std::optional<std::pair<double, double>> Perspective::visible(const Vector3d& p_world) const {
  const auto q = project(p_world);
  if (!q || is_hidden(*q)) return std::nullopt;
  return std::pair(frame_.left + q->x(), frame_.top + q->y());
}

void Perspective::draw_path(Canvas& canvas,
                            const std::vector<Vector3d>& points,
                            Color color) const {
  constexpr double kFaint = 0.3;
  std::vector<std::pair<double, double>> piece;
  bool hidden = false;
  const auto flush = [&] {
    if (piece.size() > 1) {
      if (!hidden) canvas.line(piece, 4.5, kPaper, 0.8);
      canvas.line(piece, 2.2, color, hidden ? kFaint : 1.0);
    }
  };
  canvas.begin_clip(frame_.left, frame_.top, frame_.width, frame_.height);
  for (const Vector3d& p : points) {
    const auto q = project(p);
    const bool now = q && is_hidden(*q);
    if (!q || now != hidden) {
      flush();
      // a piece begins where the last one ended
      const auto last = piece.empty() ? std::nullopt : std::optional(piece.back());
      piece.clear();
      if (q && last) piece.push_back(*last);
      hidden = now;
    }
    if (q) piece.emplace_back(frame_.left + q->x(), frame_.top + q->y());
  }
  flush();
  canvas.end_clip();
}

double ceiling_cut(const MapLayers& layers) {
  constexpr int kPlaces = 24;     // along each side
  constexpr double kStep = 0.1;   // m
  constexpr double kBelow = 0.3;  // m
  if (!layers.has_ceiling()) return std::numeric_limits<double>::infinity();
  std::vector<double> heights;
  const Aabb& box = layers.box();
  for (int i = 0; i < kPlaces * kPlaces; ++i) {
    Vector3d p = box.min;
    const int row = i / kPlaces;
    p.x() += (i % kPlaces + 0.5) / kPlaces * box.size().x();
    p.y() += (row + 0.5) / kPlaces * box.size().y();
    for (p.z() = layers.floor_at(p); p.z() < box.max.z(); p.z() += kStep) {
      if (!layers.is_ceiling(p)) continue;
      heights.push_back(p.z());
      break;
    }
  }
  if (heights.empty()) return std::numeric_limits<double>::infinity();
  const auto low = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 10);
  std::nth_element(heights.begin(), low, heights.end());
  return *low - kBelow;
}

}  // namespace pointflight::picture
