#include "pointflight/scenes/scene_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pointflight/geometry/rotation.hpp"
#include "pointflight/scenes/scene_class.hpp"

namespace pointflight {

int SceneBuilder::whole(int low, int high) {
  const double drawn = between(0.0, static_cast<double>(high - low + 1));
  return std::min(high, low + static_cast<int>(drawn));
}

SceneBuilder::Placed SceneBuilder::at(const Pose& T_parent_own) {
  frames_.push_back(frames_.back() * T_parent_own);
  return Placed(*this);
}

SceneBuilder::Placed SceneBuilder::at(const Vector3d& position, double yaw) {
  return at(Pose{quaternion_from_rpy(0.0, 0.0, yaw), position});
}

void SceneBuilder::begin(const std::string& name) {
  part(name);
  ++object_;
}

void SceneBuilder::part(const std::string& name) {
  auto at = std::find(scene_.tags.begin(), scene_.tags.end(), name);
  if (at == scene_.tags.end()) at = scene_.tags.insert(scene_.tags.end(), name);
  tag_ = static_cast<std::uint16_t>(at - scene_.tags.begin());
}

void SceneBuilder::add(const Shape& shape) {
  scene_.geometry.shapes.push_back(shape);
  scene_.shape_tag.push_back(tag_);
  scene_.shape_object.push_back(object_);
}

void SceneBuilder::triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  add(Triangle{moved(a), moved(b), moved(c)});
}

void SceneBuilder::rectangle(const Vector3d& corner,
                             const Vector3d& edge_u,
                             const Vector3d& edge_v) {
  const Vector3d far = corner + edge_u + edge_v;
  triangle(corner, corner + edge_u, far);
  triangle(corner, far, corner + edge_v);
}

void SceneBuilder::disc(const Vector3d& center, const Vector3d& normal, double radius) {
  add(Disc{moved(center), turned(normal).normalized(), radius});
}

void SceneBuilder::rod(const Vector3d& from, const Vector3d& to, double radius) {
  taper(from, to, radius, radius);
}

void SceneBuilder::taper(const Vector3d& from,
                         const Vector3d& to,
                         double radius_from,
                         double radius_to) {
  add(Cone{moved(from), moved(to), radius_from, radius_to});
}

void SceneBuilder::box(const Vector3d& min, const Vector3d& max) {
  const Vector3d size = max - min;
  const Vector3d x(size.x(), 0, 0);
  const Vector3d y(0, size.y(), 0);
  const Vector3d z(0, 0, size.z());
  rectangle(min, x, y);
  rectangle(min, x, z);
  rectangle(min, y, z);
  rectangle(max, -x, -y);
  rectangle(max, -x, -z);
  rectangle(max, -y, -z);
}

void SceneBuilder::ball(const Vector3d& center, double radius) {
  add(SceneSphere{moved(center), radius});
}

void SceneBuilder::pole(const Vector3d& from, const Vector3d& to, double radius) {
  pole(from, to, radius, radius);
}

void SceneBuilder::pole(const Vector3d& from,
                        const Vector3d& to,
                        double radius_from,
                        double radius_to) {
  taper(from, to, radius_from, radius_to);
  if (radius_from > 0.0) disc(from, to - from, radius_from);
  if (radius_to > 0.0) disc(to, to - from, radius_to);
}

void SceneBuilder::profile(const std::vector<Vector2d>& outline, double y_low, double y_high) {
  const auto corner = [&](std::size_t i, double y) {
    const Vector2d& p = outline[i % outline.size()];
    return Vector3d(p.x(), y, p.y());
  };
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector3d along = corner(i + 1, y_low) - corner(i, y_low);
    rectangle(corner(i, y_low), along, {0, y_high - y_low, 0});
  }
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    for (const double y : {y_low, y_high}) triangle(corner(0, y), corner(i, y), corner(i + 1, y));
  }
}

ExactScene SceneBuilder::finish(const Aabb& free) {
  scene_.shape_density.assign(scene_.geometry.shapes.size(), 1.0f);
  scene_.is_target.assign(scene_.geometry.shapes.size(), false);
  scene_.free = free;
  const RandomStream random(seed_, StreamId::kReflectivity, stream_);
  for (std::size_t i = 0; i < scene_.geometry.shapes.size(); ++i) {
    const std::uint8_t kind = class_number(scene_.tags[scene_.shape_tag[i]]);
    const SceneClass& row = scene_classes()[kind == 0 ? 0U : kind - 1U];
    // all of a thing that is of one class has the same
    const std::uint64_t thing = std::uint64_t{scene_.shape_object[i]} << 8 | kind;
    const auto drawn = static_cast<float>(random.uniform(thing));
    scene_.shape_reflectivity.push_back(row.dark + drawn * (row.bright - row.dark));
  }
  return std::move(scene_);
}

}  // namespace pointflight
