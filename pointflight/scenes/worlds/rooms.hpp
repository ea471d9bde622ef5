// What rooms of several worlds have.
#pragma once

#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight::worlds {

/// A slab whose top is at z, with a rectangular hole if `hole` is not empty.
void add_slab(SceneBuilder& to, const char* name, const Aabb& box, const Aabb& hole = {});
/// From x, y, z to the opposite corner, m.
Aabb box_of(const Vector3d& min, const Vector3d& max);
/// Rows of lamps under a ceiling, along x.
void add_lamps(SceneBuilder& to, const Aabb& room, int rows, int columns);
/// How far a door is open, rad: most let a drone through, some do not.
double draw_door_angle(SceneBuilder& to);
/// A desk with a chair and a monitor, its user looking to +x.
void add_workplace(SceneBuilder& to);

}  // namespace pointflight::worlds
