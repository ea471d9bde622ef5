// The table of outputs.
#include "pointflight/ros/common/output_rows.hpp"

namespace pointflight {

Registry<OutputType>& output_types() {
  static Registry<OutputType> types = [] {
    Registry<OutputType> all;
    for (const auto& part : {leading_outputs(),
                             vehicle_outputs(),
                             navigation_outputs(),
                             lidar_outputs(),
                             trailing_outputs()}) {
      for (const OutputType& type : part) all.add(type);
    }
    return all;
  }();
  return types;
}

}  // namespace pointflight
