#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace pointflight {

/// What another process' clock says, from messages there and back (RFC 5905, section 8): of those
/// of the last seconds the one that took least is the most exact. All in ns; both clocks run at
/// `rate` of this process' steady clock.
class ClockEstimate {
 public:
  /// `rate`: simulated seconds per second.
  explicit ClockEstimate(double rate) : rate_(rate) {}

  /// A message came at `arrived` (own steady clock) in which the other's clock said `clock`, and
  /// which answers one that was sent at `sent` and was held for `held` by the other.
  void add(std::int64_t sent, std::int64_t held, std::int64_t arrived, std::int64_t clock);
  /// Nothing of before holds.
  void clear() { samples_.clear(); }

  /// The other's clock and by how much that may be off.
  struct Reading {
    std::int64_t clock;  ///< ns of the run.
    std::int64_t error;  ///< Half of the way there and back, ns.
  };
  /// At an instant of the own steady clock.
  [[nodiscard]] std::optional<Reading> at(std::int64_t steady) const;

 private:
  struct Sample {
    std::int64_t round;   ///< Way there and back.
    std::int64_t steady;  ///< Own steady clock when the other's said `clock`.
    std::int64_t clock;
  };
  double rate_;
  std::deque<Sample> samples_;
};

}  // namespace pointflight
