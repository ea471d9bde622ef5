#include "pointflight/share/vehicle_list.hpp"

#include <gtest/gtest.h>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

using Numbers = std::vector<std::size_t>;

const std::vector<std::string> kFleet = {"drone0", "uav-1", "uav-2", "mapper", "4"};

TEST(VehicleList, TakesNumbersNamesAndRanges) {
  EXPECT_EQ(vehicles_from({"2"}, kFleet), Numbers({2}));
  EXPECT_EQ(vehicles_from({"3", "0-1"}, kFleet), Numbers({0, 1, 3}));
  EXPECT_EQ(vehicles_from({"mapper"}, kFleet), Numbers({3}));
  EXPECT_EQ(vehicles_from({"drone0-2"}, kFleet), Numbers({0, 1, 2}));
  EXPECT_EQ(vehicles_from({"0-4"}, kFleet), Numbers({0, 1, 2, 3, 4}));
}

TEST(VehicleList, NamesMayHaveDashes) {
  EXPECT_EQ(vehicles_from({"uav-1"}, kFleet), Numbers({1}));
  EXPECT_EQ(vehicles_from({"uav-1-mapper"}, kFleet), Numbers({1, 2, 3}));
  EXPECT_EQ(vehicles_from({"uav-1-uav-2"}, kFleet), Numbers({1, 2}));
}

TEST(VehicleList, SaysWhatIsNone) {
  for (const char* item : {"5",
                           "0-5",
                           "",
                           "-",
                           "1-",
                           "-1",
                           "uav",
                           "uav-3",
                           "0x1",
                           "99999999999999999999",
                           "2-1",
                           "0",
                           "0-1"}) {
    try {
      (void)vehicles_from({"0", item}, kFleet);
      ADD_FAILURE() << item;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(item), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace pointflight
