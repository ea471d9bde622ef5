#include "apps/fitted_sigma.hpp"

#include <fmt/format.h>

#include <cmath>

namespace pointflight::apps {

void print_sigma(const char* name, const FittedSigma& fitted, double scale, const char* unit) {
  if (fitted.shows()) {
    fmt::print(
        "{:<16} {:.3g} ± {:.1g} {}\n", name, scale * fitted.sigma, scale * fitted.error, unit);
  } else if (std::isfinite(fitted.error)) {
    fmt::print("{:<16} does not show: less than {:.2g} {}\n",
               name,
               scale * (fitted.sigma + 2.0 * fitted.error),
               unit);
  } else {
    fmt::print("{:<16} does not show\n", name);
  }
}

}  // namespace pointflight::apps
