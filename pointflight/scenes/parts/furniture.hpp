// Furniture: each stands on z = 0 around the origin of the present frame, its front to +x.
#pragma once

#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight::parts {

/// Four legs and a top, m.
void add_table(SceneBuilder& to, double length, double width, double height = 0.74);
/// With a panel in front and a drawer unit.
void add_desk(SceneBuilder& to, double length = 1.6, double width = 0.8);
/// Four legs, a seat and a back.
void add_chair(SceneBuilder& to);
/// A seat with a back on a star of five feet.
void add_swivel_chair(SceneBuilder& to);
/// A screen on a foot.
void add_monitor(SceneBuilder& to, double width = 0.55);
/// Uprights and boards with what stands on them.
void add_shelf(SceneBuilder& to, double length, double depth, double height, int boards);
/// A closed box with doors that stand out by their handles.
void add_cabinet(SceneBuilder& to, double length, double depth, double height);
/// A seat, a back and arms.
void add_sofa(SceneBuilder& to, double length = 2.0);
/// A frame, a mattress, pillows.
void add_bed(SceneBuilder& to, double length = 2.0, double width = 1.6);
/// Two rails and rungs against +x, leaning by `lean` m.
void add_ladder(SceneBuilder& to, double height, double lean = 0.0);

}  // namespace pointflight::parts
