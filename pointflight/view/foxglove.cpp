#include "pointflight/view/foxglove.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "pointflight/core/input_error.hpp"
#include "pointflight/view/internal/small_json-inl.hpp"

namespace pointflight::foxglove {
namespace {

using nlohmann::json;

constexpr std::size_t kMostItems = 10000;   // of a list in one frame
constexpr std::size_t kLongestText = 4096;  // of a name

/// JSON whose texts may hold anything: what is no UTF-8 is replaced.
std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

json time_of(std::int64_t ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  return {{"sec", ns / kSecond}, {"nsec", ns % kSecond}};
}

/// Numbers as the protocol has them: little endian, whatever the machine.
class Writer {
 public:
  explicit Writer(std::uint8_t opcode) { put(opcode); }
  template <class T>
  void put(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
  }
  void put_float(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    put(bits);
  }
  void put_text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    const auto* data = reinterpret_cast<const std::byte*>(text.data());
    bytes_.insert(bytes_.end(), data, data + text.size());
  }
  void put_bytes(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : left_(bytes) {}
  template <class T>
  T take() {
    need(sizeof(T));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value |= static_cast<std::uint64_t>(std::to_integer<std::uint8_t>(left_[i])) << (8 * i);
    }
    left_ = left_.subspan(sizeof(T));
    return static_cast<T>(value);
  }
  float take_float() {
    const auto bits = take<std::uint32_t>();
    float value = 0.0f;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  std::string take_text() {
    const auto size = take<std::uint32_t>();
    if (size > kLongestText) throw InputError("a text in a binary frame is too long");
    need(size);
    std::string text(reinterpret_cast<const char*>(left_.data()), size);
    left_ = left_.subspan(size);
    return text;
  }
  [[nodiscard]] std::span<const std::byte> rest() const { return left_; }

 private:
  void need(std::size_t size) const {
    if (left_.size() < size) throw InputError("a binary frame is cut off");
  }
  std::span<const std::byte> left_;
};

// ---- clients' JSON ----

const json& list_in(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_array()) {
    throw InputError(fmt::format("'{}' is to be a list", name));
  }
  if (found->size() > kMostItems) throw InputError(fmt::format("'{}' is too long", name));
  return *found;
}

std::uint32_t number_of(const json& value, const char* name) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xffffffffu) {
    throw InputError(fmt::format("'{}' is to be a number from 0 to 4294967295", name));
  }
  return static_cast<std::uint32_t>(value.get<std::uint64_t>());
}

std::uint32_t number_in(const json& object, const char* name) {
  if (!object.is_object() || !object.contains(name)) {
    throw InputError(fmt::format("'{}' is missing", name));
  }
  return number_of(object[name], name);
}

std::string text_in(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_string()) {
    throw InputError(fmt::format("'{}' is to be a text", name));
  }
  const auto& text = found->get_ref<const std::string&>();
  if (text.size() > kLongestText) throw InputError(fmt::format("'{}' is too long", name));
  return text;
}

std::vector<std::uint32_t> numbers_in(const json& object, const char* name) {
  std::vector<std::uint32_t> numbers;
  for (const json& value : list_in(object, name)) numbers.push_back(number_of(value, name));
  return numbers;
}

}  // namespace

std::string server_info_text(const ServerInfo& info) {
  json out = {{"op", "serverInfo"},
              {"name", info.name},
              {"capabilities", info.capabilities},
              {"supportedEncodings", info.encodings},
              {"metadata", json::object()},
              {"sessionId", info.session}};
  if (info.range) {
    out["dataStartTime"] = time_of(info.range->first);
    out["dataEndTime"] = time_of(info.range->second);
  }
  return dumped(out);
}

std::string advertise_text(std::span<const Channel> channels) {
  json list = json::array();
  for (const Channel& c : channels) {
    list.push_back({{"id", c.id},
                    {"topic", c.topic},
                    {"encoding", c.encoding},
                    {"schemaName", c.schema_name},
                    {"schema", c.schema},
                    {"schemaEncoding", c.schema_encoding}});
  }
  return dumped({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string advertise_services_text(std::span<const ServiceRow> services) {
  json list = json::array();
  for (const ServiceRow& s : services) {
    const auto half = [&](const char* suffix, const std::string& schema) {
      return json{{"encoding", "cdr"},
                  {"schemaName", s.type + suffix},
                  {"schemaEncoding", "ros2msg"},
                  {"schema", schema}};
    };
    // the older keys beside the newer ones: clients of either name know one of them
    list.push_back({{"id", s.id},
                    {"name", s.name},
                    {"type", s.type},
                    {"request", half("_Request", s.request_schema)},
                    {"response", half("_Response", s.response_schema)},
                    {"requestSchema", s.request_schema},
                    {"responseSchema", s.response_schema}});
  }
  return dumped({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string status_text(Level level, std::string_view message) {
  return dumped({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}});
}

std::string service_failure_text(std::uint32_t service,
                                 std::uint32_t call,
                                 std::string_view message) {
  return dumped({{"op", "serviceCallFailure"},
                 {"serviceId", service},
                 {"callId", call},
                 {"message", message}});
}

std::vector<std::byte> message_head(std::uint32_t subscription, std::int64_t time) {
  Writer writer(1);
  writer.put(subscription);
  writer.put(time);
  return writer.take();
}

std::vector<std::byte> time_frame(std::int64_t time) {
  Writer writer(2);
  writer.put(time);
  return writer.take();
}

std::vector<std::byte> service_response_frame(std::uint32_t service,
                                              std::uint32_t call,
                                              std::span<const std::byte> response) {
  Writer writer(3);
  writer.put(service);
  writer.put(call);
  writer.put_text("cdr");
  writer.put_bytes(response);
  return writer.take();
}

std::vector<std::byte> playback_state_frame(const PlaybackState& state) {
  Writer writer(5);
  writer.put(static_cast<std::uint8_t>(state.status));
  writer.put(state.time);
  writer.put_float(state.speed);
  writer.put(static_cast<std::uint8_t>(state.did_seek ? 1 : 0));
  writer.put_text(state.request);
  return writer.take();
}

TextRequest parse_text(std::string_view frame) {
  const json request = parse_small_json(frame);
  if (request.is_discarded() || !request.is_object()) {
    throw InputError("a text frame is no JSON object, or too long or deep for a request");
  }
  const std::string op = text_in(request, "op");
  if (op == "subscribe") {
    Subscribe subscribe;
    for (const json& s : list_in(request, "subscriptions")) {
      subscribe.subscriptions.push_back({number_in(s, "id"), number_in(s, "channelId")});
    }
    return subscribe;
  }
  if (op == "unsubscribe") return Unsubscribe{numbers_in(request, "subscriptionIds")};
  if (op == "advertise") {
    ClientAdvertise advertise;
    for (const json& c : list_in(request, "channels")) {
      const std::uint32_t id = number_in(c, "id");
      advertise.channels.push_back(
          {id, text_in(c, "topic"), text_in(c, "encoding"), text_in(c, "schemaName")});
    }
    return advertise;
  }
  if (op == "unadvertise") return ClientUnadvertise{numbers_in(request, "channelIds")};
  return Ignored{op};
}

BinaryRequest parse_binary(std::span<const std::byte> frame) {
  Reader reader(frame);
  const auto opcode = reader.take<std::uint8_t>();
  if (opcode == 1) {
    const auto channel = reader.take<std::uint32_t>();
    return ClientMessage{channel, reader.rest()};
  }
  if (opcode == 2) {
    ServiceRequest request;
    request.service = reader.take<std::uint32_t>();
    request.call = reader.take<std::uint32_t>();
    request.encoding = reader.take_text();
    request.data = reader.rest();
    return request;
  }
  if (opcode == 3) {
    PlaybackControl control;
    const auto command = reader.take<std::uint8_t>();
    if (command > 1) throw InputError(fmt::format("playback command {} is none", command));
    control.play = command == 0;
    control.speed = reader.take_float();
    const bool seeks = reader.take<std::uint8_t>() != 0;
    const auto time = reader.take<std::int64_t>();
    if (seeks) control.seek = time;
    control.request = reader.take_text();
    if (!std::isfinite(control.speed) || control.speed <= 0.0f || control.speed > 1000.0f) {
      throw InputError("a playback's speed is above 0 and at most 1000");
    }
    return control;
  }
  throw InputError(fmt::format("binary opcode {} is none of a client's", opcode));
}

}  // namespace pointflight::foxglove
