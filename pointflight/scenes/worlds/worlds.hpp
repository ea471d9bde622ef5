// The worlds that are built in, one file each.
#pragma once

#include "pointflight/scenes/made_world.hpp"

namespace pointflight::worlds {

WorldKind simple_garage();
WorldKind complex_garage();
WorldKind warehouse();
WorldKind large_office();
WorldKind indoor_1();
WorldKind indoor_2();
WorldKind indoor_3();
WorldKind historical_building();
WorldKind two_storey_house();
WorldKind simple_forest();
WorldKind common_forest();
WorldKind dense_forest();
WorldKind street();
WorldKind power_line();
WorldKind construction();
WorldKind bridge();
WorldKind mine();
WorldKind cave();

}  // namespace pointflight::worlds
