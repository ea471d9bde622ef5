#include "pointflight/run/playback.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "pointflight/run/run_loop.hpp"

namespace pointflight {
namespace {

/// One playback: where it is, and what it was told.
class Player {
 public:
  Player(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options)
      : run_(run), links_(links), options_(options), pace_(options.rate), rate_(options.rate) {}

  void play() {
    run_.rewind();
    pace_.restart_at(SimTime{});
    say(false);
    while (!ends_) {
      play_step();
      take_orders();
      if (time_ > run_.end()) {
        ends_ = ends_ || !options_.controlled;
        playing_ = false;
        if (!ends_ && !seek_) say(false);
      }
      while (options_.controlled && !playing_ && !seek_ && !ends_ && time_ >= shown_) stand_still();
      if (seek_) jump();
      if (ends_ || time_ < shown_) continue;
      pace_.wait_for(time_);
    }
  }

 private:
  static constexpr auto kLook = std::chrono::milliseconds(20);
  /// Before where it jumps to: so that states and a scan of then are there.
  static constexpr Duration kRunUp = std::chrono::milliseconds(250);

  void play_step() {
    SampleFunction sink([&](const Sample& sample) {
      for (Link* link : links_) link->on_sample(sample);
      scans_ += std::holds_alternative<ScanSample>(sample) ? 1 : 0;
    });
    run_.play_step(time_, sink);
    ends_ = is_over() || (time_ >= run_.end() && !options_.controlled);
    // the last step is not gone through
    const SimTime reached = ends_ ? time_ : time_ + run_.step();
    for (Link* link : links_) link->on_step({reached, 0.0, scans_});
    if (scans_ > 0 && step_once_) playing_ = step_once_ = false;
    scans_ = 0;
    time_ = reached;
    report(
        options_.progress, "playing", to_seconds(time_) / std::max(1e-9, to_seconds(run_.end())));
  }

  [[nodiscard]] bool is_over() const {
    return (options_.interrupted && options_.interrupted()) || nobody_listens(links_);
  }

  void take_orders() {
    for (Link* link : links_) {
      for (const Order& order : link->take_orders()) obey(order);
    }
  }

  void obey(const Order& order) {
    if (std::holds_alternative<EndOrder>(order)) ends_ = true;
    if (!options_.controlled) return;
    if (const auto* pause = std::get_if<PauseOrder>(&order)) {
      playing_ = !pause->pause;
      step_once_ = false;
      if (playing_ && time_ > run_.end()) seek_ = SimTime{};
      pace_.restart_at(time_);
      say(false);
    } else if (std::holds_alternative<StepOrder>(order)) {
      step_once_ = playing_ = true;
      pace_.restart_at(time_);
    } else if (const auto* rate = std::get_if<RateOrder>(&order)) {
      rate_ = rate->rate;
      pace_ = Pace(rate_);
      pace_.restart_at(time_);
      say(false);
    } else if (const auto* seek = std::get_if<SeekOrder>(&order)) {
      seek_ = std::clamp(seek->to, SimTime{}, run_.end());
    } else if (std::holds_alternative<ResetOrder>(order)) {
      seek_ = SimTime{};
    }
  }

  void stand_still() {
    for (Link* link : links_) link->on_wait(time_, Waiting::kPaused);
    std::this_thread::sleep_for(kLook);
    take_orders();
    ends_ = ends_ || is_over();
  }

  void jump() {
    shown_ = *seek_;
    seek_.reset();
    const Duration from = std::max(Duration{}, shown_.time_since_epoch() - kRunUp);
    time_ = SimTime(from / run_.step() * run_.step());
    run_.seek(time_);
    for (Link* link : links_) link->on_seek(time_);
    pace_.restart_at(shown_);
    say(true);
  }

  void say(bool did_seek) const {
    if (!options_.controlled || !options_.on_status) return;
    options_.on_status({std::max(time_, shown_), playing_, time_ > run_.end(), rate_, did_seek});
  }

  RecordedRun& run_;
  std::span<Link* const> links_;
  const PlaybackOptions& options_;
  Pace pace_;
  double rate_;
  SimTime time_;
  SimTime shown_;  ///< Up to here it goes as fast as it can.
  std::optional<SimTime> seek_;
  std::uint64_t scans_ = 0;
  bool playing_ = true;
  bool step_once_ = false;
  bool ends_ = false;
};

}  // namespace

void play(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options) {
  for (Link* link : links) link->open(run.description());
  const auto interrupted = [&] { return options.interrupted && options.interrupted(); };
  if (!wait_until_ready(links, SimTime{}, interrupted)) return;
  Player(run, links, options).play();
  close_links(links);
}

}  // namespace pointflight
