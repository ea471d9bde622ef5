#include "pointflight/learn/policy.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "pointflight/geometry/rotation.hpp"
#include "tests/io/numpy_files.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::bytes_of;
using testing::error_of;
using testing::expect_contains;
using testing::npy;
using testing::TemporaryFolder;

using Arrays = std::map<std::string, std::string>;

std::string array(const std::string& shape, const std::vector<float>& values) {
  return npy(fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': {}, }}", shape),
             bytes_of(values));
}

std::string document(const std::string& text) {
  return npy(
      fmt::format("{{'descr': '|u1', 'fortran_order': False, 'shape': ({},), }}", text.size()),
      text);
}

std::string about(const std::string& task, int layers, const std::string& lidar = "") {
  return fmt::format(R"({{"task": "{}", "action": "velocity", "speed": 2.0, "yaw_rate": 1.5,)"
                     R"( "action_period": 0.1, "time_limit": 20.0, "base": 0.5, "layers": {}{}}})",
                     task,
                     layers,
                     lidar);
}

constexpr const char* kImage =
    R"(, "lidar": {"rows": 2, "columns": 4, "elevation": [-0.5, 0.5], "azimuth": [-3.14159265358979, )"
    R"(3.14159265358979], "range_max": 10.0, "pool": [2, 2]})";

/// One layer that gives the numbers `picked` of its inputs.
Arrays picking(const std::string& task,
               const std::vector<std::size_t>& picked,
               std::size_t inputs) {
  std::vector<float> weights(picked.size() * inputs, 0.0f);
  for (std::size_t i = 0; i < picked.size(); ++i) weights[i * inputs + picked[i]] = 1.0f;
  return {
      {"about.npy", document(about(task, 1))},
      {"weight0.npy", array(fmt::format("({}, {})", picked.size(), inputs), weights)},
      {"bias0.npy", array(fmt::format("({},)", picked.size()), std::vector(picked.size(), 0.0f))}};
}

Policy load(const TemporaryFolder& folder, const Arrays& arrays) {
  testing::write_npz(folder / "policy.npz", arrays);
  return Policy::load(folder / "policy.npz");
}

RigidBodyState somewhere() {
  RigidBodyState body;
  body.p_world = {1, 2, 3};
  body.v_world = {0.6, -0.3, 0.15};
  body.q_world_body = quaternion_from_rpy(0.1, -0.2, 1.5707963267948966);  // heads for world y
  return body;
}

TEST(Policy, SeesGoalVelocityTiltAndTime) {
  const TemporaryFolder folder;
  PolicyTarget target;
  target.goal_world = {1, 8, 4.5};  // 6 m ahead, 1.5 m up
  target.elapsed = 5.0;
  target.last_action = {0.1f, 0.2f, 0.3f, 0.4f};
  // its straight way, half of it, is added to the first three outputs
  const Vector3d base = 0.5 * Vector3d(6, 0, 1.5).normalized();
  const double expected[15] = {1,
                               0,
                               0.2,
                               0.5,
                               -0.1,
                               -0.2,
                               0.05,
                               std::nan(""),
                               std::nan(""),
                               0.25,
                               1.0 / 3.0,
                               0.1,
                               0.2,
                               0.3,
                               0.4};
  for (std::size_t i = 0; i < 15; ++i) {
    if (std::isnan(expected[i])) continue;
    const Policy policy = load(folder, picking("goal", {i}, 15));
    const auto action = policy.act({}, somewhere(), target);
    const double clamped = std::min(1.0, expected[i] + base.x());
    EXPECT_NEAR(static_cast<double>(action[0]), clamped, 1e-6) << i;
    EXPECT_NEAR(static_cast<double>(action[2]), base.z(), 1e-6);
    EXPECT_EQ(action[3], 0.0f);
  }
  // the world's z along the body's axes
  const Vector3d up = somewhere().q_world_body.conjugate() * Vector3d::UnitZ();
  const Policy tilts = load(folder, picking("goal", {0, 0, 7, 8}, 15));
  const auto action = tilts.act({}, somewhere(), target);
  EXPECT_NEAR(static_cast<double>(action[2]), up.x() + base.z(), 1e-6);
  EXPECT_NEAR(static_cast<double>(action[3]), up.y(), 1e-6);
}

/// 4 x 2 cells, 15 numbers of the state; a layer of random numbers.
Arrays facing(bool faces) {
  std::vector<float> weights;
  for (int i = 0; i < 3 * 23; ++i) weights.push_back(0.02f * static_cast<float>(i * 37 % 23 - 11));
  std::string text = about("goal", 1, kImage);
  if (faces) text.insert(text.size() - 1, R"(, "faces_goal": true)");
  return {{"about.npy", document(text)},
          {"weight0.npy", array("(3, 23)", weights)},
          {"bias0.npy", array("(3,)", {0.1f, -0.1f, 0.0f})}};
}

TEST(Policy, ThatFacesItsGoalFliesTurnedSituationsAlike) {
  const TemporaryFolder folder;
  const Policy policy = load(folder, facing(true));
  const Policy plain = load(folder, facing(false));
  const std::vector<float> ahead{0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.7f, 0.8f};
  const std::vector<float> left{
      0.4f, 0.1f, 0.2f, 0.3f, 0.8f, 0.5f, 0.6f, 0.7f};  // all to the right
  RigidBodyState body;
  body.v_world = {0.6, -0.3, 0.15};
  PolicyTarget target;
  target.goal_world = {6, 0.5, 1};
  target.last_action = {0.2f, -0.3f, 0.1f, 0.0f};
  const auto expected = plain.act(ahead, body, target);
  const auto same = policy.act(ahead, body, target);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(same[k], expected[k]);
  // the same world for a heading that is 90 degrees to the left of it: one of four columns
  body.q_world_body = quaternion_from_rpy(0, 0, 1.5707963267948966);
  target.last_action = {-0.3f, -0.2f, 0.1f, 0.0f};
  const auto turned = policy.act(left, body, target);
  EXPECT_NEAR(turned[0], expected[1], 1e-6f);
  EXPECT_NEAR(turned[1], -expected[0], 1e-6f);
  EXPECT_NEAR(turned[2], expected[2], 1e-6f);
  EXPECT_GT(std::abs(plain.act(left, body, target)[1] - turned[1]), 1e-3f);
  Arrays blind = picking("goal", {0}, 15);
  std::string text = about("goal", 1);
  blind["about.npy"] = document(text.insert(text.size() - 1, R"(, "faces_goal": true)"));
  expect_contains(error_of([&] { load(folder, blind); }), "full circle");
}

TEST(Policy, HoversByItsOwnState) {
  const TemporaryFolder folder;
  PolicyTarget target;
  target.goal_world = {1, 2.3, 3.6};
  target.elapsed = 50.0;
  Arrays still = picking("hover", {0, 1, 2, 8}, 13);
  still["about.npy"] = document(
      R"({"task": "hover", "action": "velocity", "speed": 2.0, "yaw_rate": 1.5, "action_period": 0.1,)"
      R"( "time_limit": 20.0, "base": 0.0, "layers": 1})");
  const auto action = load(folder, still).act({}, somewhere(), target);
  EXPECT_NEAR(static_cast<double>(action[0]), 0.1, 1e-6);
  EXPECT_NEAR(static_cast<double>(action[1]), 0.0, 1e-6);
  EXPECT_NEAR(static_cast<double>(action[2]), 0.2, 1e-6);
  EXPECT_EQ(action[3], 1.0f);  // time is up
}

TEST(Policy, LayersAreTanhButTheLast) {
  const TemporaryFolder folder;
  std::vector<float> first(2 * 15, 0.0f);
  first[2] = 3.0f;        // of the distance, 0.2
  first[15 + 9] = -2.0f;  // of the time, 0.25
  const Policy policy = load(folder,
                             {{"about.npy", document(about("race", 2))},
                              {"weight0.npy", array("(2, 15)", first)},
                              {"bias0.npy", array("(2,)", {0.1f, 0.0f})},
                              {"weight1.npy", array("(4, 2)", {0, 0, 0, 0, 0, 0, 0.5f, 0.25f})},
                              {"bias1.npy", array("(4,)", {0, 0, 0, 0.125f})}});
  PolicyTarget target;
  target.goal_world = {1, 8, 3};
  target.elapsed = 5.0;
  const auto action = policy.act({}, somewhere(), target);
  EXPECT_NEAR(
      static_cast<double>(action[3]), 0.5 * std::tanh(0.7) + 0.25 * std::tanh(-0.5) + 0.125, 1e-6);
}

TEST(Policy, CellsTakeTheNearestPointOrTheOneInTheirMiddle) {
  const TemporaryFolder folder;
  Arrays arrays = picking("goal", {0}, 23);
  arrays["about.npy"] = document(about("goal", 1, kImage));
  const Policy pooled = load(folder, arrays);
  // ahead and a little to the left, up: row 0, column 1 (-pi/2 to 0 is column 2 from the left)
  const std::vector<Vector3d> points = {
      {4, 1, 0.5}, {2, 0.1, 0.1}, {3, 3, 0.9}, {-30, 1, -1}, {0, 0, 0}, {1, 0, 5}};
  std::vector<float> expected(8, 1.0f);
  expected[1] = static_cast<float>(Vector3d(2, 0.1, 0.1).norm() / 10.0);
  EXPECT_EQ(pooled.image_of(points), expected);
  std::string single = about("goal", 1, kImage);
  single.replace(single.find("[2, 2]"), 6, "[1, 1]");
  arrays["about.npy"] = document(single);
  expected[1] =
      static_cast<float>(Vector3d(3, 3, 0.9).norm() / 10.0);  // 45 degrees, nearly its middle
  EXPECT_EQ(load(folder, arrays).image_of(points), expected);
  const auto action = load(folder, arrays).act(expected, somewhere(), {});
  EXPECT_GT(action[0], -1.0f);
}

TEST(Policy, BadFilesSayWhat) {
  const TemporaryFolder folder;
  const Arrays good = picking("goal", {0, 1, 2}, 15);
  const auto error = [&](const std::string& name, const std::string& bytes) {
    Arrays arrays = good;
    if (bytes.empty()) {
      arrays.erase(name);
    } else {
      arrays[name] = bytes;
    }
    return error_of([&] { load(folder, arrays); });
  };
  EXPECT_NO_THROW(load(folder, good));
  expect_contains(error("about.npy", ""), "no array 'about'");
  expect_contains(error("about.npy", document("hello")), "no JSON object");
  expect_contains(error("about.npy", array("(1,)", {1e30f})), "'about' is no text");
  expect_contains(error("about.npy", document("{}")), "lacks what is needed");
  expect_contains(error("about.npy", document(about("explore", 1))), "task 'explore'");
  expect_contains(error("about.npy", document(about("goal", 2))), "a layer is missing");
  expect_contains(error("about.npy", document(about("goal", -1))), "no layers, or too many");
  expect_contains(error("about.npy", document(about("goal", 1, kImage))), "layer 0 does not fit");
  expect_contains(error("weight0.npy", ""), "a layer is missing");
  expect_contains(error("bias0.npy", array("(2,)", {0, 0})), "layer 0 does not fit");
  std::string rates = about("goal", 1);
  rates.replace(rates.find("\"velocity\""), 10, "\"body_rates\"");
  expect_contains(error("about.npy", document(rates)), "gives body_rates");
  std::string fast = about("goal", 1);
  fast.replace(fast.find("2.0"), 3, "1e9");
  expect_contains(error("about.npy", document(fast)), "figures make no sense");
  std::string blind = about("goal", 1, kImage);
  blind.replace(blind.find("\"rows\": 2"), 9, "\"rows\": 0");
  expect_contains(error("about.npy", document(blind)), "LiDAR makes no sense");
}

}  // namespace
}  // namespace pointflight
