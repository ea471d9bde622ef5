// Definitions of the messages of barometers and the like, by ROS 1's checksums of them.
#include <gtest/gtest.h>

#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/messages.hpp"

namespace pointflight {
namespace {

TEST(NavigationMessages, AreThoseOfSensorMsgs) {
  EXPECT_EQ(message_type<msg::FluidPressure>().md5, "804dc5cea1c5306d6a2eb80b9833befe");
  EXPECT_EQ(message_type<msg::MagneticField>().md5, "2f3b0b43eed0c9501de0fa3ff89a45aa");
  EXPECT_EQ(message_type<msg::NavSatStatus>().md5, "331cdbddfa4bc96ffc3b9ad98900a54c");
  EXPECT_EQ(message_type<msg::NavSatFix>().md5, "2d3a8cd499b9b4a0249fb98fd05cfa48");
  EXPECT_EQ(message_type<msg::Range>().md5, "c005c34273dc426c67a020a87bc24148");
}

}  // namespace
}  // namespace pointflight
