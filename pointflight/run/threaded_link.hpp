#pragma once

#include <chrono>
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
/// without holding up the run. Its orders are taken by the run's own thread, at the end of each
/// step.
class ThreadedLink : public Link {
 public:
  /// What happens if the queue is full.
  enum class WhenFull {
    kDropOldest,  ///< The oldest sample goes and is counted; for live views.
    kWait         ///< The run waits; for records.
  };
  /// Of the queue.
  struct Options {
    /// In samples; a scan counts as one for each 1,000 points. A sample that is
    /// larger than the whole queue waits until the queue is empty.
    std::size_t capacity = 1000;
    WhenFull when_full = WhenFull::kWait;  ///< Nothing is lost by default.
    /// Steps without a scan may be held back for so long by the wall clock, to be handed over
    /// together: a thread is not woken for each of them. Steps without any sample may always be
    /// held back for 5 ms.
    std::chrono::microseconds hold{0};
  };

  /// `link` must outlive it; throws std::invalid_argument for a capacity of 0. Between the first
  /// step and `close` all calls of `link` come from its own thread but `take_orders`, `is_over`,
  /// `is_in_use`, `dropped`, `wants_answer`, `objection` and `remedy_when_behind`, which must be
  /// callable from any thread.
  ThreadedLink(Link& link, const Options& options);
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
  [[nodiscard]] std::string remedy_when_behind(double rate) const override {
    return link_.remedy_when_behind(rate);
  }
  [[nodiscard]] std::uint64_t dropped() const override;

 private:
  struct Waited {
    SimTime now;
    Waiting why = Waiting::kPaused;
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

  [[nodiscard]] static std::size_t size_of(const Event& event);
  static bool merge(const Event& earlier, Event& later);
  void drop_sample();
  void hold(Event event);
  void hand_on();
  void make_room(std::unique_lock<std::mutex>& lock, std::size_t size);
  void work();
  void hand_over(const Event& event);
  void stop();
  void rethrow();

  Link& link_;
  Options options_;
  std::vector<Event> held_;  ///< Not in the queue yet; of the run's thread, as the next.
  std::chrono::steady_clock::time_point handed_on_{};
  std::thread thread_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Event> queue_;
  std::size_t size_ = 0;  ///< Of what is in the queue, as `capacity`.
  bool is_busy_ = false;  ///< The link is taking what was in the queue.
  std::uint64_t dropped_ = 0;
  bool ends_ = false;
  std::exception_ptr failure_;
};

}  // namespace pointflight
