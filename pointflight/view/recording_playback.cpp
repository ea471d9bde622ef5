#include "pointflight/view/recording_playback.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/run/playback.hpp"
#include "pointflight/view/order_inbox.hpp"

namespace pointflight {
namespace {

/// A recording, message by message to a server's clients.
class PlayableRecording : public Playable {
 public:
  PlayableRecording(TimedRecording& recording, LiveServer& server)
      : recording_(recording), server_(server), epoch_(recording.range().first) {
    for (const RecordedChannel& c : recording_.channels()) {
      foxglove::Channel channel;
      channel.topic = c.topic;
      channel.encoding = c.encoding;
      channel.schema_name = c.schema_name;
      channel.schema = c.schema;
      channel.schema_encoding = c.schema_encoding;
      channels_.push_back(server_.add_channel(std::move(channel), c.latched));
    }
    inbox_.take_orders_of(server_, {});
    inbox_.take_playback_of(server_, epoch_);
    recording_.seek(epoch_.count());
  }
  ~PlayableRecording() override { server_.close(); }  // its thread calls the inbox
  PlayableRecording(const PlayableRecording&) = delete;
  PlayableRecording& operator=(const PlayableRecording&) = delete;

  [[nodiscard]] SimTime end() const override {
    return SimTime(Duration(recording_.range().second) - epoch_);
  }

  [[nodiscard]] std::optional<SimTime> next_due() override {
    TimedMessage message;
    if (!waiting_ && recording_.next(message)) waiting_ = message;
    return waiting_ ? std::optional(time_of(*waiting_)) : std::nullopt;
  }

  bool play_next() override {
    const TimedMessage message = *std::exchange(waiting_, std::nullopt);
    send(message);
    return message.data.size() > kLarge;
  }

  void seek(SimTime to) override {
    waiting_.reset();
    const std::int64_t from = stamp(to) - kRunUp.count();
    recording_.latched_before(from, [this](const TimedMessage& message) { send(message); });
    recording_.seek(from);
    while (next_due() && *next_due() <= to) play_next();
  }

  void on_time(SimTime now) override { server_.publish_time(stamp(now)); }
  void on_status(const PlaybackStatus& status) override {
    server_.publish_playback(OrderInbox::state_of(status, epoch_));
  }
  std::vector<Order> take_orders() override { return inbox_.take(); }

  [[nodiscard]] bool has_newcomers() override {
    int subscriptions = 0;
    for (const std::uint32_t channel : channels_) {
      subscriptions += server_.subscriber_count(channel);
    }
    // once a client has asked for all that it wants
    const bool is_steady = subscriptions == std::exchange(subscriptions_, subscriptions);
    return is_steady && subscriptions > std::exchange(welcomed_, subscriptions);
  }

 private:
  /// Before the time that it is to show: so that poses and a scan of then are there.
  static constexpr Duration kRunUp = std::chrono::milliseconds(250);
  static constexpr std::size_t kLarge = 10'000;  // bytes: a message worth to stop at

  [[nodiscard]] SimTime time_of(const TimedMessage& message) const {
    return std::clamp(SimTime(Duration(message.time) - epoch_), SimTime{}, end());
  }
  [[nodiscard]] std::int64_t stamp(SimTime time) const {
    return (time.time_since_epoch() + epoch_).count();
  }

  void send(const TimedMessage& message) {
    const std::uint32_t channel = channels_[message.channel];
    const bool is_latched = recording_.channels()[message.channel].latched;
    if (is_latched) count_latched(message);
    if (!is_latched && !server_.has_subscribers(channel)) return;
    server_.publish(
        channel,
        std::make_shared<const std::vector<std::byte>>(message.data.begin(), message.data.end()),
        message.time);
  }

  /// The server keeps the last of each latched topic for clients that come later.
  void count_latched(const TimedMessage& message) {
    constexpr std::size_t kMost = std::size_t{512} << 20;  // bytes
    std::size_t& size = latched_[message.channel];
    latched_bytes_ += message.data.size() - std::exchange(size, message.data.size());
    if (latched_bytes_ <= kMost) return;
    throw InputError(fmt::format(
        "the recording's latched topics hold more than {} MiB together, which is not shown",
        kMost >> 20));
  }

  TimedRecording& recording_;
  LiveServer& server_;
  Duration epoch_;                       ///< Of its first message.
  std::vector<std::uint32_t> channels_;  ///< The server's, by the recording's.
  OrderInbox inbox_;
  std::optional<TimedMessage> waiting_;         ///< The next one.
  std::map<std::size_t, std::size_t> latched_;  ///< Bytes of the last message, by channel.
  std::size_t latched_bytes_ = 0;               ///< Of them together.
  int subscriptions_ = 0;                       ///< When it last looked.
  int welcomed_ = 0;                            ///< Of them.
};

}  // namespace

void play(TimedRecording& recording, LiveServer& server, const std::function<bool()>& interrupted) {
  PlayableRecording playable(recording, server);
  while (!interrupted() && !playable.has_newcomers()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  PlaybackOptions options;
  options.rate = 1.0;
  options.interrupted = interrupted;
  options.controlled = true;
  play(playable, options);
}

}  // namespace pointflight
