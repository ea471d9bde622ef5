// What can be told to a run from a ROS: the table of kinds, each with what reads its messages, and
// the inbox that turns them into orders. To add a kind: a function for `ordered_by` and a row in
// `input_types()`.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "pointflight/core/registry.hpp"
#include "pointflight/ros/common/codec.hpp"
#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/map_frame.hpp"
#include "pointflight/ros/common/profile.hpp"
#include "pointflight/ros/common/services.hpp"
#include "pointflight/ros/common/wire.hpp"
#include "pointflight/run/order.hpp"
#include "pointflight/sim/run_description.hpp"

namespace pointflight {

/// What a vehicle's orders are made with.
struct OrderContext {
  std::size_t vehicle = 0;  ///< Number in the fleet.
  double mass = 1.0;        ///< kg
  double thrust_max = 0.0;  ///< Of all rotors, N: what a thrust of 1 stands for.
  MotionLimits motion;      ///< Of goals.
  /// What frames may be called in what comes in, without leading slashes.
  ///@{
  std::string world_frame, world_alias, body_frame;
  ///@}
  MapFrame map_frame;  ///< Positions may be in it, if it is used.
};

/// A message that was read, as an order for any vehicle. Nothing, and `why` in words, if it
/// cannot be one.
using OrderMaker =
    std::function<std::optional<Order>(const OrderContext& context, std::string& why)>;

/// How the orders of a row come about: `ordered_by`.
struct InputMaker {
  /// The type that it is read with. One topic has one type: ROS 2's tools take no other.
  MessageType (*type)(const RosInput& input) = nullptr;
  /// Empty if the bytes are no such message.
  OrderMaker (*read)(const RosInput& input, Wire wire, const Received& received) = nullptr;
};

/// A row of the table of kinds.
struct InputType {
  std::string name;       ///< In profiles.
  std::string help;       ///< For docs/ros.md; half a sentence.
  InputMaker make;        ///< Its orders.
  bool answers = false;   ///< A planner's: what lockstep waits for.
  bool one_shot = false;  ///< Sent once and counts; others come in streams, and the next one mends.
  const ServiceType* service = nullptr;  ///< That does the same, of what is about the run.
  /// Not about a vehicle.
  [[nodiscard]] bool is_of_run() const { return service != nullptr; }
};

/// All kinds. Programs may add to it before they read a profile.
Registry<InputType>& input_types();

/// An order for the vehicle of a context.
inline std::optional<Order> told(const OrderContext& context, Command command) {
  return VehicleOrder{context.vehicle, std::move(command), false};
}

/// The message in a received one's bytes, if it has our definition.
template <class M>
std::optional<M> message_in(Wire wire, const Received& received) {
  const std::span bytes(received.data, received.size);
  if (wire == Wire::kCdr) return decode<Wire::kCdr, M>(bytes);
  static const std::string md5 = md5_of(describe_message<M>(1));
  if (received.md5 != md5) return std::nullopt;
  return decode<Wire::kRos1, M>(bytes);
}

namespace detail {

template <class Function>
struct OrderFunction;
template <class M>
struct OrderFunction<std::optional<Order> (*)(
    const M&, const RosInput&, const OrderContext&, std::string&)> {
  using Message = M;
};

}  // namespace detail

/// Orders by a function `std::optional<Order> (const M&, const RosInput&, const OrderContext&,
/// std::string& why)` of a message `M`.
template <auto order>
InputMaker ordered_by() {
  using M = typename detail::OrderFunction<decltype(order)>::Message;
  return {[](const RosInput&) { return message_type<M>(); },
          [](const RosInput& input, Wire wire, const Received& received) -> OrderMaker {
            auto message = message_in<M>(wire, received);
            if (!message) return {};
            return [input, m = std::move(*message)](const OrderContext& context, std::string& why) {
              return order(m, input, context, why);
            };
          }};
}

/// One topic that is read, for one vehicle and one kind of message.
struct InputStream {
  const InputType* type = nullptr;  ///< Its row of the table; never null.
  RosInput settings;                ///< Names written out.
  Topic topic;                      ///< Where it is read, and its type.
  std::size_t vehicle = 0;          ///< Number in the fleet.
  bool for_all = false;             ///< A topic that all vehicles share.
};

/// The streams of a profile in a run.
std::vector<InputStream> input_streams(const RunDescription& run, const RosProfile& profile);

/// The orders that a message stands for: one for each context. None, and the reason, if it is
/// malformed or in a frame that is not known.
std::vector<Order> orders_of(const InputStream& stream,
                             Wire wire,
                             const Received& received,
                             std::span<const OrderContext> contexts,
                             std::string& reason);

/// Takes messages from the threads of transports and gives orders to the one that flies.
class Inbox {
 public:
  /// Both are copied as far as they are needed.
  Inbox(const RunDescription& run, const RosProfile& profile);

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
  void push(std::vector<Order> orders);

  std::vector<InputStream> streams_;
  std::vector<Service> services_;
  std::vector<OrderContext> contexts_;      ///< By number.
  std::vector<OrderContext> own_contexts_;  ///< Of vehicles that this process flies.
  mutable std::mutex mutex_;
  std::vector<Order> orders_;
  Refused refused_;
  std::set<std::string> refused_topics_;
  std::vector<std::string> new_reasons_;
};

}  // namespace pointflight
