#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "pointflight/run/order.hpp"
#include "pointflight/vehicle/mission.hpp"

namespace pointflight {

/// An order as our page writes it: a JSON object with one of `goal` [x, y, z] (world, m),
/// `velocity` [ahead, left, up] (m/s) with `yaw_rate` (rad/s), `hover`, for the vehicle number
/// `vehicle`; or `pause` (true or false), `step`, `reset`, `rate` (simulated seconds per second, 0:
/// as fast as it goes), `seek` (of a playback: to a time of the run, s). `motions`: how each
/// vehicle flies to goals. Throws InputError with a line for the client.
Order page_order(std::string_view text, const std::vector<MotionLimits>& motions);

}  // namespace pointflight
