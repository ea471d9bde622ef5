#include "pointflight/run/playback.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "pointflight/run/run_loop.hpp"

namespace pointflight {
namespace {

/// One playback: where it is, and what it was told.
class Player {
 public:
  Player(Playable& playable, const PlaybackOptions& options)
      : playable_(playable), options_(options), pace_(options.rate) {}

  void play() {
    pace_.restart_at(time_);
    say(false);
    while (!is_over()) {
      for (const Order& order : playable_.take_orders()) obey(order);
      if (playable_.has_newcomers()) welcome();
      const std::optional<SimTime> due = playable_.next_due();
      if (!due && !options_.controlled) return;
      if (!due && playing_) stop(playable_.end());
      if (playing_) {
        go_on(*due);
      } else {
        stand_still();
      }
    }
  }

 private:
  static constexpr auto kLook = std::chrono::milliseconds(20);
  /// Through long gaps it goes in steps of so long, so that orders are obeyed meanwhile.
  static constexpr double kLongestWait = 0.05;  // s

  [[nodiscard]] bool is_over() const {
    return ends_ || (options_.interrupted && options_.interrupted()) || playable_.is_over();
  }

  void obey(const Order& order) {
    if (std::holds_alternative<EndOrder>(order)) ends_ = true;
    if (!options_.controlled) return;
    if (const auto* pause = std::get_if<PauseOrder>(&order)) {
      playing_ = !pause->pause;
      step_once_ = false;
      if (playing_ && time_ >= playable_.end()) return seek(SimTime{});
    } else if (std::holds_alternative<StepOrder>(order)) {
      playing_ = step_once_ = playable_.next_due().has_value();
    } else if (const auto* rate = std::get_if<RateOrder>(&order)) {
      pace_ = Pace(rate->rate);
    } else if (const auto* to = std::get_if<SeekOrder>(&order)) {
      return seek(to->to);
    } else if (std::holds_alternative<ResetOrder>(order)) {
      return seek(SimTime{});
    } else {
      return;
    }
    pace_.restart_at(time_);
    say(false);
  }

  /// Somebody who comes while it stands still gets what holds there.
  void welcome() {
    if (playing_) return say(false);
    seek(time_);
  }

  void go_on(SimTime due) {
    due = std::max(time_, due);
    const Duration step = from_seconds(kLongestWait * pace_.rate());
    const SimTime until = pace_.rate() > 0.0 ? std::min(due, time_ + step) : due;
    pace_.wait_for(until);
    time_ = until;
    playable_.on_time(time_);
    if (until < due) return;
    const bool is_scan = playable_.play_next();
    const double length = std::max(1e-9, to_seconds(playable_.end()));
    report(options_.progress, "playing", to_seconds(time_) / length);
    if (step_once_ && is_scan) stop(time_);
  }

  void stop(SimTime at) {
    time_ = at;
    playing_ = step_once_ = false;
    say(false);
  }

  void stand_still() {
    playable_.on_wait(time_);
    std::this_thread::sleep_for(kLook);
    pace_.restart_at(time_);
  }

  void seek(SimTime to) {
    time_ = std::clamp(to, SimTime{}, playable_.end());
    say(true);  // first: viewers forget what they have
    playable_.seek(time_);
    pace_.restart_at(time_);
  }

  void say(bool did_seek) const {
    if (!options_.controlled) return;
    const bool has_ended = !playing_ && time_ >= playable_.end();
    playable_.on_status({time_, playing_, has_ended, pace_.rate(), did_seek});
  }

  Playable& playable_;
  const PlaybackOptions& options_;
  Pace pace_;
  SimTime time_;  ///< Reached.
  bool playing_ = true;
  bool step_once_ = false;
  bool ends_ = false;
};

/// A run's folder, step by step through links.
class PlayableRun : public Playable {
 public:
  PlayableRun(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options)
      : run_(run), links_(links), options_(options) {
    run_.rewind();
  }

  [[nodiscard]] SimTime end() const override { return run_.end(); }
  [[nodiscard]] std::optional<SimTime> next_due() override {
    return time_ < run_.end() + run_.step() ? std::optional(time_) : std::nullopt;
  }

  bool play_next() override {
    std::uint64_t scans = 0;
    SampleFunction sink([&](const Sample& sample) {
      for (Link* link : links_) link->on_sample(sample);
      scans += std::holds_alternative<ScanSample>(sample) ? 1 : 0;
    });
    run_.play_step(time_, sink);
    const SimTime next = time_ + run_.step();
    // the last step is not gone through
    const SimTime reached = time_ >= run_.end() ? time_ : next;
    for (Link* link : links_) link->on_step({reached, 0.0, scans});
    time_ = next;
    return scans > 0;
  }

  void seek(SimTime to) override {
    const Duration from = std::max(Duration{}, to.time_since_epoch() - kRunUp);
    time_ = SimTime(from / run_.step() * run_.step());
    run_.seek(time_);
    for (Link* link : links_) link->on_seek(time_);
    while (time_ < to) play_next();
  }

  void on_wait(SimTime now) override {
    for (Link* link : links_) link->on_wait(now, Waiting::kPaused);
  }
  void on_status(const PlaybackStatus& status) override {
    if (options_.on_status) options_.on_status(status);
  }
  std::vector<Order> take_orders() override {
    std::vector<Order> orders;
    for (Link* link : links_) {
      for (Order& order : link->take_orders()) orders.push_back(std::move(order));
    }
    return orders;
  }
  [[nodiscard]] bool is_over() const override { return nobody_listens(links_); }

 private:
  /// Before the time that it is to show: so that states and a scan of then are there.
  static constexpr Duration kRunUp = std::chrono::milliseconds(250);

  RecordedRun& run_;
  std::span<Link* const> links_;
  const PlaybackOptions& options_;
  SimTime time_;  ///< Of the next step.
};

}  // namespace

void play(Playable& playable, const PlaybackOptions& options) {
  Player(playable, options).play();
}

void play(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options) {
  for (Link* link : links) link->open(run.description());
  const auto interrupted = [&] { return options.interrupted && options.interrupted(); };
  if (!wait_until_ready(links, SimTime{}, interrupted)) return;
  PlayableRun playable(run, links, options);
  play(playable, options);
  close_links(links);
}

}  // namespace pointflight
