#include "pointflight/core/math.hpp"

namespace pointflight::math {

double normal_quantile(double p) {
  // halved until it moves no more: 40 ends below any tail that a double can say
  double low = -40.0;
  double high = 40.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_probability(middle) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace pointflight::math
