#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/ros/common/bridge.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight::testing {

/// Keeps what it gets.
class Keeper : public Outlet {
 public:
  explicit Keeper(Wire wire = Wire::kCdr) : wire_(wire) {}
  [[nodiscard]] Wire wire() const override { return wire_; }
  int advertise(const Topic& topic) override {
    topics.push_back(topic);
    return static_cast<int>(topics.size()) - 1;
  }
  [[nodiscard]] bool has_readers(int /*topic*/) const override { return true; }
  void send(int topic, const Bytes& bytes, std::int64_t time) override {
    EXPECT_GE(time, last_);
    last_ = time;
    sent.push_back({topic, time, bytes});
    for (const std::byte b : *bytes) all.push_back(b);
  }

  /// Messages of a topic.
  template <class M>
  std::vector<M> of(const std::string& name) const {
    std::vector<M> messages;
    for (const Sent& s : sent) {
      const Topic& topic = topics[static_cast<std::size_t>(s.topic)];
      if (topic.name != name) continue;
      EXPECT_EQ(topic.type.md5, message_type<M>().md5) << name;
      const auto message =
          wire_ == Wire::kCdr ? decode<Wire::kCdr, M>(*s.bytes) : decode<Wire::kRos1, M>(*s.bytes);
      EXPECT_TRUE(message) << name;
      if (message) messages.push_back(*message);
    }
    return messages;
  }

  struct Sent {
    int topic;
    std::int64_t time;
    Bytes bytes;
  };
  std::vector<Topic> topics;
  std::vector<Sent> sent;
  std::vector<std::byte> all;

 private:
  Wire wire_;
  std::int64_t last_ = 0;
};

/// What a run's outlet gets.
inline Keeper kept(const Scenario& scenario,
                   const std::shared_ptr<const SurfelMap>& map,
                   const RosProfile& profile) {
  const Executor executor(1);
  Simulation simulation(scenario, map, executor);
  RosBridge bridge(describe_run(simulation), profile, std::chrono::seconds(1000));
  Keeper keeper;
  bridge.add(keeper);
  bridge.start();
  while (simulation.step(bridge)) bridge.on_time(simulation.time());
  return keeper;
}

/// The orders of a message in CDR for a vehicle, and in `reason` why there are none.
template <class M>
std::vector<Order> orders_for(const std::string& kind,
                              const M& message,
                              const OrderContext& context,
                              std::string& reason) {
  InputStream stream;
  stream.topic.name = "/in";
  stream.type = input_types().find(kind);
  const auto bytes = encode<Wire::kCdr>(message);
  Received received;
  received.data = bytes.data();
  received.size = bytes.size();
  return orders_of(stream, Wire::kCdr, received, {&context, 1}, reason);
}

}  // namespace pointflight::testing
