#include "pointflight/learn/policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/npz_arrays.hpp"

// What observations are is said in python/pointflight/gym/tasks.py (`Goal`, `Hover`), images.py and
// observer.py; the network in policy.py.
namespace pointflight {
namespace {

using nlohmann::json;

constexpr double kWay = 30.0;    // m: unit of distances
constexpr double kHeight = 3.0;  // m: of heights
constexpr double kSpeed = 3.0;   // m/s: of velocities
constexpr std::size_t kMostLayers = 64;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw InputError(
      fmt::format("{}: {}; a policy is what pointflight.gym.Policy.save writes", path, what));
}

/// The sum of products in double, so that no order of it shows.
double dot(std::span<const float> a, std::span<const float> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  }
  return sum;
}

double tanh_of(double x) {
  if (std::abs(x) < 1e-3) return x - x * x * x / 3.0;
  return 1.0 - 2.0 / (math::exp(2.0 * x) + 1.0);
}

PolicyImage image_from(const json& lidar) {
  PolicyImage image;
  image.rows = lidar.at("rows").get<std::size_t>();
  image.columns = lidar.at("columns").get<std::size_t>();
  image.elevation = lidar.at("elevation").get<std::array<double, 2>>();
  image.azimuth = lidar.at("azimuth").get<std::array<double, 2>>();
  image.range_max = lidar.at("range_max").get<double>();
  image.pooled =
      lidar.at("pool").get<std::array<std::size_t, 2>>() != std::array<std::size_t, 2>{1, 1};
  return image;
}

PolicySettings settings_from(const json& about) {
  PolicySettings settings;
  settings.task = about.at("task").get<std::string>();
  settings.action = about.at("action").get<std::string>();
  settings.speed = about.at("speed").get<double>();
  settings.yaw_rate = about.at("yaw_rate").get<double>();
  settings.action_period = about.at("action_period").get<double>();
  settings.time_limit = about.at("time_limit").get<double>();
  settings.base = about.at("base").get<double>();
  settings.faces_goal = about.value("faces_goal", false);
  if (about.contains("lidar")) settings.image = image_from(about.at("lidar"));
  return settings;
}

void check(const PolicySettings& s) {
  if (s.task != "goal" && s.task != "race" && s.task != "hover") {
    throw InputError(fmt::format(
        "{}: has learned the task '{}'; goal, race and hover are flown", s.path, excerpt(s.task)));
  }
  if (s.action != "velocity") {
    throw InputError(fmt::format(
        "{}: gives {}; policies that give velocities are flown", s.path, excerpt(s.action)));
  }
  const auto is_within = [](double value, double least, double most) {
    return value >= least && value <= most;
  };
  if (!is_within(s.speed, 0.0, 100.0) || !is_within(s.yaw_rate, 0.0, 100.0) ||
      !is_within(s.action_period, 1e-3, 10.0) || !is_within(s.time_limit, 1e-3, 1e6) ||
      !is_within(s.base, -10.0, 10.0)) {
    fail(s.path, "its figures make no sense");
  }
  if (s.faces_goal && (!s.image || s.task == "hover" ||
                       std::abs(s.image->azimuth[1] - s.image->azimuth[0] - 2.0 * kPi) > 1e-6)) {
    fail(s.path, "to face its goal it needs one, and an image of the full circle");
  }
  if (!s.image) return;
  const PolicyImage& image = *s.image;
  const bool has_cells = image.rows >= 1 && image.columns >= 1 && image.rows <= 1000 &&
                         image.columns <= 1000 && image.range_max > 0.0 && image.range_max < 1e4;
  if (!has_cells || !(image.elevation[0] < image.elevation[1]) ||
      !(image.azimuth[0] < image.azimuth[1]) || !is_within(image.elevation[0], -kPi, kPi) ||
      !is_within(image.elevation[1], -kPi, kPi) || !is_within(image.azimuth[0], -7.0, 7.0) ||
      !is_within(image.azimuth[1], -7.0, 7.0)) {
    fail(s.path, "its LiDAR makes no sense");
  }
}

/// The document in an array of bytes.
json document_in(const std::map<std::string, NumberArray>& arrays, const std::string& path) {
  const auto about = arrays.find("about");
  if (about == arrays.end()) fail(path, "it has no array 'about'");
  std::string text;
  for (const float byte : about->second.values) {
    if (!(byte >= 0.0f && byte <= 255.0f)) fail(path, "'about' is no text");
    text += static_cast<char>(static_cast<unsigned char>(byte));
  }
  json document = json::parse(text, nullptr, false);
  if (!document.is_object()) fail(path, "'about' is no JSON object");
  return document;
}

/// Unit vectors to the middles of its cells.
std::vector<Vector3d> middles_of(const PolicyImage& image) {
  std::vector<Vector3d> middles;
  const auto part = [](double from, double to, std::size_t i, std::size_t count) {
    return from + (to - from) * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
  };
  for (std::size_t row = 0; row < image.rows; ++row) {
    const auto up = math::sincos(part(image.elevation[1], image.elevation[0], row, image.rows));
    for (std::size_t column = 0; column < image.columns; ++column) {
      const auto around =
          math::sincos(part(image.azimuth[1], image.azimuth[0], column, image.columns));
      middles.emplace_back(up.cos * around.cos, up.cos * around.sin, up.sin);
    }
  }
  return middles;
}

/// Which of `count` parts from `from` to `to` holds a value.
std::optional<std::size_t> part_with(double value, double from, double to, std::size_t count) {
  const double part = std::floor((value - from) / (to - from) * static_cast<double>(count));
  if (!(part >= 0.0 && part < static_cast<double>(count))) return std::nullopt;
  return static_cast<std::size_t>(part);
}

/// Turns the two numbers of a level vector.
void turn_left(float* xy, const math::SinCos& by) {
  const auto x = static_cast<double>(xy[0]);
  const auto y = static_cast<double>(xy[1]);
  xy[0] = static_cast<float>(by.cos * x - by.sin * y);
  xy[1] = static_cast<float>(by.sin * x + by.cos * y);
}

/// Each column's numbers in the one that lies so many to the right.
std::vector<float> with_columns_moved(std::span<const float> image,
                                      std::size_t columns,
                                      std::int64_t by) {
  std::vector<float> moved(image.size());
  const auto all = static_cast<std::int64_t>(columns);
  for (std::size_t i = 0; i < image.size(); ++i) {
    const auto column = static_cast<std::int64_t>(i % columns);
    const auto to = static_cast<std::size_t>(((column + by) % all + all) % all);
    moved[i - i % columns + to] = image[i];
  }
  return moved;
}

}  // namespace

Policy Policy::load(const std::string& path) {
  const auto arrays = read_npz_arrays(path);
  const json about = document_in(arrays, path);
  Policy policy;
  std::size_t layers = 0;
  try {
    policy.settings_ = settings_from(about);
    layers = about.at("layers").get<std::size_t>();
  } catch (const json::exception& error) {
    fail(path, fmt::format("'about' lacks what is needed ({})", error.what()));
  }
  policy.settings_.path = path;
  check(policy.settings_);
  if (layers < 1 || layers > kMostLayers) fail(path, "it has no layers, or too many");
  const auto& image = policy.settings_.image;
  std::size_t inputs = (image ? image->rows * image->columns : 0) + policy.state_of({}, {}).size();
  for (std::size_t i = 0; i < layers; ++i) {
    const auto weights = arrays.find(fmt::format("weight{}", i));
    const auto biases = arrays.find(fmt::format("bias{}", i));
    if (weights == arrays.end() || biases == arrays.end()) fail(path, "a layer is missing");
    const std::vector<std::size_t>& shape = weights->second.shape;
    if (shape.size() != 2 || shape[1] != inputs || shape[0] < 1 ||
        biases->second.shape != std::vector{shape[0]}) {
      fail(path, fmt::format("layer {} does not fit to what comes before it", i));
    }
    policy.layers_.push_back({shape[0], weights->second.values, biases->second.values});
    inputs = shape[0];
  }
  if (inputs > 4) fail(path, fmt::format("it has {} outputs; 4 at most", inputs));
  if (image) policy.middles_ = middles_of(*image);
  return policy;
}

std::vector<float> Policy::image_of(std::span<const Vector3d> points) const {
  std::vector<float> cells(middles_.size(), 1.0f);
  if (!settings_.image) return cells;
  const PolicyImage& image = *settings_.image;
  std::vector<double> closeness(image.pooled ? 0 : cells.size(), -2.0);
  for (const Vector3d& point : points) {
    const double distance = point.norm();
    if (!(distance > 1e-3)) continue;
    const double up = math::asin(std::clamp(point.z() / distance, -1.0, 1.0));
    const double around = math::atan2(point.y(), point.x());
    const auto row = part_with(up, image.elevation[1], image.elevation[0], image.rows);
    const auto column = part_with(around, image.azimuth[1], image.azimuth[0], image.columns);
    if (!row || !column) continue;
    const std::size_t cell = *row * image.columns + *column;
    const auto share = static_cast<float>(std::min(1.0, distance / image.range_max));
    if (image.pooled) {
      cells[cell] = std::min(cells[cell], share);
      continue;
    }
    const double close = middles_[cell].dot(point) / distance;
    if (close < closeness[cell]) continue;  // of equal ones the last
    closeness[cell] = close;
    cells[cell] = share;
  }
  return cells;
}

std::vector<float> Policy::state_of(const RigidBodyState& body, const PolicyTarget& target) const {
  const auto heading = math::sincos(yaw_of(body.q_world_body));
  const auto level = [&](const Vector3d& v) {
    return Vector3d(heading.cos * v.x() + heading.sin * v.y(),
                    heading.cos * v.y() - heading.sin * v.x(),
                    v.z());
  };
  const Vector3d way = level(target.goal_world - body.p_world);
  const Vector3d v = level(body.v_world) / kSpeed;
  const Vector3d up_body = body.q_world_body.conjugate() * Vector3d::UnitZ();
  const double gone = std::min(1.0, target.elapsed / settings_.time_limit);
  std::vector<double> numbers;
  if (settings_.task == "hover") {
    numbers = {way.x() / 3.0,
               way.y() / 3.0,
               way.z() / 3.0,
               v.x(),
               v.y(),
               v.z(),
               up_body.x(),
               up_body.y(),
               gone};
  } else {
    const double flat = std::max(std::sqrt(way.x() * way.x() + way.y() * way.y()), 1e-6);
    numbers = {way.x() / flat,
               way.y() / flat,
               std::min(flat, kWay) / kWay,
               std::clamp(way.z() / kHeight, -1.0, 1.0),
               v.x(),
               v.y(),
               v.z(),
               up_body.x(),
               up_body.y(),
               gone,
               std::min(1.0, 2.0 / flat)};
  }
  std::vector<float> state;
  for (const double number : numbers) state.push_back(static_cast<float>(number));
  state.insert(state.end(), target.last_action.begin(), target.last_action.end());
  return state;
}

std::vector<float> Policy::through(std::vector<float> numbers) const {
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const Layer& layer = layers_[i];
    std::vector<float> outputs;
    for (std::size_t k = 0; k < layer.outputs; ++k) {
      const std::span row(layer.weights.data() + k * numbers.size(), numbers.size());
      const double sum = dot(row, numbers) + static_cast<double>(layer.biases[k]);
      outputs.push_back(static_cast<float>(i + 1 < layers_.size() ? tanh_of(sum) : sum));
    }
    numbers = std::move(outputs);
  }
  return numbers;
}

/// What the network says, and its share of the straight way.
std::vector<float> Policy::outputs(std::span<const float> image,
                                   std::span<const float> state) const {
  std::vector<float> features;
  for (const float share : image) {
    features.push_back(1.0f / (1.0f + static_cast<float>(settings_.image->range_max) * share));
  }
  features.insert(features.end(), state.begin(), state.end());
  std::vector<float> outputs = through(std::move(features));
  outputs.resize(4, 0.0f);
  if (settings_.base != 0.0) {
    const Vector3d way(static_cast<double>(state[0] * state[2]) * kWay,
                       static_cast<double>(state[1] * state[2]) * kWay,
                       static_cast<double>(state[3]) * kHeight);
    const Vector3d unit = way / std::max(way.norm(), 1e-6);
    for (std::size_t k = 0; k < 3; ++k) {
      outputs[k] += static_cast<float>(settings_.base * unit[static_cast<Eigen::Index>(k)]);
    }
  }
  return outputs;
}

std::array<float, 4> Policy::act(std::span<const float> image,
                                 const RigidBodyState& body,
                                 const PolicyTarget& target) const {
  std::vector<float> state = state_of(body, target);
  std::vector<float> said;
  if (settings_.faces_goal) {
    const std::size_t columns = settings_.image->columns;
    const double column = 2.0 * kPi / static_cast<double>(columns);
    const double bearing =
        math::atan2(static_cast<double>(state[1]), static_cast<double>(state[0]));
    const std::int64_t by = floor_to_integer(bearing / column + 0.5);
    const auto turn = math::sincos(static_cast<double>(by) * column);
    for (const std::size_t x : {0, 4, 7, 11}) turn_left(state.data() + x, {-turn.sin, turn.cos});
    said = outputs(with_columns_moved(image, columns, by), state);
    turn_left(said.data(), turn);
  } else {
    said = outputs(image, state);
  }
  std::array<float, 4> actions{};
  for (std::size_t k = 0; k < 4; ++k) {
    actions[k] = std::isfinite(said[k]) ? std::clamp(said[k], -1.0f, 1.0f) : 0.0f;
  }
  return actions;
}

}  // namespace pointflight
