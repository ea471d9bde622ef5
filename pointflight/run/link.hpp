#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/run/order.hpp"
#include "pointflight/sim/run_description.hpp"

namespace pointflight {

/// A step that was done.
struct StepDone {
  SimTime time;             ///< Start of the next step.
  double took = 0.0;        ///< s by the wall clock.
  std::uint64_t scans = 0;  ///< That were delivered in it.
};

/// Why the run stands still.
enum class Waiting {
  kForLinks,   ///< Not all are ready yet; about every 20 ms.
  kPaused,     ///< By an order; about every 20 ms.
  kForAnswer,  ///< In lockstep, for a command; about every 0.2 ms.
};

/// An external party to a run: ROS, a recording, files, a web page, a flight controller, another
/// process. Samples come in, orders go out. All calls come from the thread of the run's
/// loop (`RunLoop`), in this order: `open`, `is_ready` until it is, then for each step samples,
/// `on_step` and `take_orders`, at last `close`. A link with a thread of its own: `ThreadedLink`.
class Link : public SampleSink {
 public:
  /// The run is about to start; `run` is valid until `close` has returned. May throw InputError.
  virtual void open(const RunDescription& /*run*/) {}
  /// False while the run should not start yet. May throw InputError.
  virtual bool is_ready() { return true; }

  void on_sample(const Sample& /*sample*/) override {}
  /// All samples of a step have come.
  virtual void on_step(const StepDone& /*step*/) {}
  /// The run stands still at a time.
  virtual void on_wait(SimTime /*now*/, Waiting /*why*/) {}

  /// In lockstep: true if the run is to wait, after the step in which it came, until this link has
  /// answered the sample by an order that is an answer: a planner's command for a scan, a flight
  /// controller's for an IMU sample.
  [[nodiscard]] virtual bool wants_answer(const Sample& /*sample*/) const { return false; }
  /// While the run waits for this link's answer: returns once one may have come, at the latest
  /// after so long. False at once: it cannot tell, and will be asked again.
  virtual bool await_answer(std::chrono::microseconds /*at_most*/) { return false; }
  /// What this link asks for since it was last asked, in order; obeyed between steps.
  virtual std::vector<Order> take_orders() { return {}; }
  /// One of its commands was not taken, and why.
  virtual void on_rejected(const VehicleOrder& /*order*/, const std::string& /*why*/) {}

  /// Why an order cannot be obeyed as long as this link takes part, whoever gave it: a line for
  /// users; empty if it can.
  [[nodiscard]] virtual std::string objection(const Order& /*order*/) const { return {}; }

  /// The run is about to start again at time zero; it has come to `reached`.
  virtual void on_reset(SimTime /*reached*/) {}
  /// A run that is played back goes on at another time; nothing of what came before holds.
  virtual void on_seek(SimTime /*to*/) {}
  /// The run has ended: nothing comes any more.
  virtual void close() {}

  /// True once this link requires the run to end (an interrupt, a ROS master that is gone).
  [[nodiscard]] virtual bool is_over() const { return false; }
  /// False once nothing of the run reaches anybody through it: a recording that failed. A run ends
  /// where no link is in use any more.
  [[nodiscard]] virtual bool is_in_use() const { return true; }
  /// What users can do, besides making it cheaper, about a run that falls behind the wall clock,
  /// where the machine manages `rate`; empty: go at that.
  [[nodiscard]] virtual std::string remedy_when_behind(double /*rate*/) const { return {}; }
  /// How many samples or messages were dropped because a consumer was too slow.
  [[nodiscard]] virtual std::uint64_t dropped() const { return 0; }
};

}  // namespace pointflight
