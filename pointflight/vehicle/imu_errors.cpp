#include "pointflight/vehicle/imu_errors.hpp"

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"

namespace pointflight {

void describe_noise(SettingsVisitor& v, ImuErrors& e) {
  v.value({"gyro_noise_density", "rad/s/sqrt(Hz)", "white noise", 0, 1}, e.gyro.noise_density);
  v.value({"gyro_bias_walk", "rad/s^2/sqrt(Hz)", "random walk of the bias", 0, 1},
          e.gyro.bias_walk);
  v.value({"accel_noise_density", "m/s^2/sqrt(Hz)", "white noise", 0, 10}, e.accel.noise_density);
  v.value({"accel_bias_walk", "m/s^3/sqrt(Hz)", "random walk of the bias", 0, 10},
          e.accel.bias_walk);
}

void describe_beyond_noise(SettingsVisitor& v, ImuErrors& e) {
  v.value({"gyro_bias_instability",
           "rad/s",
           "flicker noise: the Allan deviation has a floor of 0.664 times this",
           0,
           1},
          e.gyro.bias_instability);
  v.value({"accel_bias_instability", "m/s^2", "the same of the accelerometer", 0, 10},
          e.accel.bias_instability);
  v.value({"gyro_turn_on_bias", "rad/s", "deviation of each axis' bias from run to run", 0, 1},
          e.gyro.turn_on_bias);
  v.value({"accel_turn_on_bias", "m/s^2", "the same of the accelerometer", 0, 10},
          e.accel.turn_on_bias);
  v.value({"gyro_scale_error", "", "deviation of each axis' scale from 1", 0, 0.5},
          e.gyro.scale_error);
  v.value({"accel_scale_error", "", "the same of the accelerometer", 0, 0.5}, e.accel.scale_error);
  v.value({"gyro_misalignment_deg", "deg", "by which each axis leans to another, deviation", 0, 20},
          e.gyro.misalignment_deg);
  v.value({"accel_misalignment_deg", "deg", "the same of the accelerometer", 0, 20},
          e.accel.misalignment_deg);
  v.value({"gyro_g_sensitivity",
           "rad/s per m/s^2",
           "of the gyro's bias to each component of the specific force, deviation",
           0,
           1},
          e.gyro_g_sensitivity);
  v.value({"gyro_range", "rad/s", "saturates at plus and minus this; 0: never", 0, 1000},
          e.gyro.range);
  v.value({"accel_range", "m/s^2", "the same of the accelerometer", 0, 1e5}, e.accel.range);
  v.value({"bits", "", "that a range from minus to plus is read out with; 0: not rounded", 0, 32},
          e.bits);
  v.value({"accel_bits", "", "of the accelerometer, if it has others; 0: as bits", 0, 32},
          e.accel_bits);
  v.value({"clock_offset", "s", "time stamps are late by this", -1, 1}, e.clock_offset);
  v.value({"clock_jitter", "s", "deviation of each time stamp", 0, 0.1}, e.clock_jitter);
}

void describe(SettingsVisitor& v, ImuPart& p) {
  v.value({"title", "", "vendor and model"}, p.title);
  v.value({"source", "", "where the figures come from"}, p.source);
  describe_noise(v, p.errors);
  describe_beyond_noise(v, p.errors);
}

ImuPart load_imu_part(const std::string& name) {
  SettingsReader reader(find_model("imus", name));
  ImuPart part;
  describe(reader, part);
  reader.finish();
  return part;
}

}  // namespace pointflight
