#pragma once

#include <memory>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// A roscpp node that looks for its master until it finds it.
std::unique_ptr<Transport> make_ros1_transport(const TransportOptions& options);

}  // namespace pointflight
