// How late scans were ready.
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "pointflight/run/run_loop.hpp"
#include "pointflight/run/threaded_link.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

TEST(ScanDelays, AreCountedInBins) {
  ScanDelays delays;
  for (int i = 0; i < 100; ++i) delays.add(0.001 * i);
  EXPECT_NEAR(delays.below(0.5), 0.050, 2e-4);
  EXPECT_NEAR(delays.below(0.99), 0.099, 2e-4);
  delays.add(1e9);
  delays.add(-1.0);
  EXPECT_EQ(delays.count(), 102u);
}

}  // namespace
}  // namespace pointflight
