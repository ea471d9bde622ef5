// How long a firmware is waited for, and the pace of a run that it does not set.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "pointflight/core/time.hpp"

namespace pointflight {

/// Of one firmware. It may be gone, in a debugger, or busy with its start.
class AnswerClock {
 public:
  /// `who`: its name for users; `wait`: so long it is waited for, s.
  AnswerClock(std::string who, double wait, std::function<void(const std::string& line)> log);

  /// Something was asked just now.
  void ask() { asked_at_ = Clock::now(); }
  /// While the answer has not come: says so once, after a second. True once it has been waited for
  /// long enough.
  [[nodiscard]] bool gives_up();
  /// Sleeps until the run's time has come by the wall clock, counted from the first call on.
  void keep_pace(SimTime now);
  /// The next call of `keep_pace` is the first.
  void restart_pace() { is_paced_ = false; }

 private:
  using Clock = std::chrono::steady_clock;
  std::string who_;
  double wait_;
  std::function<void(const std::string& line)> log_;
  Clock::time_point asked_at_ = Clock::now();
  bool has_said_ = false;
  bool is_paced_ = false;
  SimTime paced_from_;
  Clock::time_point paced_at_;
};

}  // namespace pointflight
