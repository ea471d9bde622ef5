#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight {

Registry<WorldKind>& WorldKind::table() {
  static Registry<WorldKind> table = {worlds::historical_building(),
                                      worlds::large_office(),
                                      worlds::indoor_1(),
                                      worlds::indoor_2(),
                                      worlds::indoor_3(),
                                      worlds::simple_forest(),
                                      worlds::common_forest(),
                                      worlds::dense_forest(),
                                      worlds::simple_garage(),
                                      worlds::complex_garage(),
                                      worlds::power_line(),
                                      worlds::bridge(),
                                      worlds::mine(),
                                      worlds::warehouse(),
                                      worlds::street(),
                                      worlds::construction(),
                                      worlds::two_storey_house(),
                                      worlds::cave()};
  return table;
}

}  // namespace pointflight
