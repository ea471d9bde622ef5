#include "pointflight/run/run_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <thread>
#include <utility>

namespace pointflight {
namespace {

constexpr std::chrono::milliseconds kLook(20);  // while links are not ready, or the run paused
constexpr std::chrono::microseconds kAnswerLook(200);  // in lockstep
constexpr Duration kProgressPeriod = std::chrono::milliseconds(100);

}  // namespace

void Pace::restart_at(SimTime time) {
  start_ = Clock::now();
  from_ = time;
  next_said_ = 1.0;
}

std::optional<double> Pace::late(SimTime time) const {
  if (rate_ <= 0.0) return std::nullopt;
  const std::chrono::duration<double> since = Clock::now() - start_;
  return since.count() - to_seconds(time - from_) / rate_;
}

std::optional<SimTime> Pace::due_at(Clock::time_point wall) const {
  if (rate_ <= 0.0) return std::nullopt;
  return from_ + from_seconds(rate_ * std::chrono::duration<double>(wall - start_).count());
}

void Pace::wait_for(SimTime time) const {
  if (rate_ <= 0.0) return;
  const auto due = start_ + std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double>(to_seconds(time - from_) / rate_));
  if (due - Clock::now() > std::chrono::milliseconds(2)) std::this_thread::sleep_until(due);
}

std::optional<Pace::Behind> Pace::fallen_behind(SimTime time) {
  const double behind = late(time).value_or(0.0);
  if (behind < next_said_) return std::nullopt;
  const double passed = to_seconds(time - from_) / rate_;
  next_said_ = 2.0 * behind;
  return Behind{behind, rate_ * passed / (passed + behind)};
}

void ScanDelays::add(double seconds) {
  const double bin = std::clamp(seconds / kBin, 0.0, static_cast<double>(bins_.size() - 1));
  ++bins_[static_cast<std::size_t>(bin)];
  ++count_;
}

double ScanDelays::below(double share) const {
  std::uint64_t below = 0;
  std::size_t bin = 0;
  const auto wanted = static_cast<std::uint64_t>(share * static_cast<double>(count_));
  while (bin + 1 < bins_.size() && below + bins_[bin] <= wanted) below += bins_[bin++];
  return kBin * (static_cast<double>(bin) + 0.5);
}

/// Hands samples to all links; counts scans and measures how late they are.
class RunLoop::Splitter : public SampleSink {
 public:
  explicit Splitter(RunLoop& loop) : loop_(loop) {}

  void on_sample(const Sample& sample) override {
    for (Link* link : loop_.links_) {
      link->on_sample(sample);
      if (loop_.options_.lockstep > 0.0 && link->wants_answer(sample)) loop_.ask(*link);
    }
    if (const auto* status = std::get_if<StatusSample>(&sample)) {
      if (status->rejected > 0) loop_.say_rejected(status->vehicle, status->last_rejection);
    }
    const auto* scanned = std::get_if<ScanSample>(&sample);
    if (scanned == nullptr) return;
    ++loop_.scans_;
    if (const auto late = loop_.pace_.late(scanned->scan->end)) loop_.delays_.add(*late);
  }

 private:
  RunLoop& loop_;
};

RunLoop::RunLoop(Simulation& simulation, RunOptions options)
    : simulation_(simulation),
      options_(std::move(options)),
      at_start_(simulation.state()),
      pace_(options_.rate) {}

void RunLoop::add(Link& link) {
  links_.push_back(&link);
}

bool nobody_listens(std::span<Link* const> links) {
  const bool used = std::any_of(links.begin(), links.end(), [](Link* l) { return l->is_in_use(); });
  return (!links.empty() && !used) ||
         std::any_of(links.begin(), links.end(), [](Link* l) { return l->is_over(); });
}

bool wait_until_ready(std::span<Link* const> links,
                      SimTime now,
                      const std::function<bool()>& is_over) {
  for (;;) {
    const bool ready =
        std::all_of(links.begin(), links.end(), [](Link* l) { return l->is_ready(); });
    if (nobody_listens(links)) return false;
    if (ready) return true;  // an interrupt now ends a run that has begun
    if (is_over()) return false;
    for (Link* link : links) link->on_wait(now, Waiting::kForLinks);
    std::this_thread::sleep_for(kLook);
  }
}

void close_links(std::span<Link* const> links) {
  std::exception_ptr failure;
  for (Link* link : links) {
    try {
      link->close();
    } catch (...) {  // the others have what they took
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

RunEnd RunLoop::run() {
  description_ = describe_run(simulation_);
  for (Link* link : links_) link->open(description_);
  if (!wait_until_ready(links_, simulation_.time(), [this] { return is_over(); })) {
    simulation_.interrupt();
    return simulation_.end();
  }
  Splitter sink(*this);
  pace_.restart_at(simulation_.time());
  started_ = Clock::now();
  cpu_at_start_ = process_cpu_time();
  has_started_ = true;
  for (bool running = true; running;) {
    const auto began = Clock::now();
    running = simulation_.step(sink);
    after_step(std::chrono::duration<double>(Clock::now() - began).count());
    wait_while_paused();
    if (std::exchange(reset_, false) && !ended_) {
      reset();
      running = true;
    }
    if (is_over()) simulation_.interrupt();
    if (options_.lockstep <= 0.0) say_behind();
    pace_.wait_for(simulation_.time());
    if (simulation_.time().time_since_epoch() % kProgressPeriod == Duration{0}) {
      report(options_.progress,
             "flying",
             to_seconds(simulation_.time()) / to_seconds(simulation_.end_time()));
    }
  }
  wall_time_ = wall_time();
  cpu_time_ = cpu_time();
  close_links(links_);
  return simulation_.end();
}

std::optional<SimTime> RunLoop::due_at(Clock::time_point wall) const {
  return has_started_ ? pace_.due_at(wall) : std::nullopt;
}

double RunLoop::wall_time() const {
  return wall_time_.value_or(std::chrono::duration<double>(Clock::now() - started_).count());
}

double RunLoop::simulated() const {
  return to_seconds(before_reset_ + simulation_.simulated());
}

double RunLoop::cpu_time() const {
  return cpu_time_.value_or(process_cpu_time() - cpu_at_start_);
}

std::uint64_t RunLoop::dropped() const {
  std::uint64_t dropped = 0;
  for (const Link* link : links_) dropped += link->dropped();
  return dropped;
}

bool RunLoop::is_over() const {
  return ended_ || (options_.interrupted && options_.interrupted()) || nobody_listens(links_);
}

void RunLoop::after_step(double took) {
  const std::uint64_t scans = std::exchange(scans_, 0);
  for (Link* link : links_) link->on_step({simulation_.time(), took, scans});
  if (!asked_.empty()) wait_for_answers();
  if (scans > 0) step_once_ = false;
  take_orders();
}

void RunLoop::ask(Link& link) {
  if (std::find(asked_.begin(), asked_.end(), &link) == asked_.end()) asked_.push_back(&link);
}

void RunLoop::wait_for_answers() {
  const auto until = Clock::now() + std::chrono::duration<double>(options_.lockstep);
  while (!asked_.empty() && !paused_ && !reset_ && !is_over()) {
    if (!asked_.front()->await_answer(kAnswerLook)) std::this_thread::sleep_for(kAnswerLook);
    for (Link* link : links_) link->on_wait(simulation_.time(), Waiting::kForAnswer);
    take_orders();
    if (!asked_.empty() && Clock::now() > until) {
      if (unanswered_++ == 0) {
        say(fmt::format("warning: no command within {} s at {:.1f} s; flying on (said once)",
                        options_.lockstep,
                        to_seconds(simulation_.time())));
      }
      break;
    }
  }
  asked_.clear();
}

void RunLoop::take_orders() {
  for (Link* link : links_) {
    for (const Order& order : link->take_orders()) obey(*link, order);
  }
}

void RunLoop::obey(Link& link, const Order& order) {
  if (const auto* vehicle = std::get_if<VehicleOrder>(&order)) {
    if (vehicle->is_answer) std::erase(asked_, &link);
    const auto why = simulation_.command(vehicle->vehicle, vehicle->command);
    if (!why) return;
    link.on_rejected(*vehicle, *why);
    say_rejected(vehicle->vehicle, *why);
  } else if (std::holds_alternative<AnswerOrder>(order)) {
    std::erase(asked_, &link);
  } else if (const std::string why_not = objection(order); !why_not.empty()) {
    say(why_not);
  } else if (const auto* pause = std::get_if<PauseOrder>(&order)) {
    if (paused_ != pause->pause) say(pause->pause ? "paused" : "going on");
    paused_ = pause->pause;
    step_once_ = false;
  } else if (std::holds_alternative<StepOrder>(order)) {
    step_once_ = paused_;
  } else if (std::holds_alternative<ResetOrder>(order)) {
    reset_ = true;
  } else if (const auto* rate = std::get_if<RateOrder>(&order)) {
    pace_ = Pace(rate->rate);
    pace_.restart_at(simulation_.time());
  } else if (std::holds_alternative<EndOrder>(order)) {
    ended_ = true;
  } else if (const auto* skip = std::get_if<SkipOrder>(&order)) {
    simulation_.skip_to(skip->to);
    pace_.restart_at(skip->to);
  } else if (const auto* hurry = std::get_if<ShiftPaceOrder>(&order)) {
    pace_.hurry(hurry->by);
  }
}

/// The first that a link has.
std::string RunLoop::objection(const Order& order) const {
  std::string why_not;
  for (const Link* link : links_) {
    if (why_not.empty()) why_not = link->objection(order);
  }
  return why_not;
}

void RunLoop::say_rejected(std::size_t vehicle, const std::string& why) {
  if (std::exchange(said_rejected_, true)) return;
  say(fmt::format("warning: {}: {}; not taken (said once, counted)",
                  simulation_.vehicle(vehicle).setup().name,
                  why));
}

void RunLoop::wait_while_paused() {
  while (paused_ && !step_once_ && !reset_ && !is_over()) {
    for (Link* link : links_) link->on_wait(simulation_.time(), Waiting::kPaused);
    std::this_thread::sleep_for(kLook);
    take_orders();
    pace_.restart_at(simulation_.time());
  }
}

void RunLoop::reset() {
  for (Link* link : links_) link->on_reset(simulation_.time());
  before_reset_ += simulation_.simulated();
  simulation_.restore(at_start_);
  before_reset_ -= simulation_.simulated();
  say("reset: at the start again; stamps go on");
  pace_.restart_at(simulation_.time());
}

/// What the LiDARs cost that cost most, and what they would with beams as lines, if that is much
/// less: once, since a scan of each is taken to know.
std::string RunLoop::dearest_lidar() {
  const auto costs = lidar_costs(simulation_);
  if (said_dearest_ || costs.empty() || simulated() <= 0.0) return {};
  said_dearest_ = true;
  const LidarCost& dearest = costs.front();
  const double cores = dearest.cpu_time / simulated();
  std::string text = fmt::format(
      "{} takes {:.2f} of a core", std::filesystem::path(dearest.model).stem().string(), cores);
  const ScanCost scan = measure_scan(simulation_, dearest.vehicle, dearest.lidar);
  constexpr double kWorthIt = 0.8;
  if (scan.as_lines < kWorthIt * scan.as_is) {
    text += fmt::format(", with --fidelity line about {:.2f}", cores * scan.as_lines / scan.as_is);
  }
  return text + "; ";
}

void RunLoop::say_behind() {
  const auto behind = pace_.fallen_behind(simulation_.time());
  if (!behind) return;
  const double rate = std::max(0.1, std::floor(9.0 * behind->rate) / 10.0);
  std::string instead;
  for (const Link* link : links_) {
    if (instead.empty()) instead = link->remedy_when_behind(rate);
  }
  if (instead.empty()) instead = fmt::format("--rate {:.1f}, or --lockstep", rate);
  say(
      fmt::format("warning: {:.1f} s behind: this machine manages a rate of {:.2f}, not {}; "
                  "{}use fewer LiDARs, a coarser map or {}",
                  behind->seconds,
                  behind->rate,
                  pace_.rate(),
                  dearest_lidar(),
                  instead));
}

void RunLoop::say(const std::string& line) const {
  if (options_.log) options_.log(line);
}

}  // namespace pointflight
