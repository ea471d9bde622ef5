// Frames and messages of MAVLink: bytes that others computed, round trips, junk.
#include "pointflight/sitl/internal/mavlink.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

using namespace mavlink;

std::vector<std::byte> bytes_of(const std::string& hex) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

std::string hex_of(const std::vector<std::byte>& bytes) {
  std::string hex;
  for (const std::byte byte : bytes) hex += fmt::format("{:02x}", std::to_integer<int>(byte));
  return hex;
}

std::vector<Frame> frames_in(const std::vector<std::byte>& stream) {
  FrameReader reader;
  reader.add(stream);
  std::vector<Frame> frames;
  while (auto frame = reader.next()) frames.push_back(*frame);
  return frames;
}

/// A message all of whose bytes differ.
template <class Message>
Message counted() {
  Message message;
  std::uint8_t next = 1;
  for_each_field(message, [&](auto& field) {
    auto* to = reinterpret_cast<std::uint8_t*>(&field);
    for (std::size_t i = 0; i < sizeof(field); ++i) to[i] = next++;
  });
  return message;
}

TEST(Mavlink, ChecksumIsThatOfTheStandard) {
  const char text[] = "123456789";
  EXPECT_EQ(checksum(std::as_bytes(std::span(text, 9))), 0x6f91);
}

/// Computed by another program than ours.
TEST(Mavlink, BytesAreThoseOfOthers) {
  std::vector<std::byte> stream;
  FrameWriter firmware(1, 1);
  Heartbeat heartbeat;
  heartbeat.autopilot = 12;
  firmware.append(heartbeat, stream);
  EXPECT_EQ(hex_of(stream), "fd09000000010100000000000000000c00000381d6");

  HilSensor sensor;
  sensor.time_usec = 4000;
  sensor.acceleration = {0.0f, 0.0f, -9.80665f};
  sensor.field = {0.2174f, 0.0129f, 0.4304f};
  sensor.pressure = 955.98f;
  sensor.pressure_altitude = 488.0f;
  sensor.temperature = 11.8f;
  sensor.updated = 0x1bff;
  FrameWriter simulator(1, 200);
  std::vector<std::byte> skipped;
  simulator.append(sensor, skipped);
  simulator.append(sensor, skipped);
  std::vector<std::byte> third;
  simulator.append(sensor, third);
  EXPECT_EQ(
      hex_of(third),
      "fd3e00000201c86b0000a00f00000000000000000000000000000ae81cc10000000000000000000000001b9e5"
      "e3e865a533c645ddc3eb8fe6e44000000000000f443cdcc3c41ff1bfda4");
}

template <class Message>
void expect_round_trip(const char* name, std::size_t length) {
  SCOPED_TRACE(name);
  const auto message = counted<Message>();
  EXPECT_EQ(Message::kKind.length, length);
  std::vector<std::byte> stream;
  FrameWriter writer(7, 8);
  writer.append(message, stream);
  ASSERT_EQ(stream.size(), 12 + length);  // header and checksum
  const auto frames = frames_in(stream);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].system, 7);
  EXPECT_EQ(frames[0].component, 8);
  for (std::size_t i = 0; i < length; ++i) {
    ASSERT_EQ(std::to_integer<std::size_t>(frames[0].payload[i]), (i + 1) % 256) << i;
  }
  auto read = message_in<Message>(frames[0]);
  ASSERT_TRUE(read);
  std::vector<std::byte> again;
  FrameWriter(7, 8).append(*read, again);
  EXPECT_EQ(stream, again);
}

TEST(Mavlink, MessagesAreWhatTheyWere) {
  expect_round_trip<Heartbeat>("HEARTBEAT", 9);
  expect_round_trip<RcChannels>("RC_CHANNELS", 42);
  expect_round_trip<CommandLong>("COMMAND_LONG", 33);
  expect_round_trip<HilActuatorControls>("HIL_ACTUATOR_CONTROLS", 81);
  expect_round_trip<HilSensor>("HIL_SENSOR", 65);
  expect_round_trip<HilGps>("HIL_GPS", 39);
  expect_round_trip<HilStateQuaternion>("HIL_STATE_QUATERNION", 64);
  expect_round_trip<DistanceSensor>("DISTANCE_SENSOR", 39);
  expect_round_trip<ObstacleDistance>("OBSTACLE_DISTANCE", 167);
  expect_round_trip<Odometry>("ODOMETRY", 233);
}

TEST(Mavlink, VersionOneIsRead) {
  // the heartbeat as version 1: its zeros are sent
  // custom mode, type, autopilot, mode, status, version
  std::vector<std::byte> frame = bytes_of("fe090001010000000000000c000003");
  const std::byte extra[] = {std::byte{50}};
  const std::uint16_t crc = checksum(extra, checksum(std::span(frame).subspan(1)));
  frame.push_back(static_cast<std::byte>(crc & 0xff));
  frame.push_back(static_cast<std::byte>(crc >> 8));
  const auto frames = frames_in(frame);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(message_in<Heartbeat>(frames[0])->autopilot, 12);
}

TEST(Mavlink, SignedFramesAreReadAndOthersFlagsAreNot) {
  std::vector<std::byte> stream;
  FrameWriter(1, 1).append(Heartbeat{}, stream);
  const auto flagged = [&](int flags) {
    std::vector<std::byte> frame = stream;
    frame.resize(frame.size() - 2);
    frame[2] = static_cast<std::byte>(flags);
    const std::byte extra[] = {std::byte{50}};
    const std::uint16_t crc = checksum(extra, checksum(std::span(frame).subspan(1)));
    frame.push_back(static_cast<std::byte>(crc & 0xff));
    frame.push_back(static_cast<std::byte>(crc >> 8));
    if (flags == 1) frame.resize(frame.size() + 13);
    frame.insert(frame.end(), stream.begin(), stream.end());
    return frames_in(frame).size();
  };
  EXPECT_EQ(flagged(0), 2u);
  EXPECT_EQ(flagged(1), 2u);
  EXPECT_EQ(flagged(2), 1u);
}

/// Whatever comes between, before and within, whole frames are found, byte by byte too.
TEST(Mavlink, FramesAreFoundInJunk) {
  const RandomStream random(5, StreamId::kMissionSearch, 0);
  std::uint64_t draw = 0;
  const auto byte = [&] { return static_cast<std::byte>(random.uniform(draw++, 0.0, 256.0)); };
  std::size_t found = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::byte> stream;
    FrameWriter writer(1, 1);
    for (int i = 0; i < 10; ++i) {
      const int junk = static_cast<int>(random.uniform(draw++, 0.0, 60.0));
      for (int k = 0; k < junk; ++k) stream.push_back(byte());
      HilActuatorControls controls;
      controls.time_usec = static_cast<std::uint64_t>(1000 + i);
      controls.mode = 128;
      writer.append(controls, stream);
    }
    FrameReader reader;
    for (std::size_t i = 0; i < stream.size(); i += 7) {
      reader.add(std::span(stream).subspan(i, std::min<std::size_t>(7, stream.size() - i)));
      while (const auto frame = reader.next()) {
        const auto controls = message_in<HilActuatorControls>(*frame);
        if (controls && controls->is_armed()) ++found;
      }
    }
  }
  // junk may look like the start of a frame, whose end then hides the last one of a stream
  EXPECT_GT(found, 2990u);
  EXPECT_LE(found, 3000u);
}

TEST(Mavlink, WhatWasChangedIsNoFrame) {
  std::vector<std::byte> stream;
  FrameWriter(1, 1).append(counted<HilActuatorControls>(), stream);
  for (std::size_t i = 0; i < stream.size(); ++i) {
    std::vector<std::byte> changed = stream;
    changed[i] ^= std::byte{0x10};
    EXPECT_TRUE(frames_in(changed).empty()) << i;
  }
}

}  // namespace
}  // namespace pointflight
