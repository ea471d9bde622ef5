#include "pointflight/core/cpu_account.hpp"

#include <ctime>

namespace pointflight {
namespace {

std::int64_t nanoseconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// Who pays for a thread, and since when.
struct Charged {
  CpuAccount* account = nullptr;
  std::int64_t since = 0;

  void change_to(CpuAccount* other) {
    if (other == account) return;
    const std::int64_t now = nanoseconds_of(CLOCK_THREAD_CPUTIME_ID);
    if (account != nullptr) account->add(now - since);
    account = other;
    since = now;
  }
};
thread_local Charged charged;

}  // namespace

ChargeTo::ChargeTo(CpuAccount* account) : outer_(charged.account) {
  charged.change_to(account);
}

ChargeTo::~ChargeTo() {
  charged.change_to(outer_);
}

CpuAccount* ChargeTo::current() {
  return charged.account;
}

double process_cpu_time() {
  return 1e-9 * static_cast<double>(nanoseconds_of(CLOCK_PROCESS_CPUTIME_ID));
}

}  // namespace pointflight
