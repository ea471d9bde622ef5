#pragma once

#include <string>

#include "pointflight/campaign/mpi_module.hpp"
#include "pointflight/ros/common/wire.hpp"
#include "pointflight/share/share_transport.hpp"

namespace pointflight::apps {

/// True if this build came with a module ("pointflight_ros1", "pointflight_ros2",
/// "pointflight_mpi", "pointflight_dds").
bool has_module(const std::string& name);

/// The library that speaks ROS 1, loaded when first asked for. Throws InputError that says what to
/// install if this build has none.
const Ros1Module& ros1_module();
/// The same for ROS 2.
const Ros2Module& ros2_module();
/// The same for MPI.
const MpiModule& mpi_module();
/// The same for runs that several processes share.
const DdsModule& dds_module();

}  // namespace pointflight::apps
