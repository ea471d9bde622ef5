#include "pointflight/run/threaded_link.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace pointflight {

ThreadedLink::ThreadedLink(Link& link, std::size_t capacity, WhenFull when_full)
    : link_(link), capacity_(capacity), when_full_(when_full) {
  if (capacity == 0) throw std::invalid_argument("a queue needs room for a sample");
}

ThreadedLink::~ThreadedLink() {
  stop();
}

void ThreadedLink::open(const RunDescription& run) {
  link_.open(run);
}

bool ThreadedLink::is_ready() {
  if (thread_.joinable()) return true;
  if (!link_.is_ready()) return false;
  thread_ = std::thread([this] { work(); });
  return true;
}

void ThreadedLink::on_sample(const Sample& sample) {
  push(sample);
}

void ThreadedLink::on_step(const StepDone& step) {
  push(step);
}

void ThreadedLink::on_wait(SimTime now, Waiting why) {
  if (why == Waiting::kForLinks) return link_.on_wait(now, why);
  push(Waited{now, why});
}

void ThreadedLink::on_rejected(const VehicleOrder& order, const std::string& why) {
  push(Rejected{order, why});
}

void ThreadedLink::on_reset(SimTime reached) {
  push(Reset{reached});
}

void ThreadedLink::on_seek(SimTime to) {
  push(Seek{to});
}

std::vector<Order> ThreadedLink::take_orders() {
  rethrow();
  const std::lock_guard lock(mutex_);
  return std::exchange(orders_, {});
}

std::uint64_t ThreadedLink::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_ + link_.dropped();
}

/// Steps without samples between them, looks while the run waits: the later one says it all, but
/// for the scans of the earlier. False where both have to stay.
bool ThreadedLink::merge(const Event& earlier, Event& later) {
  if (earlier.index() != later.index()) return false;
  if (auto* step = std::get_if<StepDone>(&later)) {
    const auto& before = std::get<StepDone>(earlier);
    if (step->scans == 0) step->took = before.took;
    step->scans += before.scans;
    return true;
  }
  return std::holds_alternative<Waited>(later) || std::holds_alternative<Reset>(later);
}

/// The oldest sample goes.
void ThreadedLink::drop_sample() {
  const auto oldest = std::find_if(queue_.begin(), queue_.end(), [](const Event& e) {
    return std::holds_alternative<Sample>(e);
  });
  const auto next = queue_.erase(oldest);
  // what stood around it may be one now, so that the queue stays as short as it is bounded
  if (next != queue_.begin() && next != queue_.end() && merge(*std::prev(next), *next)) {
    queue_.erase(std::prev(next));
  }
  --samples_;
  ++dropped_;
}

void ThreadedLink::push(Event event) {
  std::unique_lock lock(mutex_);
  if (!thread_.joinable() || failure_) return;
  if (std::holds_alternative<Sample>(event)) {
    if (when_full_ == WhenFull::kWait) {
      changed_.wait(lock, [this] { return samples_ < capacity_ || failure_; });
    } else if (samples_ >= capacity_) {
      drop_sample();
    }
    ++samples_;
  } else if (!queue_.empty() && merge(queue_.back(), event)) {
    queue_.pop_back();
  }
  queue_.push_back(std::move(event));
  changed_.notify_all();
}

void ThreadedLink::work() {
  try {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return !queue_.empty() || ends_; });
      if (queue_.empty()) return;
      const Event event = std::move(queue_.front());
      queue_.pop_front();
      samples_ -= std::holds_alternative<Sample>(event) ? 1 : 0;
      changed_.notify_all();
      lock.unlock();
      hand_over(event);
      auto orders = link_.take_orders();
      lock.lock();
      std::move(orders.begin(), orders.end(), std::back_inserter(orders_));
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    changed_.notify_all();
  }
}

void ThreadedLink::hand_over(const Event& event) {
  std::visit(Overloaded{[this](const Sample& sample) { link_.on_sample(sample); },
                        [this](const StepDone& step) { link_.on_step(step); },
                        [this](const Waited& waited) { link_.on_wait(waited.now, waited.why); },
                        [this](const Rejected& r) { link_.on_rejected(r.order, r.why); },
                        [this](const Reset& reset) { link_.on_reset(reset.reached); },
                        [this](const Seek& seek) { link_.on_seek(seek.to); }},
             event);
}

void ThreadedLink::stop() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void ThreadedLink::rethrow() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void ThreadedLink::close() {
  stop();
  link_.close();
  rethrow();
}

}  // namespace pointflight
