#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "pointflight/run/order.hpp"
#include "pointflight/sim/simulation.hpp"
#include "ros_common/profile.hpp"
#include "ros_common/wire.hpp"

namespace pointflight {

/// One topic that is read, for one vehicle and one kind of message.
struct InputStream {
  RosInput settings;        ///< Names written out.
  Topic topic;              ///< Where it is read, and its type.
  std::size_t vehicle = 0;  ///< Number in the fleet; of a shared topic each has a stream.
  bool for_all = false;     ///< A topic that all vehicles share.
};

/// The streams of a profile in a run.
std::vector<InputStream> input_streams(const Simulation& simulation, const RosProfile& profile);

/// What a vehicle's orders are made with.
struct OrderContext {
  double mass = 1.0;        ///< kg
  double thrust_max = 0.0;  ///< Of all rotors, N: what a thrust of 1 stands for.
  MotionLimits motion;      ///< Of goals.
  /// What frames may be called in what comes in, without leading slashes.
  ///@{
  std::string world_frame, world_alias, body_frame;
  ///@}
};

/// The order that a message stands for. Nothing, and the reason, where it is malformed or in a
/// frame that is not known.
std::optional<Order> order_of(const InputStream& stream,
                              Wire wire,
                              const Received& received,
                              const OrderContext& context,
                              std::string& reason);

/// Takes messages from the threads of transports and gives orders to the one that flies.
class Inbox {
 public:
  /// Both must outlive the inbox.
  Inbox(const Simulation& simulation, const RosProfile& profile);

  /// Subscribes to everything that the profile reads, and answers the services of the run.
  void connect(Transport& transport);

  /// Orders in the order in which they came.
  std::vector<Order> take();

  /// Messages that were left out, and why the last one was.
  struct Refused {
    std::uint64_t count = 0;  ///< Since the start.
    std::string last;         ///< One line for users; empty where none was.
  };
  /// Callable from any thread.
  [[nodiscard]] Refused refused() const;
  /// Why the first message of each topic was left out; each is told once.
  std::vector<std::string> take_new_reasons();

 private:
  void receive(const InputStream& stream, Wire wire, const Received& received);
  void serve(const Service& service, Transport& transport);
  void push(Order order);

  const Simulation& simulation_;
  RosProfile profile_;
  std::vector<OrderContext> contexts_;  ///< Of each vehicle.
  mutable std::mutex mutex_;
  std::vector<Order> orders_;
  Refused refused_;
  std::set<std::string> refused_topics_;
  std::vector<std::string> new_reasons_;
};

}  // namespace pointflight
