#include "pointflight/campaign/engines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {

void fly_here(const Campaign& campaign,
              const std::vector<std::size_t>& numbers,
              int jobs,
              const std::atomic<bool>& stop,
              const FlightDone& done) {
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> failed = false;
  std::mutex mutex;
  std::exception_ptr error;
  const auto work = [&] {
    for (std::size_t i = 0; !stop && !failed && (i = next++) < numbers.size();) {
      try {
        const auto record = campaign.fly(numbers[i], stop);
        const std::lock_guard lock(mutex);
        if (record && done) done(numbers[i], *record);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!error) error = std::current_exception();
        failed = true;
      }
    }
  };
  // a thread for each, which lives as long as its process: processes end with theirs
  std::vector<std::jthread> threads;
  const auto most = std::min<std::size_t>(numbers.size(), static_cast<std::size_t>(jobs));
  threads.reserve(most);
  try {
    for (std::size_t i = 0; i < most; ++i) threads.emplace_back(work);
  } catch (const std::system_error&) {
    // fewer than asked for: the machine allows no more (ulimit -u), and so many fly all the same
    if (threads.empty()) {
      throw InputError("the system allows no further thread; allow more (ulimit -u)");
    }
  }
  for (std::jthread& thread : threads) thread.join();
  if (!error) return;
  campaign.remove_leftovers();
  std::rethrow_exception(error);
}

Share parse_share(const std::string& text) {
  const std::size_t slash = text.find('/');
  double index = -1.0;
  double of = 0.0;
  const bool is_read = slash != std::string::npos && parse_number(text.substr(0, slash), index) &&
                       parse_number(text.substr(slash + 1), of);
  const auto is_whole = [](double x) {
    return x >= 0.0 && x < 1e6 && x == static_cast<double>(static_cast<std::size_t>(x));
  };
  if (!is_read || !is_whole(index) || !is_whole(of) || index >= of) {
    throw InputError(fmt::format("--share {}: write it like 0/16 to 15/16", text));
  }
  return {static_cast<std::size_t>(index), static_cast<std::size_t>(of)};
}

std::vector<std::size_t> share_of(const std::vector<std::size_t>& numbers, const Share& share) {
  std::vector<std::size_t> own;
  for (const std::size_t number : numbers) {
    if (number % share.of == share.index) own.push_back(number);
  }
  return own;
}

std::size_t even_shares(const std::vector<std::size_t>& numbers, std::size_t most) {
  constexpr std::size_t kTried = 16;  // of a hundred thousand tasks not each number
  const std::size_t first = std::max<std::size_t>(1, most);
  std::size_t best = first;
  std::size_t least = numbers.size() + 1;
  for (std::size_t of = first; of > first / 2 && of + kTried > first; --of) {
    std::vector<std::size_t> loads(of, 0);
    for (const std::size_t number : numbers) ++loads[number % of];
    const std::size_t load = *std::max_element(loads.begin(), loads.end());
    if (load < least) {
      least = load;
      best = of;
    }
  }
  return best;
}

}  // namespace pointflight
