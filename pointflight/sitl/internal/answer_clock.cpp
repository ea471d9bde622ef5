#include "pointflight/sitl/internal/answer_clock.hpp"

#include <fmt/format.h>

#include <thread>
#include <utility>

namespace pointflight {
namespace {

constexpr std::chrono::seconds kSilent(1);  // until users are told

}  // namespace

AnswerClock::AnswerClock(std::string who,
                         double wait,
                         std::function<void(const std::string& line)> log)
    : who_(std::move(who)), wait_(wait), log_(std::move(log)) {}

bool AnswerClock::gives_up() {
  const auto silent = Clock::now() - asked_at_;
  if (silent >= kSilent && !std::exchange(has_said_, true) && log_) {
    log_(fmt::format("{} does not answer; waiting for {} s (said once)", who_, wait_));
  }
  if (silent < std::chrono::duration<double>(wait_)) return false;
  if (log_) {
    log_(fmt::format("{} has not answered; going on at the wall clock's pace until it does", who_));
  }
  return true;
}

void AnswerClock::keep_pace(SimTime now) {
  if (!std::exchange(is_paced_, true)) {
    paced_from_ = now;
    paced_at_ = Clock::now();
  }
  std::this_thread::sleep_until(paced_at_ +
                                std::chrono::duration_cast<Clock::duration>(now - paced_from_));
}

}  // namespace pointflight
