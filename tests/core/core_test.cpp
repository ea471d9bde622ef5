#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/cpu_account.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/core/whole_number.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::FullDisk;
using testing::read_file;
using testing::TemporaryFolder;
using testing::write_file;

TEST(NumberText, SaysNumbersAsPeopleDo) {
  EXPECT_EQ(fixed_text(-0.004, 2), "0.00");
  EXPECT_EQ(fixed_text(-0.0, 0), "0");
  EXPECT_EQ(fixed_text(-0.006, 2), "-0.01");
  EXPECT_EQ(fixed_text(1234.5678, 1), "1234.6");
  EXPECT_EQ(fixed_text(-INFINITY, 1), "-inf");
  EXPECT_EQ(plain_text(0.036000000000000004), "0.036");
  EXPECT_EQ(plain_text(-0.0), "0");
  EXPECT_EQ(plain_text(-2.5), "-2.5");
  EXPECT_EQ(plain_text(0.1 + 0.2), "0.3");
}

TEST(Schedule, RatesThatDoNotDivideASecondDoNotDrift) {
  const Schedule thirty(30.0);
  EXPECT_EQ(thirty.at(1).time_since_epoch().count(), 33'333'333);
  EXPECT_EQ(thirty.at(3).time_since_epoch().count(), 100'000'000);
  // a thousand hours later it still falls on whole seconds
  EXPECT_EQ(thirty.at(30 * 3'600'000LL).time_since_epoch().count(), 3'600'000'000'000'000LL);
}

TEST(Schedule, PhaseShiftsEveryInstant) {
  const Schedule schedule(10.0, Duration(5));
  EXPECT_EQ(schedule.at(7).time_since_epoch().count(), 700'000'005);
}

// Known answers of Philox 4x32-10 from the Random123 distribution (kat_vectors).
TEST(RandomStream, IsPhiloxWithKnownAnswers) {
  const auto zeros = RandomStream(0, static_cast<StreamId>(0), 0).bits(0);
  EXPECT_EQ(zeros[0], 0x6627e8d5u);
  EXPECT_EQ(zeros[1], 0xe169c58du);
  EXPECT_EQ(zeros[2], 0xbc57ac4cu);
  EXPECT_EQ(zeros[3], 0x9b00dbd8u);
  const auto ones = RandomStream(~0ull, static_cast<StreamId>(~0u), ~0u).bits(~0ull);
  EXPECT_EQ(ones[0], 0x408f276du);
  EXPECT_EQ(ones[1], 0x41c83b0eu);
  EXPECT_EQ(ones[2], 0xa20bc7c6u);
  EXPECT_EQ(ones[3], 0x6d5451fdu);
}

TEST(RandomStream, NormalsHaveTheMomentsOfANormal) {
  const RandomStream random(7, StreamId::kTest, 3);
  constexpr int kCount = 200000;
  double m1 = 0.0;
  double m2 = 0.0;
  double m4 = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal(static_cast<std::uint64_t>(i));
    m1 += x;
    m2 += x * x;
    m4 += x * x * x * x;
  }
  // five standard errors: 1, sqrt(2), sqrt(96) over sqrt(n)
  EXPECT_NEAR(m1 / kCount, 0.0, 5.0 / std::sqrt(kCount));
  EXPECT_NEAR(m2 / kCount, 1.0, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(m4 / kCount, 3.0, 5.0 * std::sqrt(96.0 / kCount));
}

TEST(RandomStream, ManyDrawsAreTheBitsOfSingleOnes) {
  const RandomStream random(0x123456789abcdefu, StreamId::kTest, 77);
  for (const std::uint64_t first : {0ull, 5ull, 0xfffffff0ull, (41ull << 32) - 7}) {
    for (const std::size_t count : {std::size_t{0},
                                    std::size_t{1},
                                    std::size_t{7},
                                    std::size_t{8},
                                    std::size_t{1000},
                                    testing::repeats(std::size_t{100000})}) {
      std::vector<double> u(count), v(count), a(count), b(count);
      random.uniform2(first, u, v);
      random.normal2(first, a, b);
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(random.uniform2(first + i), (std::array{u[i], v[i]})) << first << ' ' << i;
        ASSERT_EQ(random.normal2(first + i), (std::array{a[i], b[i]})) << first << ' ' << i;
      }
    }
  }
}

TEST(RandomStream, AddressesAreIndependent) {
  const RandomStream a(1, StreamId::kLidarRangeNoise, 0);
  const RandomStream other_seed(2, StreamId::kLidarRangeNoise, 0);
  const RandomStream other_stream(1, StreamId::kImuGyroNoise, 0);
  const RandomStream other_entity(1, StreamId::kLidarRangeNoise, 1);
  EXPECT_EQ(a.uniform(5), RandomStream(1, StreamId::kLidarRangeNoise, 0).uniform(5));
  EXPECT_NE(a.uniform(5), other_seed.uniform(5));
  EXPECT_NE(a.uniform(5), other_stream.uniform(5));
  EXPECT_NE(a.uniform(5), other_entity.uniform(5));
  EXPECT_NE(a.uniform(5), a.uniform(6));
}

TEST(Math, AgreesWithTheSystemToAFewUnitsInTheLastPlace) {
  const RandomStream random(1, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const double x = random.uniform(i, -20.0, 20.0);
    const double unit = random.uniform(i + 10000, -1.0, 1.0);
    EXPECT_NEAR(math::sin(x), std::sin(x), 4e-16);
    EXPECT_NEAR(math::cos(x), std::cos(x), 4e-16);
    EXPECT_NEAR(math::exp(x) / std::exp(x), 1.0, 5e-16);
    EXPECT_NEAR(math::asin(unit), std::asin(unit), 5e-16);
    EXPECT_NEAR(math::atan2(x, unit), std::atan2(x, unit), 1e-15);
    EXPECT_NEAR(math::sincos(x).sin, math::sin(x), 4e-16);
    EXPECT_NEAR(math::sincos(x).cos, math::cos(x), 4e-16);
  }
}

TEST(Executor, VisitsEveryIndexOnceWithAnyNumberOfThreads) {
  for (const int threads : {1, 2, 8}) {
    const Executor executor(threads);
    std::vector<std::atomic<int>> visits(10007);
    executor.parallel_for(visits.size(), 100, [&](std::size_t begin, std::size_t end) {
      EXPECT_EQ(begin % 100, 0u);
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    for (const auto& v : visits) ASSERT_EQ(v, 1);
  }
}

TEST(Executor, AChunkHasAtLeastOne) {
  EXPECT_THROW(Executor(2).parallel_for(4, 0, [](std::size_t, std::size_t) {}),
               std::invalid_argument);
}

TEST(Executor, PassesOnAnException) {
  const Executor executor(2);
  EXPECT_THROW(executor.parallel_for(1000,
                                     10,
                                     [](std::size_t begin, std::size_t) {
                                       if (begin == 500) throw InputError("at 500");
                                     }),
               InputError);
}

TEST(CpuAccount, TheInnermostPaysAndForLoopsOnAllThreadsToo) {
  const auto work = [] {
    const double since = process_cpu_time();
    while (process_cpu_time() - since < 0.02) ASSERT_NE(ChargeTo::current(), nullptr);
  };
  CpuAccount outer, inner, loops;
  {
    const ChargeTo charge(&outer);
    const ChargeTo own(&inner);
    work();
  }
  EXPECT_GE(inner.seconds(), 0.01);
  EXPECT_LT(outer.seconds(), inner.seconds());
  for (const int threads : {1, 2}) {
    const ChargeTo charge(&loops);
    Executor(threads).parallel_for(4, 1, [&](std::size_t, std::size_t) { work(); });
    EXPECT_EQ(ChargeTo::current(), &loops);
  }
  // four times alone; two threads share the process' clock
  EXPECT_GE(loops.seconds(), 0.08);
  EXPECT_EQ(ChargeTo::current(), nullptr);
}

TEST(OutputFile, AppearsOnlyWhenCommitted) {
  const TemporaryFolder folder;
  {
    OutputFile file(folder / "a.txt");
    file.write("text");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  OutputFile file(folder / "a.txt");
  file.write("text");
  file.commit();
  EXPECT_EQ(testing::read_file(folder / "a.txt"), "text");
}

TEST(OutputFile, OneWriterAtATime) {
  const TemporaryFolder folder;
  std::optional<OutputFile> first(folder / "a.txt");
  first->write("first");
  EXPECT_NE(error_of([&] { OutputFile(folder / "a.txt"); }).find("is being written"),
            std::string::npos);
  EXPECT_NE(error_of([&] { OutputFile(folder.path() + "/./a.txt"); }).find("is being written"),
            std::string::npos);
  first->commit();
  OutputFile second(folder / "a.txt");  // what was committed is nobody's any more
  second.write("second");
  second.commit();
  EXPECT_EQ(read_file(folder / "a.txt"), "second");
}

TEST(MappedFile, ReadsZerosWhereItWasCutShortAndSaysSo) {
  const TemporaryFolder folder;
  survive_cut_files();
  write_file(folder / "a", std::string(5 * 4096, 'x'));
  {
    const MappedFile file(folder / "a");
    EXPECT_EQ(file.bytes()[4 * 4096], std::byte{'x'});
    std::filesystem::resize_file(folder / "a", 2 * 4096);
    throw_if_mapped_file_was_cut();  // nobody has missed anything yet
    EXPECT_EQ(file.bytes()[4096], std::byte{'x'});
    EXPECT_EQ(file.bytes()[3 * 4096 + 5], std::byte{0});
    const Executor executor;
    for (const std::string& error :
         {error_of([] { throw_if_mapped_file_was_cut(); }),
          error_of([&] { executor.parallel_for(4, 1, [](std::size_t, std::size_t) {}); }),
          error_of([&] {
            OutputFile output(folder / "b");
            output.commit();
          })}) {
      EXPECT_NE(error.find("/a: was cut short by another program"), std::string::npos) << error;
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "b"));
  }
  throw_if_mapped_file_was_cut();  // it was told
  write_file(folder / "a", std::string(5 * 4096, 'x'));
  {
    const MappedFile file(folder / "a");
    std::filesystem::resize_file(folder / "a", 0);
    EXPECT_EQ(file.bytes()[0], std::byte{0});
  }
  EXPECT_NE(error_of([] { throw_if_mapped_file_was_cut(); }).find("/a: was cut short"),
            std::string::npos);
  throw_if_mapped_file_was_cut();
}

TEST(OutputFile, SaysWhereAndWhyItCannotWrite) {
  const std::string error = error_of([] { OutputFile("/nowhere/at/all.txt"); });
  expect_contains(error, "/nowhere/at/all.txt");
  expect_contains(error, "No such file or directory");
}

TEST(OutputFile, AFullDiskIsAnErrorNotASilentLoss) {
  const TemporaryFolder folder;
  OutputFile file(folder / "a.txt");
  file.write("text");
  const FullDisk full(2);
  expect_contains(error_of([&] { file.commit(); }), "a.txt: cannot write: File too large");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
}

TEST(OutputFile, IsUsedNoMoreOnceItIsCommitted) {
  const TemporaryFolder folder;
  OutputFile file(folder / "a.txt");
  file.write("text");
  file.commit();
  EXPECT_THROW(file.commit(), std::logic_error);
  EXPECT_THROW(file.write("more"), std::logic_error);
  EXPECT_THROW(file.flush(), std::logic_error);
  EXPECT_EQ(read_file(folder / "a.txt"), "text");
}

TEST(OutputSet, ItsFilesAppearTogetherOrNotAtAll) {
  const TemporaryFolder folder;
  const auto write = [&](const char* name) {
    OutputFile file(folder / name);
    file.write(name);
    file.commit();
  };
  {
    const OutputSet none;
    write("a");
    EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "nothing half-written either";
  OutputSet both;
  write("a");
  {
    OutputSet inner;
    write("b");
    inner.commit();
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "b")) << "a set within another waits for that";
  both.commit();
  EXPECT_EQ(read_file(folder / "a"), "a");
  EXPECT_EQ(read_file(folder / "b"), "b");
}

TEST(WholeNumber, IsOnlyWhatATypeHolds) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double none : {nan, 1e300, -1e300, 0.5, -1.0, 4294967296.0, 1.0 / 0.0}) {
    EXPECT_FALSE(whole_number<std::uint32_t>(none)) << none;
  }
  EXPECT_EQ(whole_number<std::uint32_t>(4294967295.0), 4294967295u);
  EXPECT_EQ(whole_number<int>(-3.0), -3);
  EXPECT_FALSE(whole_number<int>(7.0, 0, 6));
  EXPECT_FALSE(whole_number<std::int64_t>(9.3e18)) << "beyond what doubles hold exactly";
}

}  // namespace
}  // namespace pointflight
