#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/run/link.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// Holds a run back to so many simulated seconds per second of the wall clock.
class Pace {
 public:
  /// 0: as fast as it goes.
  explicit Pace(double rate) : rate_(rate) {}

  /// From here on: at the start, after a pause.
  void restart_at(SimTime time);
  /// How long ago an instant was due, s; nothing if the run is not held back.
  [[nodiscard]] std::optional<double> late(SimTime time) const;
  /// The instant that is due at a time of the wall clock; nothing if the run is not held back.
  [[nodiscard]] std::optional<SimTime> due_at(std::chrono::steady_clock::time_point wall) const;
  /// From here on each instant is due so much earlier.
  void hurry(Duration by) { start_ -= by; }
  /// Waits until an instant is due; not for less than 2 ms.
  void wait_for(SimTime time) const;
  /// Where the run has fallen behind by a second, and when that has doubled: how far (s), and the
  /// rate that this machine manages.
  struct Behind {
    double seconds;  ///< s
    double rate;     ///< Simulated seconds per second since the start or the last pause.
  };
  /// Once for each time that it has doubled.
  std::optional<Behind> fallen_behind(SimTime time);

  /// As given.
  [[nodiscard]] double rate() const { return rate_; }

 private:
  using Clock = std::chrono::steady_clock;
  double rate_;
  double next_said_ = 1.0;  ///< s behind.
  Clock::time_point start_ = Clock::now();
  SimTime from_;
};

/// Delays of scans in bins of 0.1 ms up to 10 s: however long a run, they take the same memory.
class ScanDelays {
 public:
  /// One more, s.
  void add(double seconds);
  /// The delay that a share of all stayed below, s.
  [[nodiscard]] double below(double share) const;
  /// How many were added.
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  static constexpr double kBin = 1e-4;  // s
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(100000);
  std::uint64_t count_ = 0;
};

/// How a simulation is run.
struct RunOptions {
  double rate = 0.0;  ///< Simulated seconds per second; 0: as fast as it goes.
  /// Links are waited for so long until they have answered what they want to
  /// (`Link::wants_answer`), s; 0: they are not.
  double lockstep = 0.0;
  /// Lines for users: what the run fell behind, that it was paused.
  std::function<void(const std::string& line)> log;
  Progress progress;                  ///< Of the run's length.
  std::function<bool()> interrupted;  ///< True once the user wants it to end.
};

/// Turns a simulation into a run: steps it, hands its samples to links and obeys their orders
/// between steps, so that a run is a function of its orders and the steps that they came at. Pace,
/// pause and lockstep are waits around the steps; they change no number.
class RunLoop {
 public:
  /// The simulation must outlive the loop; its state is where a reset leads back to.
  RunLoop(Simulation& simulation, RunOptions options);

  /// Before `run`. The link must outlive the loop; links get samples in the order in which they
  /// were added.
  void add(Link& link);

  /// Opens the links, waits until they are ready, runs to the end and closes them; interrupted
  /// before the first step it closes none. Throws what links and simulation throw.
  RunEnd run();

  /// False if it was interrupted before its first step.
  [[nodiscard]] bool has_started() const { return has_started_; }
  /// Since the first step by the wall clock, s.
  [[nodiscard]] double wall_time() const;
  /// How much was simulated, s: what was before a reset, too.
  [[nodiscard]] double simulated() const;
  /// CPU time of all threads of this process since the first step, s.
  [[nodiscard]] double cpu_time() const;
  /// Where the run should be at a time of the wall clock; nothing before its first step, and where
  /// it is not held to the wall clock. From the loop's thread.
  [[nodiscard]] std::optional<SimTime> due_at(std::chrono::steady_clock::time_point wall) const;
  /// From a scan's end until it was handed over, if the run is held to the wall clock.
  [[nodiscard]] const ScanDelays& scan_delays() const { return delays_; }
  /// How often lockstep waited in vain for an answer.
  [[nodiscard]] std::uint64_t unanswered() const { return unanswered_; }
  /// Of all links: the one place that counts.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  class Splitter;
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool is_over() const;
  void after_step(double took);
  void ask(Link& link);
  void wait_for_answers();
  void take_orders();
  void obey(Link& link, const Order& order);
  [[nodiscard]] std::string objection(const Order& order) const;
  void say_rejected(std::size_t vehicle, const std::string& why);
  void wait_while_paused();
  void reset();
  void say_behind();
  [[nodiscard]] std::string dearest_lidar();
  void say(const std::string& line) const;

  Simulation& simulation_;
  RunOptions options_;
  SimulationState at_start_;
  RunDescription description_;
  Pace pace_;
  std::vector<Link*> links_;
  ScanDelays delays_;
  Clock::time_point started_ = Clock::now();
  Duration before_reset_{0};  ///< Simulated.
  double cpu_at_start_ = 0.0;
  std::optional<double> wall_time_;
  std::optional<double> cpu_time_;
  bool has_started_ = false;
  bool paused_ = false;
  bool step_once_ = false;  ///< While paused: until a scan has come.
  bool reset_ = false;
  bool ended_ = false;        ///< By an order.
  std::uint64_t scans_ = 0;   ///< In the step under way.
  std::vector<Link*> asked_;  ///< In lockstep: those that have not answered yet.
  std::uint64_t unanswered_ = 0;
  bool said_rejected_ = false;
  bool said_dearest_ = false;
};

/// True if nobody gets anything of a run, or a link ends it.
[[nodiscard]] bool nobody_listens(std::span<Link* const> links);

/// Waits for links that were opened, at time `now` of the run. False if the run is over before
/// its first step: deserted, or `is_over` while somebody was not ready.
[[nodiscard]] bool wait_until_ready(std::span<Link* const> links,
                                    SimTime now,
                                    const std::function<bool()>& is_over);

/// Closes all; then throws what the first threw that failed.
void close_links(std::span<Link* const> links);

}  // namespace pointflight
