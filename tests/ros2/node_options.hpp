// What the nodes that join and leave in network_test.py have in common.
#pragma once

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace pointflight::testing {

/// `NODE [best_effort] [slow]`: reads until it is told to end.
struct NodeOptions {
  NodeOptions(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
      const std::string word = argv[i];
      reliable = reliable && word != "best_effort";
      slow = slow || word == "slow";
    }
    const char* id = std::getenv("ROS_DOMAIN_ID");
    domain = id == nullptr ? 0 : static_cast<std::uint32_t>(std::atoi(id));
    std::signal(SIGINT, [](int) { told_to_end = 1; });
    std::signal(SIGTERM, [](int) { told_to_end = 1; });
  }
  bool reliable = true;
  bool slow = false;
  std::uint32_t domain = 0;
  inline static volatile std::sig_atomic_t told_to_end = 0;
};

/// Messages of a topic, by their own stamps.
struct Counted {
  std::uint64_t count = 0;
  double first = 0.0, last = 0.0;
  double longest_gap = 0.0;
  void take(double stamp) {
    if (count++ == 0) {
      first = stamp;
    } else if (stamp - last > longest_gap) {
      longest_gap = stamp - last;
    }
    last = stamp;
  }
  void print(const char* what) const {
    std::printf("%s %llu %.3f %.3f\n",
                what,
                static_cast<unsigned long long>(count),
                last - first,
                longest_gap);
    std::fflush(stdout);
  }
};

}  // namespace pointflight::testing
