// Vehicles and people: each stands on z = 0 around the origin of the present frame, its front to
// +x.
#pragma once

#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight::parts {

/// Kinds of cars by their outlines.
enum class CarBody { kSedan, kHatchback, kVan };
void add_car(SceneBuilder& to, CarBody body);
/// A forklift truck, its fork `lifted` m high.
void add_forklift(SceneBuilder& to, double lifted = 0.1);
/// Someone who stands, or walks.
void add_person(SceneBuilder& to, double height = 1.75, bool walks = false);
/// A lorry with a box body.
void add_truck(SceneBuilder& to);

}  // namespace pointflight::parts
