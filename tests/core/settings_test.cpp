#include "pointflight/core/settings.hpp"

#include <gtest/gtest.h>

#include <array>

#include "pointflight/core/resources.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

struct Wheel {
  double radius = 0.5;
};

struct Cart {
  double speed = 1.0;
  std::int64_t seats = 2;
  bool roof = false;
  std::string name = "cart";
  std::string color = "red";
  Eigen::Vector3d size = {1, 2, 3};
  std::vector<Eigen::Vector3d> stops;
  std::vector<Wheel> wheels = {Wheel{}, Wheel{}};
};

void describe(SettingsVisitor& v, Cart& cart) {
  constexpr std::array<std::string_view, 2> kColors = {"red", "blue"};
  v.value({"speed", "m/s", "how fast", 0, 10}, cart.speed);
  v.section({"body", "", "its body"}, [&](SettingsVisitor& w) {
    w.value({"seats", "", "places", 1, 8}, cart.seats);
    w.value({"roof", "", "against rain"}, cart.roof);
    w.value({"size", "m", "of the box", 0, 100}, cart.size);
  });
  v.value({"name", "", "what it is called"}, cart.name);
  v.choice({"color", "", "of the paint"}, cart.color, kColors);
  v.value({"stops", "m", "on the way"}, cart.stops);
  v.list({"wheels", "", "what it rolls on"}, cart.wheels, [](SettingsVisitor& w, Wheel& wheel) {
    w.value({"radius", "m", "of the wheel", 0.1, 2, true}, wheel.radius);
  });
}

Cart parse(std::string_view text) {
  Cart cart;
  SettingsReader reader(text, "cart.yaml");
  describe(reader, cart);
  reader.finish();
  return cart;
}

std::string parse_error(std::string_view text) {
  return error_of([&] { parse(text); });
}

TEST(Settings, ReadsWhatIsThereAndKeepsDefaults) {
  const Cart cart = parse(
      "speed: 2.5\nbody:\n  roof: true\n  size: [4, 5, 6]\nstops:\n  - [1, 2, 3]\n"
      "wheels:\n  - radius: 0.2\n");
  EXPECT_EQ(cart.speed, 2.5);
  EXPECT_TRUE(cart.roof);
  EXPECT_EQ(cart.seats, 2);
  EXPECT_EQ(cart.size, Eigen::Vector3d(4, 5, 6));
  ASSERT_EQ(cart.stops.size(), 1u);
  ASSERT_EQ(cart.wheels.size(), 1u);
  EXPECT_EQ(cart.wheels[0].radius, 0.2);
}

TEST(Settings, WhatIsWrittenReadsBackTheSame) {
  Cart cart;
  cart.speed = 0.1;
  cart.name = "a \"name\": with # signs";
  cart.stops = {{1, 2, 3}, {-0.25, 0, 1e-3}};
  cart.wheels = {Wheel{0.3}, Wheel{0.7}};
  SettingsWriter writer;
  describe(writer, cart);
  const Cart again = parse(writer.text());
  EXPECT_EQ(again.speed, cart.speed);
  EXPECT_EQ(again.name, cart.name);
  EXPECT_EQ(again.stops, cart.stops);
  ASSERT_EQ(again.wheels.size(), 2u);
  EXPECT_EQ(again.wheels[1].radius, 0.7);
}

TEST(Settings, ErrorsNameFileLineKeyAndAWayOut) {
  struct Case {
    const char* text;
    const char* place;
    const char* words;
  };
  const Case cases[] = {
      {"name: x\nsped: 2\n", "cart.yaml:2: sped", "did you mean 'speed'"},
      {"speed: 2 m/s\n", "cart.yaml:1: speed", "plain number in m/s, found '2 m/s'"},
      {"speed: -1\n", "cart.yaml:1: speed", "out of range; give a number in m/s between 0 and 10"},
      {"speed: .nan\n", "cart.yaml:1: speed", "plain number"},
      {"speed: 0x10\n", "cart.yaml:1: speed", "plain number"},
      {"body:\n  seats: 1.5\n", "cart.yaml:2: body.seats", "whole number"},
      {"body:\n  roof: yes\n", "cart.yaml:2: body.roof", "true or false"},
      {"body: 3\n", "cart.yaml:1: body", "key: value"},
      {"color: green\n", "cart.yaml:1: color", "one of: red, blue"},
      {"speed: 1\nspeed: 2\n", "cart.yaml:2: speed", "stands twice"},
      {"wheels:\n  - {}\n", "wheels[0].radius", "missing; add it"},
      {"stops: [[1, 2]]\n", "cart.yaml:1: stops", "[x, y, z]"},
      {"speed: [1\n", "cart.yaml:", "not valid YAML"},
      {"just text\n", "cart.yaml", "key: value"},
      {"speed: 1\n---\nspeed: 2\n", "cart.yaml:2", "a second document (---) begins"},
      {"speed: 1\n---\n", "cart.yaml:2", "a second document (---) begins"},
      {"speed: 1\n}\n", "cart.yaml:2", "not valid YAML"},
      {"{speed: 1}\n,l", "cart.yaml:2", "not valid YAML"},
      {",l", "cart.yaml:1", "not valid YAML"},
      {"", "cart.yaml", "key: value"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.text);
    const std::string error = parse_error(c.text);
    expect_contains(error, c.place);
    expect_contains(error, c.words);
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

TEST(Settings, TheTableListsEveryKeyWithUnitDefaultAndRange) {
  Cart cart;
  SettingsTable table;
  describe(table, cart);
  expect_contains(table.text(), "| `speed` | m/s | `1` | 0 .. 10 | how fast |");
  expect_contains(table.text(), "| `body.seats` |");
  expect_contains(table.text(), "| `wheels[].radius` | m | **required** | 0.1 .. 2 |");
}

struct Engine {
  std::string fuel = "petrol";
  double tank = 50.0;
  double charge = 3.0;
};

void describe(SettingsVisitor& v, Engine& engine) {
  constexpr std::array<std::string_view, 2> kFuels = {"petrol", "current"};
  v.choice({"fuel", "", "what it burns"}, engine.fuel, kFuels);
  v.only_if(engine.fuel == "petrol", "fuel: petrol", [&](SettingsVisitor& w) {
    w.value({"tank", "l", "of the tank", 1, 100, true}, engine.tank);
  });
  v.only_if(engine.fuel == "current", "fuel: current", [&](SettingsVisitor& w) {
    w.section({"cell", "", "its cell"}, [&](SettingsVisitor& x) {
      x.value({"charge", "Ah", "when full", 0, 10}, engine.charge);
    });
  });
}

Engine parse_engine(std::string_view text) {
  Engine engine;
  SettingsReader reader(text, "engine.yaml");
  describe(reader, engine);
  reader.finish();
  return engine;
}

TEST(Settings, KeysUnderAConditionAreRefusedElsewhere) {
  EXPECT_EQ(parse_engine("fuel: petrol\ntank: 7\n").tank, 7.0);
  EXPECT_EQ(parse_engine("fuel: current\ncell: {charge: 4}\n").charge, 4.0);
  const auto error = [](std::string_view text) { return error_of([&] { parse_engine(text); }); };
  expect_contains(error("fuel: current\ntank: 7\n"),
                  "engine.yaml:2: tank: has no effect here: it is for `fuel: petrol`; remove it or "
                  "set that");
  expect_contains(error("tank: 7\ncell: {charge: 4}\n"), "engine.yaml:2: cell: has no effect here");
  // required if the condition holds, and only there
  expect_contains(error("fuel: petrol\n"), "tank: missing");
  EXPECT_EQ(parse_engine("fuel: current\n").charge, 3.0);
}

TEST(Settings, KeysUnderAConditionAreWrittenWhereItHolds) {
  Engine engine;
  engine.fuel = "current";
  SettingsWriter writer;
  describe(writer, engine);
  EXPECT_EQ(writer.text().find("tank"), std::string::npos) << writer.text();
  EXPECT_EQ(parse_engine(writer.text()).fuel, "current");
  // the table has all of them and says what for
  SettingsTable table;
  describe(table, engine);
  expect_contains(table.text(), "of the tank (only `fuel: petrol`) |");
  expect_contains(table.text(),
                  "| `cell.charge` | Ah | `3` | 0 .. 10 | when full (only `fuel: current`) |");
}

TEST(Resources, AnUnknownModelNamesTheKnownOnes) {
  const std::string error = error_of([] { find_model("lidars", "mid36"); });
  expect_contains(error, "avia");
  expect_contains(error, "did you mean 'mid360'");
}

/// A file of its own names: {tea: [hot], price: {from: 1}}
struct Dish {
  std::string key;
  YamlList ways;
  double from = 0.0;
};
struct Menu {
  std::vector<std::string> words;
  double guests = 1.0;
  std::vector<Dish> dishes;
};
void describe(SettingsVisitor& v, Menu& menu) {
  v.value({"words", "", "any"}, menu.words);
  v.section({"table", "", "short: a number of guests"}, {.one = "guests"}, [&](SettingsVisitor& w) {
    w.value({"guests", "", "at it", 1, 9}, menu.guests);
    w.others({"", "", ""}, {.list = "ways"}, menu.dishes, [](SettingsVisitor& u, Dish& dish) {
      u.value({"ways", "", "of having it"}, dish.ways);
      u.value({"from", "", "the price"}, dish.from);
    });
  });
}
Menu menu_of(std::string_view text) {
  Menu menu;
  SettingsReader reader(text, "menu.yaml");
  describe(reader, menu);
  reader.finish();
  return menu;
}

TEST(Settings, SectionsMayHaveAShortForm) {
  EXPECT_EQ(menu_of("table: 3\n").guests, 3.0);
  EXPECT_EQ(menu_of("table: {guests: 3}\n").guests, 3.0);
  const auto error = [](std::string_view text) { return error_of([&] { menu_of(text); }); };
  expect_contains(error("table: 30\n"), "menu.yaml:1: table.guests: 30 is out of range");
  expect_contains(error("table: [3]\n"), "menu.yaml:1: table: expected a value or indented");
  expect_contains(error("a: 1\ntable: {tea: 3}\n"), "menu.yaml:2: table.tea: expected a list or");
}

TEST(Settings, AFileMayChooseNamesWhereItIsAllowedTo) {
  const Menu menu = menu_of(
      "words: [a, \"{b} c\"]\ntable:\n  tea: [hot, [1, 2], {cold: true}]\n  a.b[0]: {from: 2}\n");
  EXPECT_EQ(menu.words, (std::vector<std::string>{"a", "{b} c"}));
  ASSERT_EQ(menu.dishes.size(), 2u);
  EXPECT_EQ(menu.dishes[0].key, "tea");
  EXPECT_EQ(menu.dishes[0].ways.items, (std::vector<std::string>{"hot", "[1, 2]", "{cold: true}"}));
  EXPECT_EQ(menu.dishes[1].key, "a.b[0]");
  EXPECT_EQ(menu.dishes[1].from, 2.0);
  SettingsWriter writer;
  Menu written = menu;
  describe(writer, written);
  const Menu again = menu_of(writer.text());
  EXPECT_EQ(again.words, menu.words);
  ASSERT_EQ(again.dishes.size(), 2u);
  EXPECT_EQ(again.dishes[0].ways.items, menu.dishes[0].ways.items);
  EXPECT_EQ(again.dishes[1].from, 2.0);
}

}  // namespace
}  // namespace pointflight
