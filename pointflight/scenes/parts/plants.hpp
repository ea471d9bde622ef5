// Plants: each stands at the origin of the present frame.
#pragma once

#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight::parts {

/// What a tree is like.
struct Tree {
  double height = 10.0;     ///< m
  double trunk = 0.2;       ///< Radius at the foot, m.
  double crown = 2.0;       ///< Radius, m.
  double crown_from = 0.4;  ///< Where the crown begins, of the height.
  int leaves = 300;         ///< Discs.
  double leaf = 0.06;       ///< Radius of the largest, m.
};
/// A trunk that forks, branches with twigs, leaves around their ends.
void add_broadleaf(SceneBuilder& to, const Tree& tree);
/// A straight trunk, whorls of branches that hang a little, needles along them.
void add_conifer(SceneBuilder& to, const Tree& tree);
/// Stems and leaves in a half ball.
void add_bush(SceneBuilder& to, double radius, int leaves);
/// A lying trunk with stumps of branches, along +x.
void add_fallen_trunk(SceneBuilder& to, double length, double radius);
/// A lump of rock, flat below.
void add_rock(SceneBuilder& to, double radius);
/// Blades of grass within a radius.
void add_grass(SceneBuilder& to, double radius, int blades, double height);

}  // namespace pointflight::parts
