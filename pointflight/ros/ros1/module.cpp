#include "pointflight/ros/ros1/bag.hpp"
#include "pointflight/ros/ros1/transport.hpp"

namespace {

const pointflight::Ros1Module kModule = {pointflight::make_ros1_transport,
                                         pointflight::make_bag_writer,
                                         pointflight::read_bag,
                                         pointflight::read_bag_messages};

}  // namespace

/// What the program asks for after it has loaded this library.
extern "C" __attribute__((visibility("default"))) const pointflight::Ros1Module*
pointflight_ros1_module() {
  return &kModule;
}
