// Processes of a shared run in one: a bus in memory, whose ways take time, lose and are cut.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <set>
#include <vector>

#include "pointflight/share/share_transport.hpp"

namespace pointflight::testing {

/// What all send. `now` is a clock in ns, which the tests set forward or which runs by itself.
class Bus {
 public:
  explicit Bus(std::function<std::int64_t()> now) : now_(std::move(now)) {}

  std::int64_t delay = 0;  ///< ns, of each message.
  /// True if a message of one does not come to another.
  std::function<bool(std::size_t from, std::size_t to, ShareChannel)> loses;

  class End : public ShareTransport {
   public:
    End(Bus& bus, std::size_t number) : bus_(bus), number_(number) {}
    void send(ShareChannel channel, const Bytes& bytes) override {
      bus_.send(number_, channel, *bytes);
    }
    void repeat(const Bytes& bytes) override { bus_.repeat(number_, bytes); }
    std::vector<ShareArrival> take() override {
      std::vector<ShareArrival> arrivals = bus_.take(number_);
      std::erase_if(arrivals,
                    [this](const ShareArrival& a) { return ignored.count(a.writer) != 0; });
      return arrivals;
    }
    void ignore(std::uint64_t writer) override { ignored.insert(writer); }
    std::set<std::uint64_t> ignored;
    void wait(std::int64_t at_most) override { bus_.wait(number_, at_most); }
    [[nodiscard]] std::uint64_t bytes_sent() const override { return bus_.sent_[number_]; }

   private:
    Bus& bus_;
    std::size_t number_;
  };

  /// One more process.
  std::unique_ptr<End> join() {
    const std::lock_guard lock(mutex_);
    inboxes_.emplace_back();
    sent_.push_back(0);
    beats_.emplace_back();
    // whoever comes late gets the last introductions
    for (const Message& message : crew_) inboxes_.back().push_back(message);
    return std::make_unique<End>(*this, inboxes_.size() - 1);
  }

  /// To all, as if it came from a stranger, or from the process of a number.
  void shout(ShareChannel channel, std::vector<std::byte> bytes, std::size_t from = kStranger) {
    send(from, channel, bytes);
  }

  /// The lease of one has run out for another.
  void lose(std::size_t from, std::size_t to) {
    const std::lock_guard lock(mutex_);
    inboxes_[to].push_back({from, now_(), {ShareChannel::kMembers, {}, from, now_()}});
    arrived_.notify_all();
  }

  /// Who is dead tells nobody who it was.
  void forget(std::size_t from) {
    const std::lock_guard lock(mutex_);
    std::erase_if(crew_, [&](const Message& m) { return m.from == from; });
  }

  /// Whoever hears each other again learns who the others are.
  void tell_crew() {
    const std::lock_guard lock(mutex_);
    for (const Message& message : crew_) {
      for (std::size_t to = 0; to < inboxes_.size(); ++to) {
        if (to != message.from) inboxes_[to].push_back(message);
      }
    }
  }

 private:
  static constexpr std::size_t kStranger = 999;
  struct Message {
    std::size_t from;
    std::int64_t due;
    ShareArrival arrival;
  };

  void send(std::size_t from, ShareChannel channel, const std::vector<std::byte>& bytes) {
    const std::lock_guard lock(mutex_);
    if (from < sent_.size()) sent_[from] += bytes.size();
    const std::int64_t due = now_() + delay;
    const Message message{from, due, {channel, bytes, from, due}};
    if (channel == ShareChannel::kMembers && from < sent_.size()) {
      std::erase_if(crew_, [&](const Message& m) { return m.from == from; });
      crew_.push_back(message);
    }
    for (std::size_t to = 0; to < inboxes_.size(); ++to) {
      if (to == from || (loses && loses(from, to, channel))) continue;
      inboxes_[to].push_back(message);
    }
    arrived_.notify_all();
  }

  void repeat(std::size_t from, const Bytes& bytes) {
    const std::lock_guard lock(mutex_);
    beats_[from].bytes = bytes;
  }

  /// Of those that run: as if from threads of their own.
  void send_beats() {
    constexpr std::int64_t kPeriod = 20'000'000;
    std::vector<std::pair<std::size_t, Bytes>> due;
    {
      const std::lock_guard lock(mutex_);
      for (std::size_t from = 0; from < beats_.size(); ++from) {
        if (!beats_[from].bytes || now_() < beats_[from].next) continue;
        beats_[from].next = now_() + kPeriod;
        due.emplace_back(from, beats_[from].bytes);
      }
    }
    for (const auto& [from, bytes] : due) send(from, ShareChannel::kClock, *bytes);
  }

  std::vector<ShareArrival> take(std::size_t to) {
    send_beats();
    const std::lock_guard lock(mutex_);
    std::vector<ShareArrival> taken;
    std::deque<Message>& inbox = inboxes_[to];
    while (!inbox.empty() && inbox.front().due <= now_()) {
      taken.push_back(std::move(inbox.front().arrival));
      inbox.pop_front();
    }
    return taken;
  }

  void wait(std::size_t to, std::int64_t at_most) {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(
        lock, std::chrono::nanoseconds(at_most), [&] { return !inboxes_[to].empty(); });
  }

  std::function<std::int64_t()> now_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<std::deque<Message>> inboxes_;
  std::vector<Message> crew_;
  std::deque<std::uint64_t> sent_;
  struct Beat {
    Bytes bytes;
    std::int64_t next = 0;
  };
  std::deque<Beat> beats_;
};

}  // namespace pointflight::testing
