#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <variant>
#include <vector>

#include "pointflight/run/link.hpp"

namespace pointflight {

/// Runs another link on a thread of its own behind a bounded queue, so that it can be slow or wait
/// without holding up the run. Its orders are obeyed at the end of a step after it gave them.
class ThreadedLink : public Link {
 public:
  /// What happens where the queue is full.
  enum class WhenFull {
    kDropOldest,  ///< The oldest sample goes and is counted; for live views.
    kWait         ///< The run waits; for records.
  };

  /// `link` must outlive it; `capacity` in samples, at least 1. Between the first step and `close`
  /// all calls of `link` come from its own thread but `is_over`, `is_in_use`, `dropped`,
  /// `wants_answer`, `objection` and `remedy_when_behind`, which must be callable from any thread.
  ThreadedLink(Link& link, std::size_t capacity, WhenFull when_full);
  ~ThreadedLink() override;

  void open(const RunDescription& run) override;
  bool is_ready() override;
  void on_sample(const Sample& sample) override;
  void on_step(const StepDone& step) override;
  void on_wait(SimTime now, Waiting why) override;
  [[nodiscard]] bool wants_answer(const Sample& sample) const override {
    return link_.wants_answer(sample);
  }
  std::vector<Order> take_orders() override;
  void on_rejected(const VehicleOrder& order, const std::string& why) override;
  [[nodiscard]] std::string objection(const Order& order) const override {
    return link_.objection(order);
  }
  /// Waits until the link has taken all that is queued: the run begins again then.
  void on_reset(SimTime reached) override;
  void on_seek(SimTime to) override;
  /// Waits until the link has taken all that is queued. Throws what it threw.
  void close() override;
  [[nodiscard]] bool is_over() const override { return link_.is_over(); }
  [[nodiscard]] bool is_in_use() const override { return link_.is_in_use(); }
  [[nodiscard]] std::string remedy_when_behind() const override {
    return link_.remedy_when_behind();
  }
  [[nodiscard]] std::uint64_t dropped() const override;

 private:
  struct Waited {
    SimTime now;
    Waiting why;
  };
  struct Rejected {
    VehicleOrder order;
    std::string why;
  };
  struct Reset {
    SimTime reached;
  };
  struct Seek {
    SimTime to;
  };
  using Event = std::variant<Sample, StepDone, Waited, Rejected, Reset, Seek>;

  static bool merge(const Event& earlier, Event& later);
  void drop_sample();
  void push(Event event);
  void work();
  void hand_over(const Event& event);
  void stop();
  void rethrow();

  Link& link_;
  std::size_t capacity_;
  WhenFull when_full_;
  std::thread thread_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Event> queue_;
  std::size_t samples_ = 0;  ///< In the queue.
  std::vector<Order> orders_;
  std::uint64_t dropped_ = 0;
  bool ends_ = false;
  std::exception_ptr failure_;
};

}  // namespace pointflight
