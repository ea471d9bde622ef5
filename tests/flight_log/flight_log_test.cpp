#include "pointflight/flight_log/flight_log.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/flight_log/internal/firmwares.hpp"
#include "pointflight/flight_log/log_source.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "tests/flight_log/flown_log.hpp"
#include "tests/flight_log/log_bytes.hpp"

namespace pointflight {
namespace {

FlightLog short_flight() {
  FlownLogOptions options;
  options.duration = 2.0;
  return flown_log(load_vehicle("x500"), options);
}

/// Largest differences of two logs of one flight.
void expect_same(const FlightLog& a, const FlightLog& b, double tolerance, double angle) {
  ASSERT_EQ(a.imu.size(), b.imu.size());
  ASSERT_EQ(a.attitude.size(), b.attitude.size());
  ASSERT_EQ(a.motion.size(), b.motion.size());
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  for (std::size_t i = 0; i < a.imu.size(); ++i) {
    EXPECT_NEAR(a.imu[i].time, b.imu[i].time, 1e-6);
    EXPECT_LT((a.imu[i].gyro - b.imu[i].gyro).norm(), tolerance);
    EXPECT_LT((a.imu[i].accel - b.imu[i].accel).norm(), tolerance);
    EXPECT_LT(a.attitude[i].q_world_body.angularDistance(b.attitude[i].q_world_body), angle);
    EXPECT_LT((a.motion[i].p_world - b.motion[i].p_world).norm(), tolerance);
    EXPECT_LT((a.motion[i].v_world - b.motion[i].v_world).norm(), tolerance);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(a.outputs[i].outputs[k], b.outputs[i].outputs[k], 0.5 / 800 + 1e-6);
    }
  }
}

std::string message_of(const std::string& bytes) {
  try {
    parsed(bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(FlightLog, ULogComesBackInOurFrames) {
  const FlightLog flown = short_flight();
  const FlightLog log = parsed(ulog_of(flown));
  EXPECT_EQ(log.firmware, "PX4");
  EXPECT_EQ(log.outputs_from, "actuator_motors");
  EXPECT_EQ(log.skipped, 0u);
  expect_same(flown, log, 1e-5, 1e-3);
}

TEST(FlightLog, DataFlashComesBackInOurFrames) {
  const FlightLog flown = short_flight();
  const FlightLog log = parsed(dataflash_of(flown));
  EXPECT_EQ(log.firmware, "ArduPilot");
  EXPECT_EQ(log.outputs_from, "RCOU");
  expect_same(flown, log, 1e-5, 2e-3);  // angles in hundredths of degrees
}

TEST(FlightLog, PX4sThrustCurveIsTakenOut) {
  for (const double f : {0.3, 0.7, 1.0}) {
    for (const double u : {0.0, 0.2, 0.6, 1.0}) {
      EXPECT_NEAR(flight_log::px4_output_for(f * u * u + (1.0 - f) * u, f), u, 1e-12);
    }
  }
  FlightLog flown = short_flight();
  const FlightLog log = parsed(ulog_of(flown, {{"THR_MDL_FAC", 1.0f}}));
  EXPECT_NEAR(log.outputs[7].outputs[2], std::sqrt(flown.outputs[7].outputs[2]), 1e-6);
}

TEST(FlightLog, PulsesAreUsedIfThereAreMoreOfThem) {
  const FlightLog flown = short_flight();
  std::string text = ulog_of(flown,
                             {{"PWM_MAIN_MIN1", 1100.0f},
                              {"PWM_MAIN_MAX1", 1900.0f},
                              {"PWM_MAIN_FUNC1", 102.0f},  // motor 2
                              {"PWM_MAIN_FUNC2", 101.0f},
                              {"PWM_MAIN_FUNC3", 0.0f}});
  text += ulog_format("actuator_outputs:uint64_t timestamp;uint32_t noutputs;float[16] output;") +
          ulog_subscription(9, "actuator_outputs");
  for (int i = 0; i < 1000; ++i) {
    LogBytes data;
    data.put(std::uint16_t{9}).put(static_cast<std::uint64_t>(2000 * i)).put(std::uint32_t{4});
    for (int k = 0; k < 16; ++k) data.put(k == 0 ? 1500.0f : k == 1 ? 1250.0f : 900.0f);
    text += ulog_message('D', data.text);
  }
  const FlightLog log = parsed(text);
  EXPECT_EQ(log.outputs_from, "actuator_outputs");
  EXPECT_NEAR(log.outputs[5].outputs[1], 0.5, 1e-6);   // 1500 of 1100 to 1900
  EXPECT_NEAR(log.outputs[5].outputs[0], 0.25, 1e-6);  // 1250 of 1000 to 2000
  EXPECT_EQ(log.outputs[5].outputs.size(), 2u);        // the others never turn: below their least
}

TEST(FlightLog, CutLogsAreReadUpToThere) {
  const std::string text = ulog_of(short_flight());
  for (const std::size_t cut : {1u, 7u, 40u}) {
    EXPECT_NO_THROW(parsed(text.substr(0, text.size() - cut)));
  }
  EXPECT_GT(parsed(text.substr(0, text.size() / 2)).imu.size(), 200u);
}

TEST(FlightLog, WhatWasAppendedAfterACrashIsRead) {
  const FlightLog flown = short_flight();
  const std::string whole = ulog_of(flown);
  // the last message of the first part is cut, and the appended part begins right after it
  const std::string second = ulog_message('D', [] {
    LogBytes data;
    data.put(std::uint16_t{2}).put(std::uint64_t{5'000'000});
    for (const float v : {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f}) data.put(v);
    data.put(std::uint8_t{1});
    return data.text;
  }());
  LogBytes flags;
  const std::string first = whole.substr(0, whole.size() - 5);
  flags.put_text("", 8)
      .put(std::uint8_t{1})
      .put_text("", 7)
      .put(static_cast<std::uint64_t>(first.size()));
  flags.put_text("", 16);
  std::string text = first + second;
  text.replace(16, 3 + 40, ulog_message('B', flags.text));
  const FlightLog log = parsed(text);
  EXPECT_NEAR(log.motion.back().time, 5.0, 1e-9);
  EXPECT_EQ(log.motion.back().p_world, Vector3d(2.0, 1.0, -3.0));
}

TEST(FlightLog, JunkInADataFlashLogIsSkipped) {
  const FlightLog flown = short_flight();
  std::string text = dataflash_of(flown);
  text.insert(text.size() - 500, "\xA3\x95 this is no packet \xA3");
  const FlightLog log = parsed(text);
  EXPECT_GT(log.skipped, 10u);
  EXPECT_GT(log.imu.size(), flown.imu.size() - 20);
}

TEST(FlightLog, ColumnsMayStandInAnyOrder) {
  std::string text = ulog_of(short_flight());
  const std::string usual = "float[4] q;float[4] delta_q_reset;";
  const std::string turned = "float q[1];float q[2];float q[3];float q[0];float[4] x;";
  const std::size_t at = text.find(usual);
  ASSERT_NE(at, std::string::npos);
  const std::string definition = "vehicle_attitude:uint64_t timestamp;uint64_t timestamp_sample;";
  const std::string whole =
      ulog_format(definition + usual + "uint8_t quat_reset_counter;uint8_t[7] _padding0;");
  ASSERT_NE(text.find(whole), std::string::npos);
  text.replace(text.find(whole), whole.size(), ulog_format(definition + turned));
  const FlightLog log = parsed(text);
  const FlightLog flown = parsed(ulog_of(short_flight()));
  ASSERT_EQ(log.attitude.size(), flown.attitude.size());
  EXPECT_GT(log.attitude[9].q_world_body.angularDistance(flown.attitude[9].q_world_body), 0.1);
}

TEST(FlightLog, ErrorsSayWhatIsMissing) {
  EXPECT_NE(message_of("no log at all, and long enough to be one").find("neither a ULog"),
            std::string::npos);
  FlightLog flown = short_flight();
  flown.motion.clear();
  EXPECT_NE(message_of(ulog_of(flown)).find("no vehicle_local_position"), std::string::npos);
  EXPECT_NE(message_of(dataflash_of(flown)).find("no XKF1"), std::string::npos);
  EXPECT_NE(message_of(ulog_start(2)).find("byte 16: a log of a later PX4"), std::string::npos);
  EXPECT_NE(message_of(ulog_start() + ulog_subscription(1, "sensor_combined"))
                .find("format of 'sensor_combined'"),
            std::string::npos);
  // formats that hold themselves, or more than any message does
  EXPECT_NE(message_of(ulog_start() + ulog_format("sensor_combined:sensor_combined a;") +
                       ulog_subscription(1, "sensor_combined"))
                .find("makes no sense"),
            std::string::npos);
  std::string empty = ulog_format("sensor_combined:uint64_t timestamp;b[4000] a;");
  for (const char* format : {"b:c[4000] x;", "c:d[4000] x;", "d:e[4000] x;", "e:"}) {
    empty += ulog_format(format);  // 256 T times nothing
  }
  EXPECT_NE(message_of(ulog_start() + empty + ulog_subscription(1, "sensor_combined"))
                .find("makes no sense"),
            std::string::npos);
  EXPECT_NE(message_of(ulog_start() + ulog_format("sensor_combined:uint64_t timestamp;b[4000] a;") +
                       ulog_format("b:float[4000] c;") + ulog_subscription(1, "sensor_combined"))
                .find("makes no sense"),
            std::string::npos);
}

TEST(FlightLog, ValuesThatAreNoNumbersOrGoBackAreLeftOut) {
  FlightLog flown = short_flight();
  flown.imu[10].gyro.x() = std::nan("");
  flown.motion[20].p_world.y() = INFINITY;
  const FlightLog log = parsed(ulog_of(flown));
  EXPECT_EQ(log.imu.size(), flown.imu.size() - 1);
  EXPECT_EQ(log.motion.size(), flown.motion.size() - 1);
  EXPECT_EQ(log.skipped, 2u);
}

TEST(FlightLog, ASourceFollowsItWhereItLiesInTheMap) {
  FlightLog log;
  log.imu = {{0.0, {0, 0, 0.5}, {}}, {10.0, {0, 0, 0.5}, {}}};
  log.attitude = {{0.0, quaternion_from_rpy(0, 0, 0)}, {10.0, quaternion_from_rpy(0, 0, 0)}};
  log.motion = {{0.0, {0, 0, 0}, {1, 0, 0}}, {10.0, {10, 0, 0}, {1, 0, 0}}};
  const double quarter = std::acos(0.0);
  LogSource source(log, 2.0, {quaternion_from_rpy(0, 0, quarter), {100, 50, 3}});
  const auto state = source.state_at(SimTime{from_seconds(1.5)});
  ASSERT_TRUE(state);
  EXPECT_LT((state->body.p_world - Vector3d(100, 53.5, 3)).norm(), 1e-9);
  EXPECT_LT((state->body.v_world - Vector3d(0, 1, 0)).norm(), 1e-9);
  EXPECT_NEAR(yaw_of(state->body.q_world_body), quarter, 1e-9);
  EXPECT_NEAR(state->body.omega_body.z(), 0.5, 1e-12);
  EXPECT_LT(
      (source.state_at(SimTime{from_seconds(99)})->body.p_world - Vector3d(100, 60, 3)).norm(),
      1e-9);
}

}  // namespace
}  // namespace pointflight
