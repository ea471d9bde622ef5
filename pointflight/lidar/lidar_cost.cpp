#include "pointflight/lidar/lidar_cost.hpp"

#include "pointflight/lidar/footprint.hpp"

namespace pointflight {
namespace {

// CPU time per beam with all that a flight makes of it (`./dev bench defaults`), s
constexpr double kLine = 0.5e-6;
constexpr double kLineOfImage = 0.3e-6;  // of a grid, whose rays lie close together
constexpr double kWideInHall = 0.9e-6;
constexpr double kWideInForest = 1.15e-6;

}  // namespace

LidarCostClass cost_class_of(const LidarSettings& settings, double beams_per_second) {
  LidarCostClass cost;
  cost.wide = !Footprint(settings.optics).is_line();
  const bool is_image = settings.pattern == ScanPattern::kGrid;
  cost.line = (is_image ? kLineOfImage : kLine) * beams_per_second;
  cost.low = cost.wide ? kWideInHall * beams_per_second : cost.line;
  cost.high = cost.wide ? kWideInForest * beams_per_second : cost.line;
  cost.name = cost.high < 0.2   ? "light"
              : cost.high < 0.5 ? "moderate"
              : cost.high < 1.0 ? "heavy"
                                : "very heavy";
  return cost;
}

}  // namespace pointflight
