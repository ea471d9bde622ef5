// What stands in halls and outdoors.
#pragma once

#include <vector>

#include "pointflight/scenes/scene_builder.hpp"

namespace pointflight::parts {

/// A wooden pallet with boxes up to `height` m, around the origin.
void add_pallet(SceneBuilder& to, double height);
/// Uprights, beams and loads, along y from 0, so deep in x around 0.
struct PalletRack {
  int bays = 6;         ///< Along y.
  int levels = 4;       ///< With the floor.
  double bay = 2.7;     ///< m
  double level = 1.6;   ///< m
  double depth = 1.1;   ///< m
  double filled = 0.8;  ///< Share of places with a load.
};
void add_pallet_rack(SceneBuilder& to, const PalletRack& rack);
/// Standards, ledgers, braces and boards along y from 0, 1 m deep in x from 0.
void add_scaffold(SceneBuilder& to, int bays, int lifts);
/// A lattice tower with three pairs of arms along y. Where its wires hang: left and right of each
/// pair from the lowest on, then the top, m in the present frame.
std::vector<Vector3d> add_pylon(SceneBuilder& to, double height);
/// A wire between two points that sags so far in the middle: a parabola in so many pieces.
void add_wire(
    SceneBuilder& to, const Vector3d& from, const Vector3d& until, double sag, double radius);
/// A post with an arm to +x and a lamp.
void add_street_lamp(SceneBuilder& to, double height);
/// A lattice mast with a jib to +x and a counterjib.
void add_tower_crane(SceneBuilder& to, double height, double jib);
/// A square lattice of legs, bars and diagonals between two heights, so wide at each.
void add_lattice(SceneBuilder& to,
                 double low,
                 double high,
                 double wide_low,
                 double wide_high,
                 int fields,
                 double bar);
/// Steel in I shape from one point to another, `height` m high.
void add_girder(SceneBuilder& to, const Vector3d& from, const Vector3d& until, double height);

}  // namespace pointflight::parts
