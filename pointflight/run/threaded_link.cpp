#include "pointflight/run/threaded_link.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace pointflight {
namespace {

constexpr std::chrono::microseconds kEmptyStep{5000};

}  // namespace

ThreadedLink::ThreadedLink(Link& link, const Options& options) : link_(link), options_(options) {
  if (options.capacity == 0) throw std::invalid_argument("a queue needs room for a sample");
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
  hold(sample);
  if (std::holds_alternative<ScanSample>(sample)) hand_on();  // it is worth a thread's waking
}

void ThreadedLink::on_step(const StepDone& step) {
  hold(step);
  // a step that brought nothing has time
  const auto wait = held_.size() > 1 ? options_.hold : std::max(options_.hold, kEmptyStep);
  if (std::chrono::steady_clock::now() - handed_on_ >= wait) hand_on();
}

void ThreadedLink::on_wait(SimTime now, Waiting why) {
  if (why == Waiting::kForLinks) return link_.on_wait(now, why);
  hold(Waited{now, why});
  hand_on();
}

void ThreadedLink::on_rejected(const VehicleOrder& order, const std::string& why) {
  hold(Rejected{order, why});
}

void ThreadedLink::on_reset(SimTime reached) {
  hold(Reset{reached});
  hand_on();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (queue_.empty() && !is_busy_) || failure_; });
}

void ThreadedLink::on_seek(SimTime to) {
  hold(Seek{to});
  hand_on();
}

std::vector<Order> ThreadedLink::take_orders() {
  rethrow();
  return link_.take_orders();
}

std::uint64_t ThreadedLink::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_ + link_.dropped();
}

/// Steps without samples between them, looks while the run waits: the later one says it all, but
/// for the scans of the earlier. False if both have to stay.
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

/// What an event takes of the queue's room.
std::size_t ThreadedLink::size_of(const Event& event) {
  constexpr std::size_t kPoints = 1000;
  const auto* sample = std::get_if<Sample>(&event);
  if (sample == nullptr) return 0;
  const auto* scanned = std::get_if<ScanSample>(sample);
  return scanned == nullptr ? 1 : 1 + scanned->scan->points.size() / kPoints;
}

/// The oldest sample goes.
void ThreadedLink::drop_sample() {
  const auto oldest = std::find_if(queue_.begin(), queue_.end(), [](const Event& e) {
    return std::holds_alternative<Sample>(e);
  });
  size_ -= size_of(*oldest);
  const auto next = queue_.erase(oldest);
  // what stood around it may be one now, so that the queue stays as short as it is bounded
  if (next != queue_.begin() && next != queue_.end() && merge(*std::prev(next), *next)) {
    queue_.erase(std::prev(next));
  }
  ++dropped_;
}

void ThreadedLink::make_room(std::unique_lock<std::mutex>& lock, std::size_t size) {
  const auto has_room = [&] { return size_ == 0 || size_ + size <= options_.capacity; };
  if (options_.when_full == WhenFull::kWait) {
    if (!has_room()) changed_.notify_all();  // of what was put there before
    changed_.wait(lock, [&] { return has_room() || failure_; });
  } else {
    while (!has_room()) drop_sample();
  }
}

void ThreadedLink::hold(Event event) {
  if (!held_.empty() && merge(held_.back(), event)) held_.pop_back();
  held_.push_back(std::move(event));
}

/// Puts what was held back into the queue.
void ThreadedLink::hand_on() {
  handed_on_ = std::chrono::steady_clock::now();
  std::vector<Event> events = std::exchange(held_, {});
  std::unique_lock lock(mutex_);
  if (!thread_.joinable()) return;
  for (Event& event : events) {
    if (const std::size_t size = size_of(event); size > 0) {
      make_room(lock, size);
      size_ += size;
    } else if (!queue_.empty() && merge(queue_.back(), event)) {
      queue_.pop_back();
    }
    if (failure_) return;
    queue_.push_back(std::move(event));
  }
  changed_.notify_all();
}

void ThreadedLink::work() {
  try {
    std::unique_lock lock(mutex_);
    for (;;) {
      is_busy_ = false;
      if (queue_.empty()) changed_.notify_all();
      changed_.wait(lock, [this] { return !queue_.empty() || ends_; });
      if (queue_.empty()) return;
      is_busy_ = true;
      const Event event = std::move(queue_.front());
      queue_.pop_front();
      size_ -= size_of(event);
      if (options_.when_full == WhenFull::kWait) changed_.notify_all();
      lock.unlock();
      hand_over(event);
      lock.lock();
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
  if (failure_) std::rethrow_exception(failure_);
}

void ThreadedLink::close() {
  hand_on();
  stop();
  rethrow();  // what it could not take whole it does not end as if it were
  link_.close();
}

}  // namespace pointflight
