#include "apps/surroundings_flags.hpp"

#include "apps/cli.hpp"
#include "apps/flags.hpp"

namespace pointflight::apps {

std::vector<CLI::Option*> add_surroundings_flags(CLI::App& app, Surroundings& surroundings) {
  std::vector<CLI::Option*> all = {
      app.add_option("--sun", surroundings.sun_klx, "Kilolux: 100 in full sun, 0 at night")
          ->check(within(0.0, 200.0))
          ->capture_default_str(),
      app.add_option("--reflectivity",
                     surroundings.reflectivity,
                     "Of surfaces of which the map does not say it; 0: it varies from surfel to "
                     "surfel, half of them above 0.15")
          ->check(within(0.0, 1.0))
          ->capture_default_str(),
      app.add_option(
             "--reflectivity-per-intensity",
             surroundings.reflectivity_per_intensity,
             "Of the map's surfaces, per unit of its intensity; 0: what the map says, if it does")
          ->check(within(0.0, 1e6))
          ->capture_default_str()};
  std::vector<CLI::Option*> weathers;
  const auto weather = [&](const char* name, const char* help, WeatherKind kind, bool by_rate) {
    auto* option = app.add_option_function<double>(
        name,
        [&surroundings, kind, by_rate](double figure) {
          WeatherSettings& w = surroundings.weather;
          w.kind = kind;
          (by_rate ? w.rate : w.visibility) = figure;
        },
        help);
    option->check(by_rate ? within(0.1, 200.0) : within(5.0, 1e5));
    for (CLI::Option* other : weathers) option->excludes(other);
    weathers.push_back(option);
    all.push_back(option);
  };
  weather("--fog", "Visibility in fog, m", WeatherKind::kFog, false);
  weather("--dust", "Visibility in dust, m", WeatherKind::kDust, false);
  weather("--rain", "Rain, mm/h", WeatherKind::kRain, true);
  weather("--snow", "Snow, mm of water per hour", WeatherKind::kSnow, true);
  return all;
}

}  // namespace pointflight::apps
