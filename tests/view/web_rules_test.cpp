#include "pointflight/view/web_rules.hpp"

#include <gtest/gtest.h>

#include <string>

namespace pointflight {
namespace {

TEST(WebRules, RangesAreOnesThatAreThere) {
  const auto range = [](const char* header, std::size_t size = 100) {
    const auto found = range_of(header, size);
    return found ? std::pair(found->from, found->to) : std::pair<std::size_t, std::size_t>(9, 8);
  };
  const std::pair<std::size_t, std::size_t> none(9, 8);
  EXPECT_EQ(range("bytes=0-9"), std::pair(0ul, 9ul));
  EXPECT_EQ(range("bytes=90-"), std::pair(90ul, 99ul));
  EXPECT_EQ(range("bytes=-5"), std::pair(95ul, 99ul));
  EXPECT_EQ(range("bytes=-500"), std::pair(0ul, 99ul));
  EXPECT_EQ(range("bytes=50-1000"), std::pair(50ul, 99ul));
  for (const char* wrong : {"",
                            "0-9",
                            "bytes=",
                            "bytes=-",
                            "bytes=-0",
                            "bytes=100-",
                            "bytes=9-5",
                            "bytes=0-1,3-4",
                            "bytes=x-",
                            "bytes=0-x",
                            "bytes=0-18446744073709551616",
                            "lines=0-1",
                            "bytes= 0-1"}) {
    EXPECT_EQ(range(wrong), none) << wrong;
  }
  EXPECT_EQ(range("bytes=0-0", 0), none);
}

TEST(WebRules, TheNewerNameOfTheProtocolIsPreferred) {
  EXPECT_EQ(chosen_subprotocol("foxglove.websocket.v1, foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chosen_subprotocol(" foxglove.websocket.v1 "), "foxglove.websocket.v1");
  EXPECT_EQ(chosen_subprotocol("chat,foxglove.sdk.v11"), "");
  EXPECT_EQ(chosen_subprotocol(""), "");
}

TEST(WebRules, SayWhoMayWatchAndCommand) {
  const std::string token = "0123456789abcdef";
  const auto may = [&](std::string_view host,
                       std::optional<std::string_view> origin,
                       std::string_view target = "/",
                       bool control = true) {
    const Permission p = permission_of({host, origin, target}, token, control);
    return std::string(p.watch ? "watch" : "no") + (p.command ? ", command" : "");
  };
  for (const char* host :
       {"127.0.0.1:8765", "localhost:8765", "localhost", "[::1]:8765", "192.168.1.5"}) {
    EXPECT_EQ(may(host, std::nullopt), "watch, command") << host;
    EXPECT_EQ(may(host, std::nullopt, "/", false), "watch") << host;
  }
  // a name that somebody has pointed here
  for (const char* host :
       {"evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "", "[::1", "1.2.3"}) {
    EXPECT_EQ(may(host, std::nullopt), "no") << host;
    EXPECT_EQ(may(host, "http://" + std::string(host)), "no") << host;
  }
  const char* own = "127.0.0.1:8765";
  EXPECT_EQ(may(own, "http://127.0.0.1:8765"), "watch");
  EXPECT_EQ(may(own, "http://127.0.0.1:8765", "/?token=" + token), "watch, command");
  EXPECT_EQ(may(own, "http://127.0.0.1:8765", "/?a=b&token=" + token + "&c"), "watch, command");
  EXPECT_EQ(may(own, "http://127.0.0.1:8765", "/?token=" + token, false), "watch");
  EXPECT_EQ(may(own, "http://127.0.0.1:8765", "/?token=" + token + "0"), "watch");
  EXPECT_EQ(may(own, "http://127.0.0.1:8765", "/?xtoken=" + token), "watch");
  for (const char* origin :
       {"https://127.0.0.1:8765", "http://127.0.0.1:8766", "null", "", "https://evil.example"}) {
    EXPECT_EQ(may(own, origin, "/?token=" + token), "no") << origin;
  }
  EXPECT_EQ(may(own, "https://app.foxglove.dev", "/?token=" + token), "watch");
  EXPECT_EQ(may(own, "https://app.foxglove.dev.evil.example"), "no");
}

}  // namespace
}  // namespace pointflight
