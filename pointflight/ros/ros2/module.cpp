#include "pointflight/ros/ros2/transport.hpp"

namespace {

const pointflight::Ros2Module kModule = {pointflight::make_ros2_transport};

}  // namespace

/// What the program asks for after it has loaded this library.
extern "C" __attribute__((visibility("default"))) const pointflight::Ros2Module*
pointflight_ros2_module() {
  return &kModule;
}
