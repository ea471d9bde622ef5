#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace pointflight {

/// The simulation's own clock. It has no `now()`: nothing in the library reads the wall clock.
struct SimClock {
  using rep = std::int64_t;                                        ///< Nanoseconds.
  using period = std::nano;                                        ///< For std::chrono.
  using duration = std::chrono::nanoseconds;                       ///< Same as `Duration`.
  using time_point = std::chrono::time_point<SimClock, duration>;  ///< Same as `SimTime`.
  static constexpr bool is_steady = true;  ///< Simulated time never goes back.
};

/// Length of time in integer nanoseconds.
using Duration = std::chrono::nanoseconds;

/// Instant in integer nanoseconds since the start of the run.
using SimTime = SimClock::time_point;

/// Seconds, for arithmetic that ends in a physical quantity. Never compare or accumulate the
/// result.
inline double to_seconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}
/// Since the start of the run.
inline double to_seconds(SimTime time) {
  return to_seconds(time.time_since_epoch());
}

/// The nearest nanosecond to `seconds` (which must be finite and below 292 years).
inline Duration from_seconds(double seconds) {
  return Duration(std::llround(seconds * 1e9));
}

/// Instants of a periodic activity: `phase + k * period`, each rounded to a nanosecond by itself,
/// so that a rate that does not divide a second never drifts.
class Schedule {
 public:
  /// `rate_hz` is kept to a thousandth of a hertz; it must be at least 0.001.
  explicit Schedule(double rate_hz, Duration phase = Duration{0})
      : millihertz_(std::llround(rate_hz * 1000.0)), phase_(phase) {}

  /// The k-th instant, k = 0, 1, ...
  [[nodiscard]] SimTime at(std::int64_t k) const {
    constexpr __int128 kNanosecondsTimesThousand = 1'000'000'000'000;
    const __int128 scaled = static_cast<__int128>(k) * kNanosecondsTimesThousand + millihertz_ / 2;
    return SimTime(phase_ + Duration(static_cast<std::int64_t>(scaled / millihertz_)));
  }

  /// The first k whose instant is at `time` or later.
  [[nodiscard]] std::int64_t first_from(SimTime time) const {
    constexpr __int128 kNanosecondsTimesThousand = 1'000'000'000'000;
    const __int128 since = (time.time_since_epoch() - phase_).count();
    auto k = static_cast<std::int64_t>(since * millihertz_ / kNanosecondsTimesThousand);
    while (k > 0 && at(k - 1) >= time) --k;
    while (at(k) < time) ++k;
    return k < 0 ? 0 : k;
  }

 private:
  std::int64_t millihertz_;
  Duration phase_;
};

}  // namespace pointflight
