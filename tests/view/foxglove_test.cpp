#include "pointflight/view/foxglove.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support.hpp"

namespace pointflight::foxglove {
namespace {

using testing::error_of;
using testing::expect_contains;

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> out;
  for (const int v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}

TEST(Foxglove, BinaryFramesAreAsTheSpecificationHasThem) {
  EXPECT_EQ(message_head(0x01020304, 0x1112131415161718),
            bytes({1, 4, 3, 2, 1, 0x18, 0x17, 0x16, 0x15, 0x14, 0x13, 0x12, 0x11}));
  EXPECT_EQ(time_frame(1), bytes({2, 1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(service_response_frame(5, 6, bytes({9, 8})),
            bytes({3, 5, 0, 0, 0, 6, 0, 0, 0, 3, 0, 0, 0, 'c', 'd', 'r', 9, 8}));
  EXPECT_EQ(playback_state_frame({PlaybackState::Status::kPaused, 2, 1.0f, true, "a"}),
            bytes({5, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 1, 1, 0, 0, 0, 'a'}));

  const auto message = bytes({1, 7, 0, 0, 0, 42, 43});
  const auto published = std::get<ClientMessage>(parse_binary(message));
  EXPECT_EQ(published.channel, 7u);
  ASSERT_EQ(published.data.size(), 2u);
  EXPECT_EQ(published.data[1], std::byte{43});
  const auto request = bytes({2, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 'c', 'd', 'r', 0xff});
  const auto called = std::get<ServiceRequest>(parse_binary(request));
  EXPECT_EQ(called.service, 1u);
  EXPECT_EQ(called.call, 2u);
  EXPECT_EQ(called.encoding, "cdr");
  EXPECT_EQ(called.data.size(), 1u);
  const auto control =
      bytes({3, 0, 0, 0, 0, 0x40, 1, 5, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 'i', 'd'});
  const auto played = std::get<PlaybackControl>(parse_binary(control));
  EXPECT_TRUE(played.play);
  EXPECT_EQ(played.speed, 2.0f);
  EXPECT_EQ(played.seek, 5);
  EXPECT_EQ(played.request, "id");
}

TEST(Foxglove, TextsAreJsonThatAnybodyReads) {
  const auto info = nlohmann::json::parse(server_info_text(
      {"n\xff", "s", {"time"}, {"cdr"}, std::pair(1'500'000'000ll, 2'000'000'001ll)}));
  EXPECT_EQ(info["op"], "serverInfo");
  EXPECT_EQ(info["dataStartTime"]["nsec"], 500'000'000);
  EXPECT_EQ(info["dataEndTime"]["sec"], 2);
  const Channel channel{3, "/a", "cdr", "std_msgs/msg/String", "string data", "ros2msg"};
  const auto channels = nlohmann::json::parse(advertise_text({&channel, 1}));
  EXPECT_EQ(channels["channels"][0]["schemaEncoding"], "ros2msg");
  EXPECT_EQ(nlohmann::json::parse(advertise_text({}))["channels"].size(), 0u);
  const ServiceRow row{1, "/reset", "std_srvs/srv/Trigger", "", "bool success\nstring message\n"};
  const auto services = nlohmann::json::parse(advertise_services_text({&row, 1}));
  EXPECT_EQ(services["services"][0]["response"]["schemaName"], "std_srvs/srv/Trigger_Response");
}

TEST(Foxglove, RequestsOfClientsAreReadOrSaidWhatIsWrongWithThem) {
  const auto s = std::get<Subscribe>(parse_text(
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2},{"id":3,"channelId":4}]})"));
  ASSERT_EQ(s.subscriptions.size(), 2u);
  EXPECT_EQ(s.subscriptions[1].channel, 4u);
  EXPECT_EQ(
      std::get<Unsubscribe>(parse_text(R"({"op":"unsubscribe","subscriptionIds":[7]})")).ids[0],
      7u);
  const auto a = std::get<ClientAdvertise>(parse_text(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/g","encoding":"cdr","schemaName":"x"}]})"));
  EXPECT_EQ(a.channels[0].topic, "/g");
  EXPECT_EQ(std::get<Ignored>(parse_text(R"({"op":"getParameters"})")).op, "getParameters");
  const std::pair<const char*, const char*> wrong[] = {
      {"", "no JSON object"},
      {"[1]", "no JSON object"},
      {R"({"op":1})", "'op' is to be a text"},
      {R"({"op":"subscribe"})", "'subscriptions' is to be a list"},
      {R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})", "'id' is to be a number"},
      {R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})", "'id'"},
      {R"({"op":"subscribe","subscriptions":[7]})", "'id' is missing"},
      {R"({"op":"unsubscribe","subscriptionIds":["x"]})", "'subscriptionIds'"},
      {R"({"op":"advertise","channels":[{"id":1}]})", "'topic' is to be a text"}};
  for (const auto& entry : wrong) {
    expect_contains(error_of([&] { static_cast<void>(parse_text(entry.first)); }), entry.second);
  }
  for (const auto& frame :
       {bytes({}),
        bytes({1, 2}),
        bytes({2, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255}),
        bytes({9}),
        bytes({3, 2, 0, 0, 0, 0}),
        bytes({3, 0, 0, 0, 0xc0, 0x7f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})}) {
    EXPECT_FALSE(error_of([&] { static_cast<void>(parse_binary(frame)); }).empty());
  }
  // deep nesting takes no stack
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  expect_contains(error_of([&] { static_cast<void>(parse_text(deep)); }), "no JSON object");
  const std::string nested =
      R"({"op": "x", "a": )" + std::string(20, '[') + std::string(20, ']') + "}";
  expect_contains(error_of([&] { static_cast<void>(parse_text(nested)); }), "too long or deep");
  const std::string fine = R"({"op": "x", "a": )" + std::string(9, '[') + std::string(9, ']') + "}";
  EXPECT_NO_THROW(static_cast<void>(parse_text(fine)));
  const std::string long_one = R"({"op": ")" + std::string(2 << 20, 'x') + "\"}";
  expect_contains(error_of([&] { static_cast<void>(parse_text(long_one)); }), "too long or deep");
}

}  // namespace
}  // namespace pointflight::foxglove
