// Whether this machine computes what others do.
#pragma once

#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"

namespace pointflight {

/// A hash of something that must be the same on every machine: sixteen hexadecimal digits.
struct SelfTestHash {
  std::string what;  ///< "states"
  std::string hash;  ///< Of its bytes.
};

/// Makes a world and flies a second in it with two LiDARs, one that turns and one that does
/// not, in turbulent wind: hashes of the map, the vehicle's states, its IMU, and its scans with
/// `beam` and `paper`. Bits do not depend on threads, the instruction set, or what the machine is
/// busy with.
std::vector<SelfTestHash> self_test(const Executor& executor, const Progress& progress = {});

/// The hashes that a release has on every machine: `data/self_test.csv`, names and hashes. Throws
/// InputError if it is missing.
std::vector<SelfTestHash> released_hashes();

/// The same file with other hashes: for those who change what is computed.
std::string self_test_file(const std::vector<SelfTestHash>& hashes);

}  // namespace pointflight
