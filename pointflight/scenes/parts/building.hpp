// What buildings are made of.
#pragma once

#include <vector>

#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight::parts {

/// A rectangular hole in a wall, m along it and above its foot. With glass: a window with a frame,
/// a mullion every `pane` m.
struct Opening {
  double from = 0.0;       ///< Along the wall.
  double to = 0.0;         ///< Along the wall.
  double bottom = 0.0;     ///< Above the wall's foot.
  double top = 0.0;        ///< Above the wall's foot.
  bool has_glass = false;  ///< It is a window.
  double pane = 1.2;       ///< From mullion to mullion.
};

/// From `from` to `to` (x and y, m) with openings in the order of their `from`, which do not
/// overlap.
struct Wall {
  Vector2d from = Vector2d::Zero();    ///< One end of its middle line.
  Vector2d to = Vector2d::UnitX();     ///< The other one.
  double bottom = 0.0;                 ///< z of its foot.
  double top = 3.0;                    ///< z of its top.
  double thickness = 0.15;             ///< m
  std::vector<Opening> openings = {};  ///< In it.
};
/// Its blocks, and frames and glass of its windows.
void add_wall(SceneBuilder& to, const Wall& wall);
/// A door's leaf in an opening of that wall, turned open by `angle` (rad) about its first end.
void add_door(SceneBuilder& to, const Wall& wall, const Opening& opening, double angle);

/// Round, with base and capital, on z = 0.
void add_column(SceneBuilder& to, double radius, double height);
/// An arch in the plane x = 0 between (0, -half, 0) and (0, half, 0): a half circle of radius
/// `half` on springings at `spring` m, the wall above it up to `top`, so thick.
void add_arch(SceneBuilder& to, double half, double spring, double top, double thickness);
/// A groined vault over a square bay of side 2 `half`, springing from z = 0.
void add_groin_vault(SceneBuilder& to, double half, double rise);
/// Steps up along +x from z = 0; solid.
void add_stairs(SceneBuilder& to, double width, double height, double going = 0.28);
/// Balusters that bulge, a plinth and a handrail, along y from 0.
void add_balustrade(SceneBuilder& to, double length, double height = 0.95);
/// Posts, two bars and a handrail between two points.
void add_railing(SceneBuilder& to,
                 const Vector3d& from,
                 const Vector3d& until,
                 double height = 1.0);
/// Through corners, with elbows as balls.
void add_pipe(SceneBuilder& to, const std::vector<Vector3d>& corners, double radius);

}  // namespace pointflight::parts
