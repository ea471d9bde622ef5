#include "pointflight/view/recording_player.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace pointflight {
namespace {

constexpr auto kLook = std::chrono::milliseconds(20);
/// Before where it jumps to: so that poses and a scan of then are there.
constexpr Duration kRunUp = std::chrono::milliseconds(250);
constexpr std::size_t kLarge = 10'000;  // bytes: a message worth to stop at
/// Without a message for longer it looks around while it waits.
constexpr Duration kLongestWait = std::chrono::milliseconds(50);

}  // namespace

RecordingPlayer::RecordingPlayer(TimedRecording& recording, std::shared_ptr<LiveServer> server)
    : recording_(recording), server_(std::move(server)) {
  for (const RecordedChannel& c : recording_.channels()) {
    foxglove::Channel channel;
    channel.topic = c.topic;
    channel.encoding = c.encoding;
    channel.schema_name = c.schema_name;
    channel.schema = c.schema;
    channel.schema_encoding = c.schema_encoding;
    channels_.push_back(server_->add_channel(std::move(channel), c.latched));
  }
  const auto [first, last] = recording_.range();
  end_ = SimTime(Duration(last - first));
  inbox_.take_orders_of(*server_, {});
  inbox_.take_playback_of(*server_, Duration(first));
}

RecordingPlayer::~RecordingPlayer() {
  server_->close();
}

SimTime RecordingPlayer::time_of(const TimedMessage& message) const {
  const SimTime time(Duration(message.time - recording_.range().first));
  return std::clamp(time, SimTime{}, end_);
}

std::int64_t RecordingPlayer::stamp(SimTime time) const {
  return recording_.range().first + time.time_since_epoch().count();
}

void RecordingPlayer::play(const std::function<bool()>& interrupted) {
  recording_.seek(recording_.range().first);
  while (!interrupted()) {
    take_orders();
    welcome();
    const bool has_begun = welcomed_ > 0 || time_ > SimTime{};
    if (playing_ && has_begun) {
      play_on();
    } else {
      stand_still();
    }
  }
}

void RecordingPlayer::play_on() {
  if (!waiting_) {
    TimedMessage message;
    if (!recording_.next(message)) {
      playing_ = step_once_ = false;
      ended_ = true;
      time_ = end_;
      return say(false);
    }
    waiting_ = message;
  }
  // in steps through long gaps, so that orders are obeyed meanwhile
  const SimTime due = std::max(time_, time_of(*waiting_));
  const bool is_held = pace_.rate() > 0.0;
  const double step = to_seconds(kLongestWait) * pace_.rate();
  const SimTime until = is_held ? std::min(due, time_ + from_seconds(step)) : due;
  pace_.wait_for(until);
  time_ = until;
  server_->publish_time(stamp(time_));
  if (until < due) return;
  const TimedMessage message = *std::exchange(waiting_, std::nullopt);
  send(message);
  if (step_once_ && message.data.size() > kLarge) {
    playing_ = step_once_ = false;
    say(false);
  }
}

void RecordingPlayer::stand_still() {
  std::this_thread::sleep_for(kLook);
  pace_.restart_at(time_);
}

void RecordingPlayer::welcome() {
  int subscriptions = 0;
  for (const std::uint32_t channel : channels_) {
    subscriptions += server_->subscriber_count(channel);
  }
  // once a client has asked for all that it wants
  const bool is_steady = subscriptions == std::exchange(subscriptions_, subscriptions);
  if (!is_steady) return;
  if (subscriptions <= std::exchange(welcomed_, subscriptions)) return;
  if (playing_) return say(false);
  jump(time_);
}

void RecordingPlayer::take_orders() {
  for (const Order& order : inbox_.take()) obey(order);
}

void RecordingPlayer::obey(const Order& order) {
  if (const auto* pause = std::get_if<PauseOrder>(&order)) {
    playing_ = !pause->pause;
    step_once_ = false;
    if (playing_ && (ended_ || time_ == end_)) jump(SimTime{});
  } else if (std::holds_alternative<StepOrder>(order)) {
    playing_ = step_once_ = !ended_;
  } else if (const auto* rate = std::get_if<RateOrder>(&order)) {
    pace_ = Pace(rate->rate);
  } else if (const auto* seek = std::get_if<SeekOrder>(&order)) {
    return jump(seek->to);
  } else if (std::holds_alternative<ResetOrder>(order)) {
    return jump(SimTime{});
  }
  pace_.restart_at(time_);
  say(false);
}

void RecordingPlayer::jump(SimTime to) {
  time_ = std::clamp(to, SimTime{}, end_);
  ended_ = false;
  waiting_.reset();
  say(true);
  const std::int64_t from = stamp(time_) - kRunUp.count();
  recording_.latched_before(from, [this](const TimedMessage& message) { send(message); });
  recording_.seek(from);
  TimedMessage message;
  while (!waiting_ && recording_.next(message)) {
    if (time_of(message) > time_) {
      waiting_ = message;
    } else {
      send(message);
    }
  }
  pace_.restart_at(time_);
}

void RecordingPlayer::send(const TimedMessage& message) {
  const std::uint32_t channel = channels_[message.channel];
  if (!recording_.channels()[message.channel].latched && !server_->has_subscribers(channel)) return;
  server_->publish(
      channel,
      std::make_shared<const std::vector<std::byte>>(message.data.begin(), message.data.end()),
      message.time);
}

void RecordingPlayer::say(bool did_seek) const {
  using Status = foxglove::PlaybackState::Status;
  foxglove::PlaybackState state;
  state.status = playing_ ? Status::kPlaying : Status::kPaused;
  if (ended_) state.status = Status::kEnded;
  state.time = stamp(time_);
  state.speed = static_cast<float>(pace_.rate());
  state.did_seek = did_seek;
  server_->publish_playback(state);
}

}  // namespace pointflight
