#include "pointflight/share/dds/share_transport.hpp"

namespace {

const pointflight::DdsModule kModule = {pointflight::make_dds_share_transport};

}  // namespace

/// What the program asks for after it has loaded this library.
extern "C" __attribute__((visibility("default"))) const pointflight::DdsModule*
pointflight_dds_module() {
  return &kModule;
}
